/* What happens to one lane where a guard has fallen, and at the ends of a period. */
#ifndef STICKSLIP_LANE_EVENT_H
#define STICKSLIP_LANE_EVENT_H

#include "pool.h"

enum {
    LANES_ORDER = 13,   /* of the series */
    LANES_ROUNDS = 1000 /* sub-steps of one lane in a period */
};

/* guard g has fallen at z = (states from the origin of the mode, harmonics), `time` after the strobe: change the mode and
   the states; known: guards that are zero from now on without falling */
void lane_event(const LaneTable *t, Lane *lane, double *z, int g, double time, signed char *known);
/* take up a motion that wants a step; 0 if it is none for lanes at present */
int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion);
/* hand it back; done: it is at the end of the period */
void lane_end(Pool *pool, int64_t slot, LaneMotion *motion, int done);

#endif
