/* Differences of neighbours along the motion of one lane, where it goes on by itself. */
#pragma once

#include "pool.h"

/* where a guard of a lane falls: by how much later neighbours meet it, and the rates of the harmonics */
typedef struct {
    double later[MODEL_NX], turn[2 * LANES_NH];
} Fall;

/* what leaves contacts held goes on: the rest is taken out */
void tangents_held(const LaneTable *t, Lane *lane, int64_t directions);
/* from where neighbours meet a guard, through the event that the lane has just had */
void tangents_jump(const LaneTable *t, Lane *lane, const Fall *fall, int64_t directions);
/* the speed of the motion at the end of a period, if it is wanted */
void tangents_end(const LaneTable *t, Lane *lane);
