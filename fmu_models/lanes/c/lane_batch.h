/* Motions side by side, from their queues and to the next; included once per target by lane_code.h. */
/* motions side by side; a place without one repeats another, and nothing comes of it */
typedef struct {
    Lane *lane[LANES_W];
    LaneTable *table[LANES_W];
    const LaneMode *mode[LANES_W];
    int64_t slot[LANES_W];
    int count;
    M wants; /* what each wants next, one of the queues; QUEUES: nothing, or that it is in its group */
    M released;
    V z[LANES_Z], left, longest;
    V flow[LANES_NF], constant[MODEL_NX], guard[LANES_NR], guard_constant[LANES_NG], wave[LANES_NH];
    M known[LANES_NG]; /* how many times over a guard is zero now */
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

/* what the record of lane l says, into its place of a batch */
static INLINE void NAME(fetch)(const Pool *pool, NAME(Batch) * b, int l)
{
    const Lane *lane = b->lane[l];
    b->mode[l] = &b->table[l]->mode[lane->mode];
    for (int j = 0; j < LANES_Z; j++)
        AT(b->z[j], l) = lane->z[j];
    AT(b->left, l) = lane->left;
    for (int g = 0; g < LANES_GUARDS; g++)
        b->known[g][l] = lane->known[g];
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            AT(b->tangent[n][i], l) = lane->tangent[n][i];
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
        b->wants[l] = l < b->count ? which : QUEUES;
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

/* those of a batch that want something still, back to the queues */
static INLINE void NAME(scatter)(Pool *pool, const NAME(Batch) * b)
{
    for (int l = 0; l < b->count; l++) {
        if (b->wants[l] == QUEUES) continue;
        NAME(keep)(pool, b, l);
        pool_queue(pool, b->slot[l], (int)b->wants[l]);
    }
}

/* what three of four of a batch want next; QUEUES: there is nothing */
static INLINE int NAME(next)(const NAME(Batch) * b)
{
    for (int which = 0; which < QUEUES; which++) {
        int count = 0;
        for (int l = 0; l < LANES_W; l++)
            count += b->wants[l] == which;
        if (count > 0 && 4 * count >= 3 * b->count) return which;
    }
    return QUEUES;
}

/* what lane l wants after a sub-step; it is handed to its group at home at a point of the grid, or at the end of the
   period */
static INLINE void NAME(pass_on)(Pool *pool, NAME(Batch) * b, int l)
{
    Lane *lane = b->lane[l];
    const LaneTable *t = b->table[l];
    const LaneMode *mode = b->mode[l];
    double left = b->left[l];
    int next = QUEUES;
    lane->failed |= lane->rounds > LANES_ROUNDS;
    if (!lane->failed && left == 0.0 && (mode->home >= 0 || lane->goal == t->steps)) {
        NAME(Group) *g = NAME(group)(pool, b->slot[l]);
        for (int i = 0; i < MODEL_NX; i++)
            AT(g->x[i], b->slot[l] % LANES_W) = b->z[i][l];
        for (int n = 0; n < pool->directions; n++)
            for (int i = 0; i < MODEL_NX; i++)
                AT(g->tangent[n][i], b->slot[l] % LANES_W) = b->tangent[n][i][l];
        NAME(arrive)(pool, g, b->slot[l]);
    } else if (!lane->failed) {
        if (left == 0.0) {
            lane->goal = mode->on_grid ? lane->goal + 1 : t->steps;
            left = t->h;
            AT(b->left, l) = left;
        }
        next = !mode->on_grid && left >= mode->longest ? QUEUE_STRIDE : QUEUE_SERIES;
    }
    b->wants[l] = next;
}
