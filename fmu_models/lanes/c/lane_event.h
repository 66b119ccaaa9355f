/* What happens to one lane where a guard has fallen, and at the ends of a period. */
#pragma once

#include "pool.h"

enum {
    LANES_ORDER = 13,    /* of the series */
    LANES_GUESS = 7,     /* of the part of it that is searched for a root first */
    LANES_ROUNDS = 1000, /* sub-steps of one lane in a period */
    LANES_ZERO = 8       /* zeros of a guard that stays zero over a sub-step */
};

/* guard g has fallen in a lane, so long after the strobe: change its mode, its states, its known zeros and, where that takes
   a while, the time. What is not decided here the engine decides; if it does not either the lane has failed. 1 if neighbours
   take the same way (lane_tangents.c) */
int lane_event(Pool *pool, int64_t slot, int g, double *time);
/* the same of a stop where no force holds a contact, at a depth that changes at a rate: states are not looked at */
void lane_stop(LaneTable *t, Lane *lane, int g, double depth, double rate, double time);
/* take up a motion that wants a step; 0 if it is none for lanes at present */
int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion);
/* hand it back; done: it is at the end of the period */
void lane_end(Pool *pool, int64_t slot, LaneMotion *motion, int done);
/* whether differences may have been lost on the way from a strobe to the next: a contact was closed or stuck */
int lane_loses(const LaneMotion *from, const LaneMotion *to);
