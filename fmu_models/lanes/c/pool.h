/* Motions that are stepped together, as every target sees them (lane_code.h). */
#pragma once

#include "lane_table.h"

/* what one motion has on its way over a period */
typedef struct {
    double z[LANES_Z];       /* states, from the origin of its mode, and harmonics, away from the groups */
    double left;             /* time to the point of the grid that it goes to */
    int64_t known[LANES_NG]; /* how many times over a guard is zero now without falling; LANES_ZERO: it stays so */
    int goal, rounds;        /* that point; sub-steps in this period */
    int mode;
    unsigned settled;                   /* a bit for each home mode whose numbers its group has */
    int failed;                         /* not decided: the series of the engine make this step */
    double tangent[MODEL_NX][MODEL_NX]; /* differences of neighbours */
    int struck, friction; /* by its last event: which contact had an impact, -1: none, and how it rubbed */
    LaneMotion motion;
} Lane;

/* what motions away from the groups wait for (lane_code.h) */
enum { QUEUE_EVENT, QUEUE_SERIES, QUEUE_STRIDE, QUEUES };

typedef struct {
    int64_t count;
    int32_t *slot;
} Queue;

typedef struct {
    int64_t motions;
    LaneTable *tables;
    Lane *lanes;
    Queue queue[QUEUES];
    int earliest;        /* point of the grid that one of them has come to, counted as groups do (lane_home.h) */
    LaneResolve resolve; /* what decides events that lanes leave, and whom it asks for */
    void *context;
    double *columns; /* of the home steps, group by group (lane_home.h) */
    double bound;    /* a motion with a state beyond it is the caller's */
    /* differences that are followed, and their growth, as the caller has them */
    int64_t directions;
    double *tangents, *growth;
} Pool;

/* what decays comes to zero at a strobe: numbers near the least ones slow down some processors, and would stay there */
#define POOL_LEAST 1e-280
static inline double pool_flushed(double a) { return fabs(a) < POOL_LEAST ? 0.0 : a; }

static inline void pool_queue(Pool *pool, int64_t slot, int which)
{
    Queue *q = &pool->queue[which];
    q->slot[q->count++] = (int32_t)slot;
}

static inline int64_t pool_waiting(const Pool *pool)
{
    int64_t all = 0;
    for (int q = 0; q < QUEUES; q++)
        all += pool->queue[q].count;
    return all;
}

/* the queue that most wait in; QUEUES: none does */
static inline int pool_fullest(const Pool *pool)
{
    int fullest = QUEUES;
    for (int q = QUEUES - 1; q >= 0; q--)
        if (pool->queue[q].count > (fullest < QUEUES ? pool->queue[fullest].count - 1 : 0)) fullest = q;
    return fullest;
}

/* the offset of a part of the room */
static inline int64_t pool_reserve(int64_t *used, int64_t bytes)
{
    const int64_t at = *used;
    *used += (bytes + 63) / 64 * 64;
    return at;
}
