/* Differences of neighbours along the motion of one lane: its steps at home, and its events (lane_tangents.c). */
#pragma once

#include "pool.h"

/* where a lane was when a guard fell: mode, and states from its origin with harmonics */
typedef struct {
    int mode;
    double z[LANES_Z];
} Fall;

/* at the strobe where a period begins, and where it ends: there the speed of the motion too */
void tangents_begin(const Pool *pool, int64_t slot);
void tangents_end(const Pool *pool, int64_t slot);
/* by the steps at home that it has made since, up to point k of the grid */
void tangents_bring(const Pool *pool, int64_t slot, int k);
/* through the event of guard g, from the fall to z */
void tangents_jump(const LaneTable *t, Lane *lane, const Fall *fall, const double *z, int g, int64_t directions);
