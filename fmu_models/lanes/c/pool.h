/* Motions that are stepped together, as every target sees them (lane_code.h). */
#ifndef STICKSLIP_POOL_H
#define STICKSLIP_POOL_H

#include "lane_table.h"

/* what one motion has on its way over a period */
typedef struct {
    double x[MODEL_NX]; /* where it is at the points of the grid away from home, from the origin of its mode */
    int mode, started;
    int failed; /* not decided: the series of the engine make this step */
    /* differences of neighbours, and up to which point of the grid their steps at home are made */
    double tangent[MODEL_NX][MODEL_NX];
    int brought;
    LaneMotion motion;
} Lane;

typedef struct {
    int64_t motions;
    LaneTable *tables;
    Lane *lanes;
    int32_t *queue;
    double *columns; /* of the home steps, group by group (lane_code.h) */
    /* differences that are followed, motion by motion, as the caller has them */
    int64_t directions;
    double *tangents;
} Pool;

/* the offset of a part of the room */
static inline int64_t pool_reserve(int64_t *used, int64_t bytes)
{
    const int64_t at = *used;
    *used += (bytes + 63) / 64 * 64;
    return at;
}

#endif
