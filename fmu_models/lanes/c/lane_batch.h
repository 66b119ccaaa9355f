/* Motions side by side, from their queues and to the next; included once per target by lane_code.h. */
/* motions side by side; a place without one repeats another, and nothing comes of it */
typedef struct {
    Lane *lane[LANES_W];
    LaneTable *table[LANES_W];
    const LaneMode *mode[LANES_W];
    int64_t slot[LANES_W];
    int count; /* how many */
    M there, released;
    V z[LANES_Z], left, longest;
    V flow[LANES_NF], constant[MODEL_NX], guard[LANES_NR], guard_constant[LANES_NG], wave[LANES_NH];
    M known[LANES_NG]; /* how many times over a guard is zero at the start */
    /* differences, in pairs; at an event by how much later neighbours meet it, and the rates of the harmonics there */
    V tangent[MODEL_NX + 1][MODEL_NX], later[MODEL_NX], turn[2 * LANES_NH];
} NAME(Batch);

#include "lane_variation.h"

/* the numbers of the modes that motions are in */
static INLINE void NAME(gather_mode)(NAME(Batch) * b)
{
    V released;
    EACH(b->longest, b->mode[l]->longest)
    EACH(released, b->mode[l]->on_grid && b->mode[l]->home < 0)
    b->released = released != NAME(fill)(0.0);
    for (int e = 0; e < LANES_FLOW; e++)
        EACH(b->flow[e], b->mode[l]->flow[e])
    for (int i = 0; i < MODEL_NX; i++)
        EACH(b->constant[i], b->mode[l]->constant[i])
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++)
        EACH(b->guard[e], b->mode[l]->guard[e])
    for (int g = 0; g < LANES_GUARDS; g++)
        EACH(b->guard_constant[g], b->mode[l]->guard_constant[g])
}

/* the last of a queue */
static INLINE void NAME(gather)(Pool *pool, int which, NAME(Batch) * b)
{
    Queue *q = &pool->queue[which];
    b->count = q->count < LANES_W ? (int)q->count : LANES_W;
    q->count -= b->count;
    for (int l = 0; l < LANES_W; l++) {
        const int64_t slot = q->slot[q->count + (l < b->count ? l : 0)];
        b->slot[l] = slot;
        b->lane[l] = &pool->lanes[slot];
        b->table[l] = &pool->tables[slot];
        b->mode[l] = &b->table[l]->mode[b->lane[l]->mode];
        b->there[l] = l < b->count ? -1 : 0;
    }
    for (int j = 0; j < LANES_Z; j++)
        EACH(b->z[j], b->lane[l]->z[j])
    EACH(b->left, b->lane[l]->left)
    for (int g = 0; g < LANES_GUARDS; g++)
        for (int l = 0; l < LANES_W; l++)
            b->known[g][l] = b->lane[l]->known[g];
    for (int j = 0; j < LANES_HARMONICS; j++)
        EACH(b->wave[j], b->table[l]->wave[j])
    NAME(gather_mode)(b);
    NAME(load_tangents)(pool, b);
}

/* the next batch of a lane, or its group, at home at a point of the grid or at the end of the period */
static void NAME(pass_on)(Pool *pool, int64_t slot)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    const LaneMode *mode = &t->mode[lane->mode];
    if (lane->failed) return;
    if (lane->left == 0.0) {
        if (mode->home >= 0 || lane->goal == t->steps) {
            NAME(to_group)(pool, slot);
            return;
        }
        lane->goal = mode->on_grid ? lane->goal + 1 : t->steps;
        lane->left = t->h;
    }
    pool_queue(pool, slot, !mode->on_grid && lane->left >= mode->longest ? QUEUE_STRIDE : QUEUE_SERIES);
}

/* the event of guard g in a lane; fall: NULL, or that of its differences */
static void NAME(happen)(Pool *pool, int64_t slot, int g, const Fall *fall)
{
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    const int was_on_grid = t->mode[lane->mode].on_grid;
    const double before = t->h * lane->goal - lane->left;
    double time = before;
    const int told = lane_event(pool, slot, g, &time);
    if (fall && !told)
        lane->failed = 1;
    else if (fall)
        tangents_jump(t, lane, fall, pool->directions);
    /* away from home nothing is to be done at the points of the grid */
    const int on_grid = t->mode[lane->mode].on_grid;
    if (on_grid != was_on_grid || time != before) {
        const int next = (int)(time / t->h) + 1;
        lane->goal = on_grid && next < t->steps ? next : t->steps;
        lane->left = fmax(t->h * lane->goal - time, 0.0);
    }
}

/* lane l of a batch into its record */
static INLINE void NAME(keep)(const Pool *pool, const NAME(Batch) * b, int l)
{
    Lane *lane = b->lane[l];
    for (int j = 0; j < LANES_Z; j++)
        lane->z[j] = b->z[j][l];
    lane->left = b->left[l];
    for (int g = 0; g < LANES_GUARDS; g++)
        lane->known[g] = b->known[g][l];
    NAME(save_tangents)(pool, b, l);
    lane->failed |= ++lane->rounds > LANES_ROUNDS;
}
