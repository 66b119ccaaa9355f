/*
 * Steps of many motions from strobe to strobe, included once per target: LANES_W motions to a vector, NAME tells the
 * inclusions apart. Every lane is computed by the same operations in the same order whatever their number: results do
 * not depend on the target, nor on who is in the other lanes.
 *
 *     for each point of the grid    all motions at home: one exact step, certified to meet nothing
 *                                   the others (a guard may fall, or a contact touches) are queued, and go through
 *                                   events() until they are at home at a point of the grid, as many at a time as there
 *                                   are lanes
 *     events:  series of the states over a sub-step; its guards are polynomials
 *                  clear        lower bound of the first four terms (Bernstein) less the others > 0
 *                  one root     falls all the way, or bends one way only; a dip that bends upward lies above its tangents,
 *                               or is searched for its lowest point
 *                  otherwise    half the sub-step
 *              go to the earliest root, change the mode; next lane when the point of the grid is reached
 */

#include "lane_tangents.h"
#include "lane_vectors.h"

#include "lane_roots.h"

/* numbers of the home steps of a group of lanes */
typedef struct {
    V x[MODEL_NX];
    M home, running; /* at home in the present period; on their way in it */
    V at, steps;     /* point of the grid where each is; how many there are */
    V step[LANES_STEP], guard[LANES_NHOME], bound[LANES_NBOUND], bound_constant[NC];
    V forced[LANES_GRID][MODEL_NX], guard_constant[LANES_GRID + 1][NC];
} NAME(Group);

static int64_t NAME(group_bytes)(void) { return (int64_t)sizeof(NAME(Group)); }

static INLINE NAME(Group) * NAME(group)(Pool *pool, int64_t slot)
{
    return (NAME(Group) *)(void *)pool->columns + slot / LANES_W;
}

/* the home step of a lane into its column */
static __attribute__((noinline)) void NAME(settle)(Pool *pool, int64_t slot, int home)
{
    NAME(Group) *g = NAME(group)(pool, slot);
    const LaneTable *t = &pool->tables[slot];
    const HomeStep *s = &t->home[home];
    const int l = (int)(slot % LANES_W);
    AT(g->steps, l) = t->steps;
    for (int e = 0; e < LANES_STEP; e++) {
        AT(g->step[e], l) = s->step[e];
    }
    for (int e = 0; e < LANES_HOME_ENTRIES; e++) {
        AT(g->guard[e], l) = s->guard[e];
    }
    for (int e = 0; e < LANES_BOUND_ENTRIES; e++) {
        AT(g->bound[e], l) = s->bound[e];
    }
    for (int c = 0; c < MODEL_NC; c++) {
        AT(g->bound_constant[c], l) = s->bound_constant[c];
    }
    for (int k = 0; k <= t->steps; k++) {
        for (int i = 0; i < MODEL_NX && k < t->steps; i++) {
            AT(g->forced[k][i], l) = s->forced[k][i];
        }
        for (int c = 0; c < MODEL_NC; c++) {
            AT(g->guard_constant[k][c], l) = s->guard_constant[k][c];
        }
    }
}

/* one step of the grid of a group; the lanes that it does not make are returned */
static INLINE M NAME(advance)(NAME(Group) * g, int k)
{
    V next[MODEL_NX], g0[NC], g1[NC], bound[NC], size[MODEL_NX];
    const M running = g->running & (M)(g->at == NAME(fill)((double)k)) & (M)(g->steps > NAME(fill)((double)k));
    M clear = g->home;
    for (int i = 0; i < MODEL_NX; i++) {
        next[i] = g->forced[k][i];
        size[i] = NAME(size)(g->x[i]);
    }
    LANES_STEP_SUMS(g->step, g->x, next);
    for (int c = 0; c < MODEL_NC; c++) {
        g0[c] = g->guard_constant[k][c];
        g1[c] = g->guard_constant[k + 1][c];
        bound[c] = g->bound_constant[c];
    }
    LANES_HOME_SUMS(g->guard, g->x, g0);
    LANES_HOME_SUMS(g->guard, next, g1);
    LANES_BOUND_SUMS(g->bound, size, bound);
    for (int c = 0; c < MODEL_NC; c++) {
        clear &= (M)(NAME(least)(g0[c], g1[c]) > bound[c]);
    }
    for (int i = 0; i < MODEL_NX; i++) {
        g->x[i] = NAME(pick)(clear & running, next[i], g->x[i]);
    }
    g->at = NAME(pick)(clear & running, NAME(fill)((double)(k + 1)), g->at);
    return running & ~clear;
}

/* lanes that go through events, one column each */
typedef struct {
    V y[LANES_Z], left, longest;
    V flow[LANES_NF], constant[MODEL_NX], guard[LANES_NR], guard_constant[LANES_NG], wave[LANES_NH];
    V tail[LANES_NG][MODEL_NX], tail_constant[LANES_NG];
    M known[LANES_NG];
    V tangent[MODEL_NX + 1][MODEL_NX]; /* in pairs */
    int64_t slot[LANES_W];             /* -1: empty */
    int goal[LANES_W];                 /* the point of the grid to which time is left */
    int rounds[LANES_W];
} NAME(Bench);

#include "lane_variation.h"

static void NAME(load_mode)(NAME(Bench) * b, int l, const LaneMode *m)
{
    for (int e = 0; e < LANES_FLOW; e++) {
        AT(b->flow[e], l) = m->flow[e];
    }
    for (int i = 0; i < MODEL_NX; i++) {
        AT(b->constant[i], l) = m->constant[i];
    }
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++) {
        AT(b->guard[e], l) = m->guard[e];
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        AT(b->guard_constant[g], l) = m->guard_constant[g];
        AT(b->tail_constant[g], l) = m->tail_constant[g];
        for (int i = 0; i < MODEL_NX; i++) {
            AT(b->tail[g][i], l) = m->tail[g][i];
        }
    }
    AT(b->longest, l) = m->longest;
}

/* a lane takes its place before point k of the grid */
static void NAME(enter)(Pool *pool, NAME(Bench) * b, int l, int64_t slot, int k)
{
    const NAME(Group) *group = NAME(group)(pool, slot);
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    const int column = (int)(slot % LANES_W);
    const int home = MARK(group->home, column) != 0;
    for (int i = 0; i < MODEL_NX; i++) {
        AT(b->y[i], l) = home ? AT(group->x[i], column) : lane->x[i];
    }
    for (int j = 0; j < 2 * LANES_HARMONICS; j++) {
        AT(b->y[MODEL_NX + j], l) = t->phasor[k][j];
    }
    for (int j = 0; j < LANES_HARMONICS; j++) {
        AT(b->wave[j], l) = t->wave[j];
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        MARK(b->known[g], l) = 0;
    }
    b->goal[l] = home ? k + 1 : t->steps;
    AT(b->left, l) = t->h * (b->goal[l] - k);
    b->slot[l] = slot;
    b->rounds[l] = 0;
    NAME(load_mode)(b, l, &t->mode[lane->mode]);
    tangents_bring(pool, slot, k);
    NAME(load_tangents)(pool, b, l, slot);
}

/* and leaves it at home at a point of the grid, at the end of the period, or undecided */
static void NAME(leave)(Pool *pool, NAME(Bench) * b, int l)
{
    const int64_t slot = b->slot[l];
    NAME(Group) *group = NAME(group)(pool, slot);
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    const int column = (int)(slot % LANES_W);
    const int home = t->mode[lane->mode].home;
    b->slot[l] = -1;
    AT(b->left, l) = 0.0;
    if (lane->failed) {
        MARK(group->running, column) = 0;
        return;
    }
    for (int i = 0; i < MODEL_NX; i++) {
        lane->x[i] = AT(b->y[i], l);
        AT(group->x[i], column) = AT(b->y[i], l);
    }
    if (home >= 0 && home != lane->started) {
        NAME(settle)(pool, slot, home);
        lane->started = home;
    }
    MARK(group->home, column) = home >= 0 ? -1 : 0;
    AT(group->at, column) = b->goal[l];
    NAME(save_tangents)(pool, b, l, slot);
    lane->brought = b->goal[l];
}

/* column l of a vector array */
#define COLUMN(values, n, l, out)                                                                                      \
    for (int i_ = 0; i_ < (n); i_++) {                                                                                 \
        (out)[i_] = AT((values)[i_], l);                                                                               \
    }

/* the event of guard g in lane l */
static void NAME(happen)(Pool *pool, NAME(Bench) * b, int l, int g)
{
    double z[LANES_Z];
    signed char known[LANES_NG];
    Lane *lane = &pool->lanes[b->slot[l]];
    const LaneTable *t = &pool->tables[b->slot[l]];
    const double time = t->h * b->goal[l] - AT(b->left, l);
    Fall fall = {.mode = lane->mode};
    COLUMN(b->y, LANES_Z, l, z)
    memcpy(fall.z, z, sizeof z);
    lane_event(t, lane, z, g, time, known);
    for (int i = 0; i < MODEL_NX; i++) {
        AT(b->y[i], l) = z[i];
    }
    if (pool->directions > 0) {
        NAME(save_tangents)(pool, b, l, b->slot[l]);
        tangents_jump(t, lane, &fall, z, g, pool->directions);
        NAME(load_tangents)(pool, b, l, b->slot[l]);
    }
    for (int i = 0; i < LANES_GUARDS; i++) {
        MARK(b->known[i], l) = known[i] ? -1 : 0;
    }
    /* away from home nothing is to be done at the points of the grid */
    const int next = (int)(time / t->h) + 1;
    b->goal[l] = t->mode[lane->mode].home >= 0 && next < t->steps ? next : t->steps;
    AT(b->left, l) = fmax(t->h * b->goal[l] - time, 0.0);
    NAME(load_mode)(b, l, &t->mode[lane->mode]);
}

/* the series of the states over a sub-step of length h: its variable runs from 0 to 1 */
static INLINE void NAME(expand)(const NAME(Bench) * b, V h, V (*y)[LANES_Z])
{
    static const double part[] = {1.0,     1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,
                                  1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16};
    V now[LANES_Z], rates[MODEL_NX];
    for (int j = 0; j < LANES_Z; j++) {
        y[0][j] = now[j] = b->y[j];
    }
    LANES_UNROLL
    for (int k = 0; k < LANES_ORDER; k++) {
        const V f = h * NAME(fill)(part[k]);
        LANES_FLOW(b->flow, now, rates);
        for (int j = 0; j < LANES_HARMONICS; j++) {
            const V turn = f * b->wave[j];
            const V c = now[MODEL_NX + 2 * j];
            now[MODEL_NX + 2 * j] = -(turn * now[MODEL_NX + 2 * j + 1]);
            now[MODEL_NX + 2 * j + 1] = turn * c;
        }
        for (int i = 0; i < MODEL_NX; i++) {
            now[i] = f * (k == 0 ? rates[i] + b->constant[i] : rates[i]);
        }
        for (int j = 0; j < LANES_Z; j++) {
            y[k + 1][j] = now[j];
        }
    }
}

/* coefficients of all guards from one order to another */
static INLINE void NAME(guards)(const NAME(Bench) * b, V (*y)[LANES_Z], int from, int to, V (*q)[LANES_ORDER + 1])
{
    V g[LANES_NG];
    for (int k = from; k <= to; k++) {
        for (int i = 0; i < LANES_GUARDS; i++) {
            g[i] = k == 0 ? b->guard_constant[i] : NAME(fill)(0.0);
        }
        LANES_GUARD_SUMS(b->guard, y[k], g);
        for (int i = 0; i < LANES_GUARDS; i++) {
            q[i][k] = g[i];
        }
    }
}

/* lanes in which some guard may fall: what the terms up to the third order, by Bernstein's coefficients, and the bound of
   the others leave open; guards that have been left just now are added to those known to be zero */
static INLINE M NAME(doubtful)(NAME(Bench) * b, V h, V (*q)[LANES_ORDER + 1], M there)
{
    const V zero = NAME(fill)(0.0);
    const V third = NAME(fill)(1.0 / 3.0);
    const V fourth = (h * h) * (h * h);
    V size[MODEL_NX];
    M found = there & ~there;
    for (int i = 0; i < MODEL_NX; i++) {
        size[i] = NAME(size)(b->y[i]);
    }
    for (int g = 0; g < LANES_GUARDS; g++) {
        V tail = b->tail_constant[g];
        for (int i = 0; i < MODEL_NX; i++) {
            tail += b->tail[g][i] * size[i];
        }
        b->known[g] |= (M)(q[g][0] == zero) & (M)(q[g][1] > zero);
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
    return found & there;
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

/* the earliest fall of all guards; how far the sub-step goes where there is none; lanes that are not decided */
static INLINE V NAME(search)(V (*q)[LANES_ORDER + 1], M busy, V *which, M *undecided)
{
    enum { HALVINGS = 12 };
    V reach = NAME(fill)(1.0);
    V place = NAME(fill)(2.0);
    M left = busy;
    *which = NAME(fill)(-1.0);
    for (int n = 0; n < HALVINGS; n++) {
        M longer = left & ~left;
        V first = NAME(fill)(2.0);
        V guard = NAME(fill)(-1.0);
        for (int g = 0; g < LANES_GUARDS; g++) {
            const V at = NAME(guard_falls)(q[g], left, &longer);
            guard = NAME(pick)((M)(at < first), NAME(fill)((double)g), guard);
            first = NAME(least)(at, first);
        }
        const M done = left & ~longer;
        const M falls = done & (M)(first < NAME(fill)(1.5));
        place = NAME(pick)(falls, first * reach, NAME(pick)(done, reach, place));
        *which = NAME(pick)(falls, guard, *which);
        left &= longer;
        if (!NAME(any)(left)) {
            break;
        }
        /* half of it, for lanes that need it */
        const V half = NAME(pick)(left, NAME(fill)(0.5), NAME(fill)(1.0));
        reach *= half;
        for (int g = 0; g < LANES_GUARDS; g++) {
            V power = half;
            for (int k = 1; k <= LANES_ORDER; k++) {
                q[g][k] *= power;
                power *= half;
            }
        }
    }
    *undecided = left;
    return place;
}

/* all queued lanes, from point k of the grid to the next */
static __attribute__((noinline)) void NAME(events)(Pool *pool, int k, int64_t queued)
{
    NAME(Bench) b;
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    int64_t next = 0;
    memset(&b, 0, sizeof b);
    for (int l = 0; l < LANES_W; l++) {
        b.slot[l] = -1;
    }
    while (1) {
        int busy = 0;
        M there = (M)(b.left > NAME(fill)(0.0));
        for (int l = 0; l < LANES_W; l++) {
            if (b.slot[l] < 0 && next < queued) {
                NAME(enter)(pool, &b, l, pool->queue[next++], k);
            }
            MARK(there, l) = b.slot[l] < 0 ? 0 : -1;
            busy |= b.slot[l] >= 0;
        }
        if (!busy) {
            return;
        }
        const V h = NAME(least)(b.left, b.longest);
        V which = NAME(fill)(-1.0);
        V u = NAME(fill)(1.0);
        M undecided = there & ~there;
        NAME(expand)(&b, h, y);
        NAME(guards)(&b, y, 0, 3, q);
        const M open = NAME(doubtful)(&b, h, q, there);
        if (NAME(any)(open)) {
            NAME(guards)(&b, y, 4, LANES_ORDER, q);
            for (int g = 0; g < LANES_GUARDS; g++) {
                NAME(deflate)(q[g], b.known[g]);
            }
            u = NAME(pick)(open, NAME(search)(q, open, &which, &undecided), u);
        }
        for (int g = 0; g < LANES_GUARDS; g++) {
            b.known[g] = there & ~there;
        }
        const M whole = (M)(u == NAME(fill)(1.0)) & (M)(h == b.left);
        V end[LANES_Z];
        for (int j = 0; j < LANES_Z; j++) {
            end[j] = y[LANES_ORDER][j];
        }
        for (int n = LANES_ORDER - 1; n >= 0; n--) {
            for (int j = 0; j < LANES_Z; j++) {
                end[j] = end[j] * u + y[n][j];
            }
        }
        for (int j = 0; j < LANES_Z; j++) {
            b.y[j] = NAME(pick)(there, end[j], b.y[j]);
        }
        NAME(vary)(&b, h * u, pool->directions);
        b.left = NAME(pick)(whole, NAME(fill)(0.0), b.left - h * u);
        b.left = NAME(most)(b.left, NAME(fill)(0.0));
        for (int l = 0; l < LANES_W; l++) {
            if (b.slot[l] < 0) {
                continue;
            }
            Lane *lane = &pool->lanes[b.slot[l]];
            lane->failed |= MARK(undecided, l) != 0 || ++b.rounds[l] > LANES_ROUNDS;
            if (!lane->failed && AT(which, l) >= 0.0) {
                NAME(happen)(pool, &b, l, (int)AT(which, l));
            }
            if (lane->failed || AT(b.left, l) == 0.0) {
                NAME(leave)(pool, &b, l);
            }
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
        Lane *lane = &pool->lanes[slot];
        const LaneTable *t = &pool->tables[slot];
        const int home = t->mode[lane->mode].home;
        tangents_begin(pool, slot);
        for (int i = 0; i < MODEL_NX; i++) {
            AT(g->x[i], l) = lane->x[i];
        }
        if (home >= 0 && home != lane->started) {
            NAME(settle)(pool, slot, home);
            lane->started = home;
        }
        AT(g->steps, l) = t->steps;
        AT(g->at, l) = 0.0;
        MARK(g->home, l) = home >= 0 ? -1 : 0;
        MARK(g->running, l) = -1;
        most = t->steps > most ? t->steps : most;
    }
    for (int k = 0; k < most; k++) {
        int64_t queued = 0;
        for (int64_t n = 0; n < groups; n++) {
            NAME(Group) *g = NAME(group)(pool, n * LANES_W);
            M left = NAME(advance)(g, k);
            if (!NAME(any)(left)) {
                continue;
            }
            for (int l = 0; l < LANES_W; l++) {
                if (MARK(left, l)) {
                    pool->queue[queued++] = (int32_t)(n * LANES_W + l);
                }
            }
        }
        if (queued > 0) {
            NAME(events)(pool, k, queued);
        }
    }
    for (int64_t slot = 0; slot < pool->motions; slot++) {
        const NAME(Group) *g = NAME(group)(pool, slot);
        const int l = (int)(slot % LANES_W);
        Lane *lane = &pool->lanes[slot];
        if (MARK(g->running, l)) {
            COLUMN(g->x, MODEL_NX, l, lane->x)
            tangents_end(pool, slot);
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
#undef COLUMN
#undef LANES_BYTES
