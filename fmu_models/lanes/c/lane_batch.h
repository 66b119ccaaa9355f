/* Sub-steps by series of motions that want one, in all lanes; included once per target by lane_code.h. */
/* motions side by side; a place without one repeats another, and nothing comes of it */
typedef struct {
    Lane *lane[LANES_W];
    const LaneMode *mode[LANES_W];
    int64_t slot[LANES_W];
    int count;
    M there;
    V z[LANES_Z], left, longest;
    V flow[LANES_NF], constant[MODEL_NX], guard[LANES_NR], guard_constant[LANES_NG], wave[LANES_NH];
    M known[LANES_NG];
} NAME(Batch);

/* the last of a queue */
static INLINE void NAME(gather)(Pool *pool, int which, NAME(Batch) * b)
{
    Queue *q = &pool->queue[which];
    const LaneTable *table[LANES_W];
    b->count = q->count < LANES_W ? (int)q->count : LANES_W;
    q->count -= b->count;
    for (int l = 0; l < LANES_W; l++) {
        const int64_t slot = q->slot[q->count + (l < b->count ? l : 0)];
        b->slot[l] = slot;
        b->lane[l] = &pool->lanes[slot];
        table[l] = &pool->tables[slot];
        b->mode[l] = &table[l]->mode[b->lane[l]->mode];
    }
    EACH(b->there, l < b->count ? -1 : 0)
    for (int j = 0; j < LANES_Z; j++) {
        EACH(b->z[j], b->lane[l]->z[j])
    }
    EACH(b->left, b->lane[l]->left)
    for (int g = 0; g < LANES_GUARDS; g++) {
        EACH(b->known[g], b->lane[l]->known[g])
        EACH(b->guard_constant[g], b->mode[l]->guard_constant[g])
    }
    EACH(b->longest, b->mode[l]->longest)
    for (int e = 0; e < LANES_FLOW; e++) {
        EACH(b->flow[e], b->mode[l]->flow[e])
    }
    for (int i = 0; i < MODEL_NX; i++) {
        EACH(b->constant[i], b->mode[l]->constant[i])
    }
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++) {
        EACH(b->guard[e], b->mode[l]->guard[e])
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        EACH(b->wave[j], table[l]->wave[j])
    }
}

/* the series of the states over a sub-step of length h: its variable runs from 0 to 1 */
static INLINE void NAME(expand)(const NAME(Batch) * b, V h, V (*y)[LANES_Z])
{
    static const double part[] = {1.0,     1.0 / 2, 1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6, 1.0 / 7,
                                  1.0 / 8, 1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13};
    V now[LANES_Z], rates[MODEL_NX], turn[LANES_NH];
    for (int j = 0; j < LANES_Z; j++) {
        y[0][j] = now[j] = b->z[j];
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        turn[j] = h * b->wave[j];
    }
    LANES_UNROLL
    for (int k = 0; k < LANES_ORDER; k++) {
        const V f = h * NAME(fill)(part[k]);
        LANES_FLOW(b->flow, now, rates);
        for (int j = 0; j < LANES_HARMONICS; j++) {
            const V by = turn[j] * NAME(fill)(part[k]);
            const V c = now[MODEL_NX + 2 * j];
            now[MODEL_NX + 2 * j] = -(by * now[MODEL_NX + 2 * j + 1]);
            now[MODEL_NX + 2 * j + 1] = by * c;
        }
        for (int i = 0; i < MODEL_NX; i++) {
            now[i] = f * (k == 0 ? rates[i] + b->constant[i] : rates[i]);
        }
        for (int j = 0; j < LANES_Z; j++) {
            y[k + 1][j] = now[j];
        }
    }
}

/* coefficients of all guards from order 0 to another */
static INLINE void NAME(guards)(const NAME(Batch) * b, V (*y)[LANES_Z], int to, V (*q)[LANES_ORDER + 1])
{
    V g[LANES_NG];
    LANES_UNROLL
    for (int k = 0; k <= to; k++) {
        for (int i = 0; i < LANES_GUARDS; i++) {
            g[i] = k == 0 ? b->guard_constant[i] : NAME(fill)(0.0);
        }
        LANES_GUARD_SUMS(b->guard, y[k], g);
        for (int i = 0; i < LANES_GUARDS; i++) {
            q[i][k] = g[i];
        }
    }
}

/* guards that have been left just now are known to be zero */
static INLINE void NAME(left_now)(NAME(Batch) * b, V (*q)[LANES_ORDER + 1])
{
    const V zero = NAME(fill)(0.0);
    for (int g = 0; g < LANES_GUARDS; g++) {
        b->known[g] |= (M)(q[g][0] == zero) & (M)(q[g][1] > zero);
    }
}

/* lanes in which some guard may fall: what the terms up to the third order, by Bernstein's coefficients, and the bound of
   the others leave open */
static INLINE M NAME(doubtful)(const NAME(Batch) * b, V h, V (*q)[LANES_ORDER + 1])
{
    const V zero = NAME(fill)(0.0);
    const V third = NAME(fill)(1.0 / 3.0);
    const V fourth = (h * h) * (h * h);
    V size[MODEL_NX];
    M found = b->there & ~b->there;
    for (int i = 0; i < MODEL_NX; i++) {
        size[i] = NAME(size)(b->z[i]);
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        V tail;
        EACH(tail, b->mode[l]->tail_constant[g])
        for (int i = 0; i < MODEL_NX; i++) {
            V factor;
            EACH(factor, b->mode[l]->tail[g][i])
            tail += factor * size[i];
        }
        const M known = b->known[g];
        const V a0 = NAME(pick)(known, q[g][1], q[g][0]);
        const V a1 = NAME(pick)(known, q[g][2], q[g][1]);
        const V a2 = NAME(pick)(known, q[g][3], q[g][2]);
        const V a3 = NAME(pick)(known, zero, q[g][3]);
        const V b1 = a0 + third * a1;
        const V b2 = a0 + third * (a1 + a1 + a2);
        const V b3 = a0 + a1 + a2 + a3;
        const V low = NAME(least)(NAME(least)(a0, b1), NAME(least)(b2, b3));
        found |= ~(M)(low > tail * fourth);
    }
    return found & b->there;
}

/* without the root at the start, where one is known */
static INLINE void NAME(deflate)(V *q, M known)
{
    if (!NAME(any)(known)) {
        return;
    }
    for (int k = 0; k < LANES_ORDER; k++) {
        q[k] = NAME(pick)(known, q[k + 1], q[k]);
    }
    q[LANES_ORDER] = NAME(pick)(known, NAME(fill)(0.0), q[LANES_ORDER]);
}

/* states and time at a place u of the sub-step */
static INLINE void NAME(go)(NAME(Batch) * b, V (*y)[LANES_Z], V h, V u)
{
    const M whole = (M)(u == NAME(fill)(1.0)) & (M)(h == b->left);
    for (int j = 0; j < LANES_Z; j++) {
        b->z[j] = y[LANES_ORDER][j];
    }
    LANES_UNROLL
    for (int n = LANES_ORDER - 1; n >= 0; n--) {
        for (int j = 0; j < LANES_Z; j++) {
            b->z[j] = b->z[j] * u + y[n][j];
        }
    }
    b->left = NAME(pick)(whole, NAME(fill)(0.0), b->left - h * u);
    b->left = NAME(most)(b->left, NAME(fill)(0.0));
}

/* the next of a lane: at a point of the grid, at the end of the period, undecided, or its next batch */
static INLINE void NAME(pass_on)(Pool *pool, int64_t slot)
{
    Lane *lane = &pool->lanes[slot];
    const LaneMode *mode = &pool->tables[slot].mode[lane->mode];
    if (lane->failed) {
        NAME(Group) *g = NAME(group)(pool, slot);
        MARK(g->running, slot % LANES_W) = 0;
    } else if (lane->left == 0.0) {
        NAME(to_group)(pool, slot, lane->goal);
    } else {
        pool_queue(pool, slot, mode->home < 0 && lane->left >= mode->longest ? QUEUE_STRIDE : QUEUE_SERIES);
    }
}

/* the event of guard g in a lane */
static void NAME(happen)(Pool *pool, int64_t slot, int g)
{
    signed char known[LANES_NG];
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    const double time = t->h * lane->goal - lane->left;
    lane_event(t, lane, lane->z, g, time, known);
    for (int i = 0; i < LANES_GUARDS; i++) {
        lane->known[i] = known[i] ? -1 : 0;
    }
    /* away from home nothing is to be done at the points of the grid */
    const int next = (int)(time / t->h) + 1;
    lane->goal = t->mode[lane->mode].home >= 0 && next < t->steps ? next : t->steps;
    lane->left = fmax(t->h * lane->goal - time, 0.0);
}

/* lanes from a batch into their records */
static INLINE void NAME(scatter)(const NAME(Batch) * b, M moved)
{
    for (int l = 0; l < b->count; l++) {
        Lane *lane = b->lane[l];
        if (!moved[l]) {
            continue;
        }
        for (int j = 0; j < LANES_Z; j++) {
            lane->z[j] = b->z[j][l];
        }
        lane->left = b->left[l];
        memset(lane->known, 0, sizeof lane->known);
        lane->failed |= ++lane->rounds > LANES_ROUNDS;
    }
}

/* a sub-step in which some guard may fall, of as many lanes as there are */
static __attribute__((noinline)) void NAME(event_batch)(Pool *pool)
{
    NAME(Batch) b;
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    V guard;
    M undecided;
    NAME(gather)(pool, QUEUE_EVENT, &b);
    const V h = NAME(least)(b.left, b.longest);
    NAME(expand)(&b, h, y);
    NAME(guards)(&b, y, LANES_ORDER, q);
    NAME(left_now)(&b, q);
    for (int g = 0; g < LANES_GUARDS; g++) {
        NAME(deflate)(q[g], b.known[g]);
    }
    const V u = NAME(search)(q, b.there, &guard, &undecided);
    NAME(go)(&b, y, h, u);
    NAME(scatter)(&b, b.there);
    for (int l = 0; l < b.count; l++) {
        const int g = (int)guard[l];
        b.lane[l]->failed |= undecided[l] != 0;
        if (!b.lane[l]->failed && g >= 0) {
            NAME(happen)(pool, b.slot[l], g);
        }
        NAME(pass_on)(pool, b.slot[l]);
    }
}

/* a sub-step in which probably none falls */
static __attribute__((noinline)) void NAME(series_batch)(Pool *pool)
{
    NAME(Batch) b;
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    NAME(gather)(pool, QUEUE_SERIES, &b);
    const V h = NAME(least)(b.left, b.longest);
    NAME(expand)(&b, h, y);
    NAME(guards)(&b, y, 3, q);
    NAME(left_now)(&b, q);
    const M open = NAME(doubtful)(&b, h, q);
    NAME(go)(&b, y, h, NAME(fill)(1.0));
    NAME(scatter)(&b, b.there & ~open);
    for (int l = 0; l < b.count; l++) {
        if (open[l]) {
            pool_queue(pool, b.slot[l], QUEUE_EVENT);
        } else {
            NAME(pass_on)(pool, b.slot[l]);
        }
    }
}
