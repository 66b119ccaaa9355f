/* What happens to one lane where a guard has fallen, and at the ends of a period. */
#ifndef STICKSLIP_LANE_EVENT_H
#define STICKSLIP_LANE_EVENT_H

#include "pool.h"

enum {
    LANES_ORDER = 16,   /* of the series */
    LANES_GUESS = 8,    /* of the part of it that is searched for a root first */
    LANES_ROUNDS = 1000, /* sub-steps of one lane in a period */
    LANES_ZERO = 8       /* zeros of a guard that stays zero over a sub-step */
};

/* guard g has fallen at z = (states from the origin of the mode, harmonics), `time` after the strobe, with all that
   `falls`: change the mode, the states and, where that takes a while, the time; known: how many times over each guard is
   zero from then on without falling, LANES_ZERO: it stays so. What is not decided here the engine decides; if it does
   not either the lane has failed */
void lane_event(Pool *pool, int64_t slot, double *z, int g, const signed char *falls, double *time, signed char *known);
/* take up a motion that wants a step; 0 if it is none for lanes at present */
int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion);
/* hand it back; done: it is at the end of the period */
void lane_end(Pool *pool, int64_t slot, LaneMotion *motion, int done);

#endif
