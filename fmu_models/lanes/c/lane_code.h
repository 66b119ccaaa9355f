/*
 * Steps of many motions from strobe to strobe, included once per target: LANES_W motions to a vector, NAME tells the
 * inclusions apart. Every lane is computed by the same operations in the same order whatever their number: results do
 * not depend on the target, nor on who is in the other lanes.
 *
 *     for each point of the grid    all motions at home: one exact step, certified to meet nothing (lane_home.h)
 *                                   the others (a guard may fall, or a contact touches) are queued, and go through
 *                                   batches until they are at home at a point of the grid; each takes as many motions
 *                                   as there are lanes, of those that want the same, and keeps them while most of
 *                                   them want the same next
 *     QUEUE_EVENT    series of the states over a sub-step, its guards are polynomials: to the earliest root, where the
 *                    mode changes, or to the end (lane_fall.h, lane_roots.h)
 *     QUEUE_SERIES   the same where probably none falls, up to a time that is given: if one may, to QUEUE_EVENT
 *                    (lane_series.h)
 *     QUEUE_STRIDE   away from home, exact steps of one length until one may (lane_stride.h)
 */
#include "lane_tangents.h"
#include "lane_vectors.h"

#include "lane_home.h"
#include "lane_roots.h"

#include "lane_batch.h"
#include "lane_stops.h"
#include "lane_series.h"
#include "lane_fall.h"
#include "lane_stride.h"

/* all queued lanes, to where they are at home at a point of the grid, or to the end */
static __attribute__((noinline)) void NAME(events)(Pool *pool)
{
    static void (*const step[])(Pool *, NAME(Batch) *, M) = {NAME(event), NAME(series), NAME(stride)};
    NAME(Batch) b;
    for (int which = pool_fullest(pool); which < QUEUES; which = pool_fullest(pool)) {
        NAME(gather)(pool, which, &b);
        for (int next = which; next < QUEUES; next = NAME(next)(&b))
            step[next](pool, &b, b.wants == NAME(none)() + next);
        NAME(scatter)(pool, &b);
    }
}

/* all motions that want it, by one period; 0 if one of them needs the caller now */
static int NAME(period)(Pool *pool, LaneMotion *motions)
{
    int on = 1;
    const int64_t groups = (pool->motions + LANES_W - 1) / LANES_W;
    pool->earliest = LANES_GRID;
    for (int64_t group = 0; group < groups && pool->directions > 0; group++)
        NAME(begin_tangents)(pool, group, NAME(home)(pool, group)->group.tangent);
    for (int64_t slot = 0; slot < pool->motions; slot++) {
        NAME(Group) *g = NAME(group)(pool, slot);
        Lane *lane = &pool->lanes[slot];
        for (int h = 0; h < LANES_HOMES; h++)
            AT(g->at[h], slot % LANES_W) = -1.0;
        if (!lane_begin(pool, slot, &motions[slot])) {
            lane->failed = 1;
            continue;
        }
        lane->goal = lane->rounds = 0;
        for (int i = 0; i < MODEL_NX; i++)
            AT(g->x[i], slot % LANES_W) = lane->z[i];
        if (pool->tables[slot].mode[lane->mode].home >= 0)
            NAME(arrive)(pool, g, slot);
        else
            NAME(go_alone)(pool, slot, 0);
        if (pool->growth) tangents_held(&pool->tables[slot], lane, pool->directions);
    }
    /* those at home go ahead until the others fill a batch; few, whose events come at other times, to the end */
    for (int at = pool->earliest;; at = pool->earliest) {
        for (; at < LANES_GRID && pool_waiting(pool) < LANES_W; at++)
            for (int64_t group = 0; group < groups; group++)
                NAME(advance)(pool, group, at);
        if (pool_waiting(pool) == 0) break;
        pool->earliest = at;
        NAME(events)(pool);
    }
    for (int64_t group = 0; group < groups; group++) {
        NAME(Group) *g = &NAME(home)(pool, group)->group;
        M there = NAME(none)();
        M losing = NAME(none)();
        for (int l = 0; l < LANES_W && group * LANES_W + l < pool->motions; l++) {
            const int64_t slot = group * LANES_W + l;
            Lane *lane = &pool->lanes[slot];
            if (!motions[slot].wanted) continue;
            for (int i = 0; i < MODEL_NX; i++)
                lane->z[i] = AT(g->x[i], l);
            there[l] = lane->failed ? 0 : -1;
            losing[l] = lane_loses(&motions[slot], &lane->motion) ? -1 : 0;
            if (!lane->failed) tangents_end(&pool->tables[slot], lane);
            on &= !lane->failed && lane_end(pool, slot, &motions[slot]);
        }
        if (pool->directions > 0) on &= NAME(end_tangents)(pool, group, g->tangent, there, losing);
    }
    return on;
}

#undef V
#undef M
#undef INLINE
#undef AT
#undef EACH
#undef WHERE
#undef LANES_W
#undef NAME
