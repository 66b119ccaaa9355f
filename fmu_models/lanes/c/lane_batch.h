/* Sub-steps by series of motions that want one, in all lanes; included once per target by lane_code.h. */
/* motions side by side; a place without one repeats another, and nothing comes of it */
typedef struct {
    Lane *lane[LANES_W];
    const LaneTable *table[LANES_W];
    const LaneMode *mode[LANES_W];
    int64_t slot[LANES_W];
    int count, before[LANES_W]; /* how many; the mode at the beginning of the batch */
    M there, released;
    V z[LANES_Z], left, longest;
    V flow[LANES_NF], constant[MODEL_NX], guard[LANES_NR], guard_constant[LANES_NG], wave[LANES_NH];
    M known[LANES_NG];
    V tangent[MODEL_NX + 1][MODEL_NX]; /* in pairs */
} NAME(Batch);

#include "lane_variation.h"

/* the numbers of the modes that motions are in */
static INLINE void NAME(gather_mode)(NAME(Batch) * b)
{
    V released;
    EACH(b->longest, b->mode[l]->longest)
    EACH(released, b->mode[l]->on_grid && b->mode[l]->home < 0)
    b->released = released != NAME(fill)(0.0);
    for (int e = 0; e < LANES_FLOW; e++) {
        EACH(b->flow[e], b->mode[l]->flow[e])
    }
    for (int i = 0; i < MODEL_NX; i++) {
        EACH(b->constant[i], b->mode[l]->constant[i])
    }
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++) {
        EACH(b->guard[e], b->mode[l]->guard[e])
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        EACH(b->guard_constant[g], b->mode[l]->guard_constant[g])
    }
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
        b->before[l] = b->lane[l]->mode;
        b->there[l] = l < b->count ? -1 : 0;
    }
    for (int j = 0; j < LANES_Z; j++) {
        EACH(b->z[j], b->lane[l]->z[j])
    }
    EACH(b->left, b->lane[l]->left)
    for (int g = 0; g < LANES_GUARDS; g++) {
        V known;
        EACH(known, b->lane[l]->known[g])
        b->known[g] = known != NAME(fill)(0.0);
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        EACH(b->wave[j], b->table[l]->wave[j])
    }
    NAME(gather_mode)(b);
    NAME(load_tangents)(pool, b);
}

/* the series of the states over a sub-step of length h: its variable runs from 0 to 1. From order LANES_LOW on only the
   endless states have terms */
static INLINE void NAME(expand)(const NAME(Batch) * b, V h, V (*y)[LANES_Z])
{
    /* 1/k! */
    static const double part[] = {1.0,
                                  1.0,
                                  1.0 / 2,
                                  1.0 / 6,
                                  1.0 / 24,
                                  1.0 / 120,
                                  1.0 / 720,
                                  1.0 / 5040,
                                  1.0 / 40320,
                                  1.0 / 362880,
                                  1.0 / 3628800,
                                  1.0 / 39916800,
                                  1.0 / 479001600,
                                  1.0 / 6227020800};
    V now[LANES_Z], rates[MODEL_NX], turn[LANES_NH], flow[LANES_NF];
    for (int j = 0; j < LANES_Z; j++) {
        y[0][j] = now[j] = b->z[j];
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        turn[j] = h * b->wave[j];
    }
    for (int e = 0; e < LANES_FLOW; e++) {
        flow[e] = h * b->flow[e];
    }
    LANES_UNROLL
    for (int k = 1; k <= LANES_ORDER; k++) {
        if (k <= LANES_LOW) {
            LANES_FLOW(flow, now, rates);
        } else {
            LANES_FLOW_HIGH(flow, now, rates);
        }
        for (int j = 0; j < LANES_HARMONICS; j++) {
            const V c = now[MODEL_NX + 2 * j];
            now[MODEL_NX + 2 * j] = -(turn[j] * now[MODEL_NX + 2 * j + 1]);
            now[MODEL_NX + 2 * j + 1] = turn[j] * c;
        }
        for (int i = 0; i < MODEL_NX; i++) {
            if (k <= LANES_LOW || lanes_endless[i]) {
                now[i] = i < MODEL_NQ ? h * rates[i] : rates[i];
                now[i] = k == 1 ? now[i] + h * b->constant[i] : now[i];
            }
        }
        for (int j = 0; j < LANES_Z; j++) {
            if (k <= LANES_LOW || lanes_endless[j]) {
                y[k][j] = now[j] * NAME(fill)(part[k]);
            }
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
        if (k <= LANES_LOW) {
            LANES_GUARD_SUMS(b->guard, y[k], g);
        } else {
            LANES_GUARD_SUMS_HIGH(b->guard, y[k], g);
        }
        for (int i = 0; i < LANES_GUARDS; i++) {
            q[i][k] = g[i];
        }
    }
}

/* values of the guards of a batch, and their rates along the flow */
static INLINE void NAME(guard_line)(const NAME(Batch) * b, const V *z, V *value, V *rate)
{
    V along[LANES_Z];
    LANES_FLOW(b->flow, z, along);
    for (int i = 0; i < MODEL_NX; i++) {
        along[i] += b->constant[i];
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        along[MODEL_NX + 2 * j] = -(b->wave[j] * z[MODEL_NX + 2 * j + 1]);
        along[MODEL_NX + 2 * j + 1] = b->wave[j] * z[MODEL_NX + 2 * j];
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        value[g] = b->guard_constant[g];
        rate[g] = NAME(fill)(0.0);
    }
    LANES_GUARD_SUMS(b->guard, z, value);
    LANES_GUARD_SUMS(b->guard, along, rate);
}

/* guards that have been left just now are known to be zero */
static INLINE void NAME(left_now)(NAME(Batch) * b, V (*q)[LANES_ORDER + 1])
{
    const V zero = NAME(fill)(0.0);
    for (int g = 0; g < LANES_GUARDS; g++) {
        b->known[g] |= (q[g][0] == zero) & (q[g][1] > zero);
    }
}

/* a stop that has let go and is left on the way: nothing changes but its guards. Lanes in which its guard g falls all the
   way to below zero */
static INLINE M NAME(leaves)(const NAME(Batch) * b, const V *q, V rest)
{
    const V slope = NAME(fill)(4.0) * rest;
    const V e1 = q[1] + q[2];
    const V e2 = e1 + q[2] + NAME(fill)(3.0) * q[3];
    const V end = q[0] + q[1] + q[2] + q[3];
    return b->released & (NAME(most)(NAME(most)(q[1], e1), e2) + slope < NAME(fill)(0.0)) & (end + rest < NAME(fill)(0.0));
}

/* lanes in which some guard may fall: what the terms up to the third order, by Bernstein's coefficients, and the bound of
   the others leave open */
static INLINE M NAME(doubtful)(const NAME(Batch) * b, V h, V (*q)[LANES_ORDER + 1], V *left)
{
    const V zero = NAME(fill)(0.0);
    const V third = NAME(fill)(1.0 / 3.0);
    const V fourth = (h * h) * (h * h);
    V size[MODEL_NX];
    M found = NAME(none)();
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
        M falls = ~(low > tail * fourth);
        if (lanes_digits[lanes_guard_contact[g]] == 3 && lanes_guard_slot[g] == 0) {
            const M silent = falls & ~known & NAME(leaves)(b, q[g], tail * fourth);
            *left = NAME(pick)(silent, NAME(fill)((double)g), *left);
            falls &= ~silent;
        }
        found |= falls;
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
    const M whole = (u == NAME(fill)(1.0)) & (h == b->left);
    /* even and odd orders apart: two short chains */
    const V square = u * u;
    for (int j = 0; j < LANES_Z; j++) {
        const int first = lanes_endless[j] ? LANES_ORDER : LANES_LOW;
        V part[2] = {y[0][j], NAME(fill)(0.0)};
        LANES_UNROLL
        for (int n = LANES_ORDER; n >= 0; n--) {
            if (n <= first) {
                part[n % 2] = n >= first - 1 ? y[n][j] : part[n % 2] * square + y[n][j];
            }
        }
        b->z[j] = first > 0 ? part[0] + u * part[1] : part[0];
    }
    b->left = NAME(pick)(whole, NAME(fill)(0.0), b->left - h * u);
    b->left = NAME(most)(b->left, NAME(fill)(0.0));
}

/* the next batch of a lane, or its group, at home at a point of the grid or at the end of the period */
static void NAME(pass_on)(Pool *pool, int64_t slot)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    const LaneMode *mode = &t->mode[lane->mode];
    if (lane->failed) {
        return;
    }
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

/* the event of guard g in a lane */
static void NAME(happen)(const LaneTable *t, Lane *lane, int g, int64_t directions)
{
    Fall fall;
    const int was_on_grid = t->mode[lane->mode].on_grid;
    const double time = t->h * lane->goal - lane->left;
    fall.mode = lane->mode;
    memcpy(fall.z, lane->z, sizeof fall.z);
    lane_event(t, lane, lane->z, g, time);
    if (directions > 0) {
        tangents_jump(t, lane, &fall, lane->z, g, directions);
    }
    /* away from home nothing is to be done at the points of the grid */
    const int on_grid = t->mode[lane->mode].on_grid;
    if (on_grid != was_on_grid) {
        const int next = (int)(time / t->h) + 1;
        lane->goal = on_grid && next < t->steps ? next : t->steps;
        lane->left = fmax(t->h * lane->goal - time, 0.0);
    }
}

/* lane l of a batch into its record */
static INLINE void NAME(keep)(const Pool *pool, const NAME(Batch) * b, int l)
{
    Lane *lane = b->lane[l];
    for (int j = 0; j < LANES_Z; j++) {
        lane->z[j] = b->z[j][l];
    }
    lane->left = b->left[l];
    for (int g = 0; g < LANES_GUARDS; g++) {
        lane->known[g] = b->known[g][l];
    }
    NAME(save_tangents)(pool, b, l);
    lane->failed |= ++lane->rounds > LANES_ROUNDS;
}

/* a sub-step of some lanes in which probably no guard falls; where one may they are queued for events */
static INLINE void NAME(series)(Pool *pool, NAME(Batch) * b, M wanted)
{
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    const V h = NAME(least)(b->left, b->longest);
    NAME(expand)(b, h, y);
    NAME(guards)(b, y, 3, q);
    NAME(left_now)(b, q);
    V gone = NAME(fill)(-1.0);
    const V left = b->left;
    const M open = NAME(doubtful)(b, h, q, &gone);
    NAME(go)(b, y, h, NAME(fill)(1.0));
    NAME(vary)(b, NAME(pick)(open, NAME(fill)(0.0), h), pool->directions);
    b->left = NAME(pick)(open, left, b->left);
    for (int j = 0; j < LANES_Z; j++) {
        b->z[j] = NAME(pick)(open, y[0][j], b->z[j]);
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        b->known[g] &= open;
    }
    for (int l = 0; l < b->count; l++) {
        if (!wanted[l]) {
            continue;
        }
        NAME(keep)(pool, b, l);
        if (open[l]) {
            pool_queue(pool, b->slot[l], QUEUE_EVENT);
            continue;
        }
        if (gone[l] >= 0.0) {
            NAME(happen)(&pool->tables[b->slot[l]], b->lane[l], (int)gone[l], 0);
        }
        NAME(pass_on)(pool, b->slot[l]);
    }
}

static __attribute__((noinline)) void NAME(series_batch)(Pool *pool)
{
    NAME(Batch) b;
    NAME(gather)(pool, QUEUE_SERIES, &b);
    NAME(series)(pool, &b, b.there);
}

/* impacts of a batch that are like most: fast enough to rebound, and alone. The lanes in which guards fell and that are not
   among them are returned */
static INLINE M NAME(impacts)(NAME(Batch) * b, M fell, V guard)
{
    V value[LANES_NG], rate[LANES_NG], size[LANES_NG];
    V magnitude[LANES_Z], factor[LANES_NR];
    if (!LANES_IMPACTS) {
        return fell;
    }
    NAME(guard_line)(b, b->z, value, rate);
    for (int j = 0; j < LANES_Z; j++) {
        magnitude[j] = NAME(size)(b->z[j]);
    }
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++) {
        factor[e] = NAME(size)(b->guard[e]);
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        size[g] = NAME(size)(b->guard_constant[g]);
    }
    LANES_GUARD_SUMS(factor, magnitude, size);
    for (int g = 0; g < LANES_GUARDS; g++) {
        const int c = lanes_guard_contact[g];
        V e, fastest, push;
        M hit = fell & (guard == NAME(fill)((double)g));
        if (lanes_kind[c] != KIND_IMPACT) {
            continue;
        }
        EACH(e, b->table[l]->restitution[c])
        EACH(fastest, b->lane[l]->motion.memory[c])
        fastest = NAME(most)(fastest, -rate[g]);
        hit &= rate[g] < NAME(fill)(0.0);
        hit &= -(e * rate[g]) > NAME(fill)(2.0 * LANES_CHATTER) * fastest;
        for (int other = 0; other < LANES_GUARDS; other++) {
            if (other != g && lanes_kind[lanes_guard_contact[other]] == KIND_IMPACT) {
                hit &= NAME(size)(value[other]) > NAME(fill)(LANES_AT_WALL) * size[other];
            }
        }
        const V impulse = rate[g] + e * rate[g];
        for (int i = 0; i < MODEL_NX; i++) {
            EACH(push, b->table[l]->push[c][i < MODEL_NQ ? MODEL_NQ + i : i])
            const V moved = b->z[i] - (i < MODEL_NQ ? value[g] : impulse) * push;
            b->z[i] = NAME(pick)(hit, moved, b->z[i]);
        }
        for (int l = 0; l < LANES_W; l++) {
            if (hit[l]) {
                LaneMotion *motion = &b->lane[l]->motion;
                motion->memory[c] = fastest[l];
                motion->began[c]++;
            }
        }
        for (int other = 0; other < LANES_GUARDS; other++) {
            b->known[other] = hit ? (M)(int64_t)(other == g ? -1 : 0) : b->known[other];
        }
        fell &= ~hit;
    }
    return fell;
}

/* and crossings of switches that are fast enough: into the mode of the other side */
static INLINE M NAME(switches)(NAME(Batch) * b, M fell, V guard)
{
    V value[LANES_NG], rate[LANES_NG];
    NAME(Batch) sizes;
    if (!LANES_SWITCHES || !NAME(any)(fell)) {
        return fell;
    }
    NAME(guard_line)(b, b->z, value, rate);
    for (int e = 0; e < LANES_FLOW; e++) {
        sizes.flow[e] = NAME(size)(b->flow[e]);
    }
    for (int i = 0; i < MODEL_NX; i++) {
        sizes.constant[i] = NAME(size)(b->constant[i]);
    }
    for (int j = 0; j < LANES_Z; j++) {
        sizes.z[j] = NAME(size)(b->z[j]);
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        sizes.wave[j] = NAME(fill)(0.0);
    }
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++) {
        sizes.guard[e] = NAME(size)(b->guard[e]);
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        sizes.guard_constant[g] = NAME(fill)(0.0);
    }
    V size[LANES_NG];
    NAME(guard_line)(&sizes, sizes.z, value, size);
    for (int g = 0; g < LANES_GUARDS; g++) {
        const int c = lanes_guard_contact[g];
        if (lanes_kind[c] != KIND_SWITCH) {
            continue;
        }
        const M hit = fell & (guard == NAME(fill)((double)g)) & (-rate[g] > NAME(fill)(LANES_ALONG) * size[g]);
        for (int l = 0; l < LANES_W; l++) {
            if (hit[l]) {
                signed char *state = &b->lane[l]->motion.state[c];
                *state = *state == CONTACT_SLIP_PLUS ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
                b->lane[l]->mode = b->mode[l]->crossed[c];
                b->mode[l] = &b->table[l]->mode[b->lane[l]->mode];
            }
        }
        for (int other = 0; other < LANES_GUARDS; other++) {
            b->known[other] = hit ? (M)(int64_t)(other == g ? -1 : 0) : b->known[other];
        }
        fell &= ~hit;
    }
    return fell;
}

/* differences of neighbours through the events of some lanes, whose states were others before */
static __attribute__((noinline)) void NAME(jump)(const Pool *pool, NAME(Batch) * b, const V *before, M fell, V guard)
{
    for (int l = 0; l < b->count; l++) {
        Lane *lane = b->lane[l];
        double z[LANES_Z];
        Fall fall;
        if (!fell[l]) {
            continue;
        }
        fall.mode = b->before[l];
        for (int j = 0; j < LANES_Z; j++) {
            fall.z[j] = before[j][l];
            z[j] = b->z[j][l];
        }
        NAME(save_tangents)(pool, b, l);
        tangents_jump(b->table[l], lane, &fall, z, (int)guard[l], pool->directions);
        for (int n = 0; n < pool->directions; n++) {
            for (int i = 0; i < MODEL_NX; i++) {
                AT(b->tangent[n][i], l) = lane->tangent[n][i];
            }
        }
    }
}

/* a sub-step in which some guard may fall */
static __attribute__((noinline)) void NAME(event_batch)(Pool *pool)
{
    NAME(Batch) b;
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    V guard, before[LANES_Z];
    M undecided;
    NAME(gather)(pool, QUEUE_EVENT, &b);
    const V h = NAME(least)(b.left, b.longest);
    NAME(expand)(&b, h, y);
    NAME(guards)(&b, y, LANES_ORDER, q);
    NAME(left_now)(&b, q);
    for (int g = 0; g < LANES_GUARDS; g++) {
        NAME(deflate)(q[g], b.known[g]);
        b.known[g] = NAME(none)();
    }
    const V u = NAME(search)(q, b.there, &guard, &undecided);
    NAME(go)(&b, y, h, u);
    NAME(vary)(&b, h * u, pool->directions);
    const M fell = b.there & ~undecided & (guard >= NAME(fill)(0.0));
    if (pool->directions > 0) {
        memcpy(before, b.z, sizeof before);
    }
    const M special = NAME(switches)(&b, NAME(impacts)(&b, fell, guard), guard);
    if (pool->directions > 0) {
        NAME(jump)(pool, &b, before, fell & ~special, guard);
    }
    /* motions whose states are known here go on at once */
    const M on = b.there & ~undecided & ~special & (b.left > NAME(fill)(0.0));
    for (int l = 0; l < b.count; l++) {
        if (on[l]) {
            continue;
        }
        NAME(keep)(pool, &b, l);
        b.lane[l]->failed |= undecided[l] != 0;
        if (special[l]) {
            NAME(happen)(b.table[l], b.lane[l], (int)guard[l], pool->directions);
        }
        NAME(pass_on)(pool, b.slot[l]);
    }
    if (NAME(any)(on)) {
        if (LANES_SWITCHES) {
            NAME(gather_mode)(&b);
        }
        NAME(series)(pool, &b, on);
    }
}
