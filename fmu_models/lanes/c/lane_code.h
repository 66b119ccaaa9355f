/*
 * Steps of many motions from strobe to strobe, included once per target: LANES_W motions to a vector, NAME tells the
 * inclusions apart. Every lane is computed by the same operations in the same order whatever their number: results do
 * not depend on the target, nor on who is in the other lanes.
 *
 *     for each point of the grid    all motions at home: one exact step, certified to meet nothing (lane_home.h)
 *                                   the others (a guard may fall, or a contact touches) are queued, and go through
 *                                   batches until they are at home at a point of the grid; each takes as many motions
 *                                   as there are lanes, of those that want the same
 *     QUEUE_EVENT    series of the states over a sub-step, its guards are polynomials: to the earliest root, where the
 *                    mode changes, or to the end (lane_batch.h, lane_roots.h)
 *     QUEUE_SERIES   the same where probably none falls, up to a time that is given: if one may, to QUEUE_EVENT
 *     QUEUE_STRIDE   away from home, exact steps of one length until one may (lane_stride.h)
 */
#include "lane_vectors.h"

#include "lane_home.h"
#include "lane_roots.h"

#include "lane_batch.h"
#include "lane_stride.h"

/* all queued lanes, to their next points of the grid */
static __attribute__((noinline)) void NAME(events)(Pool *pool)
{
    while (1) {
        Queue *fullest = &pool->queue[0];
        for (int q = 1; q < QUEUES; q++) {
            Queue *one = &pool->queue[q];
            fullest = one->count > fullest->count ? one : fullest;
        }
        if (fullest->count == 0) {
            return;
        }
        switch ((int)(fullest - pool->queue)) {
        case QUEUE_EVENT: NAME(event_batch)(pool); break;
        case QUEUE_SERIES: NAME(series_batch)(pool); break;
        default: NAME(stride_batch)(pool);
        }
    }
}

/* all motions that want it, by one period */
static void NAME(period)(Pool *pool, LaneMotion *motions)
{
    const int64_t groups = (pool->motions + LANES_W - 1) / LANES_W;
    int most = 0;
    for (int64_t slot = 0; slot < groups * LANES_W; slot++) {
        NAME(Group) *g = NAME(group)(pool, slot);
        const int l = (int)(slot % LANES_W);
        MARK(g->running, l) = 0;
        if (slot >= pool->motions || !lane_begin(pool, slot, &motions[slot])) {
            continue;
        }
        const LaneTable *t = &pool->tables[slot];
        AT(g->steps, l) = t->steps;
        MARK(g->running, l) = -1;
        NAME(to_group)(pool, slot, 0);
        most = t->steps > most ? t->steps : most;
    }
    for (int k = 0; k < most; k++) {
        for (int64_t n = 0; n < groups; n++) {
            NAME(Group) *g = NAME(group)(pool, n * LANES_W);
            const M left = NAME(advance)(pool, n, k);
            if (!NAME(any)(left)) {
                continue;
            }
            for (int l = 0; l < LANES_W; l++) {
                if (MARK(left, l)) {
                    NAME(from_group)(pool, g, n * LANES_W + l, k);
                }
            }
        }
        NAME(events)(pool);
    }
    for (int64_t slot = 0; slot < pool->motions; slot++) {
        const NAME(Group) *g = NAME(group)(pool, slot);
        const int l = (int)(slot % LANES_W);
        if (MARK(g->running, l)) {
            COLUMN(g->x, MODEL_NX, l, pool->lanes[slot].z)
        }
        if (motions[slot].wanted) {
            lane_end(pool, slot, &motions[slot], MARK(g->running, l) != 0);
        }
    }
}

#undef V
#undef M
#undef INLINE
#undef AT
#undef MARK
#undef EACH
#undef COLUMN
#undef LANES_BYTES
