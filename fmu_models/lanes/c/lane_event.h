/* What happens to one lane where a guard has fallen, and at the ends of a period. */
#ifndef STICKSLIP_LANE_EVENT_H
#define STICKSLIP_LANE_EVENT_H

#include "pool.h"

enum {
    LANES_ORDER = 13,   /* of the series */
    LANES_GUESS = 7,    /* of the part of it that is searched for a root first */
    LANES_ROUNDS = 1000 /* sub-steps of one lane in a period */
};

/* of the fastest impact: the engine completes a chatter from here on (Tolerances.chatter) */
#define LANES_CHATTER 1e-8
/* of the terms of a gap: nearer is at the wall; with room for the rounding of both */
#define LANES_AT_WALL 1e-12
/* of the terms of its rate: a switch that is crossed more slowly may slide along it to rounding */
#define LANES_ALONG 1e-9

/* guard g has fallen at z = (states from the origin of the mode, harmonics), `time` after the strobe: change the mode and
   the states, and mark guards that are zero from now on without falling */
void lane_event(const LaneTable *t, Lane *lane, double *z, int g, double time);
/* take up a motion that wants a step; 0 if it is none for lanes at present */
int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion);
/* hand it back; done: it is at the end of the period */
void lane_end(Pool *pool, int64_t slot, LaneMotion *motion, int done);

#endif
