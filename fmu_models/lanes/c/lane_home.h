/* Exact steps of motions at home, group by group; included once per target by lane_code.h. */
/* where the motions of a group are: points of the grid are counted so that all end at LANES_GRID */
typedef struct {
    V x[MODEL_NX];
    V tangent[MODEL_NX][MODEL_NX]; /* differences of neighbours */
    V at[LANES_HOMES];             /* the point where it is at home in this mode; -1: in another, or away */
} NAME(Group);

/* numbers of the steps of a group in one home mode, a column per motion */
typedef struct {
    V step[LANES_STEP], guard[LANES_NHOME], bound[LANES_NBOUND], bound_constant[LANES_NHG];
    V slope[LANES_NBOUND], slope_constant[LANES_POINTS][LANES_NHG], tail[LANES_NBOUND], tail_constant[LANES_NHG];
    struct {
        V forced[MODEL_NX], guard_constant[LANES_NHG];
    } at[LANES_POINTS];
} NAME(HomeColumns);

/* a group and its home modes in memory */
typedef struct {
    NAME(Group) group;
    NAME(HomeColumns) columns[LANES_HOMES];
} NAME(Home);

static int64_t NAME(group_bytes)(void) { return (int64_t)sizeof(NAME(Home)); }

static INLINE NAME(Home) * NAME(home)(Pool *pool, int64_t group) { return (NAME(Home) *)(void *)pool->columns + group; }

static INLINE NAME(Group) * NAME(group)(Pool *pool, int64_t slot) { return &NAME(home)(pool, slot / LANES_W)->group; }

/* the home step of a lane into its column */
static __attribute__((noinline)) void NAME(settle)(Pool *pool, int64_t slot, int home)
{
    NAME(HomeColumns) *to = &NAME(home)(pool, slot / LANES_W)->columns[home];
    const LaneTable *t = &pool->tables[slot];
    const HomeStep *s = &t->home[home];
    const int l = (int)(slot % LANES_W);
    for (int e = 0; e < LANES_STEP; e++)
        AT(to->step[e], l) = s->step[e];
    for (int e = 0; e < LANES_HOME_ENTRIES; e++)
        AT(to->guard[e], l) = s->guard[e];
    for (int e = 0; e < LANES_BOUND_ENTRIES; e++) {
        AT(to->bound[e], l) = s->bound[e];
        AT(to->slope[e], l) = s->slope[e];
        AT(to->tail[e], l) = s->tail[e];
    }
    for (int c = 0; c < LANES_HOME_GUARDS; c++) {
        AT(to->bound_constant[c], l) = s->bound_constant[c];
        AT(to->tail_constant[c], l) = s->tail_constant[c];
    }
    for (int k = 0; k <= lane_point(t->steps); k++) {
        const int at = lane_point(LANES_GRID - t->steps + k);
        for (int i = 0; i < MODEL_NX && k < t->steps; i++)
            AT(to->at[at].forced[i], l) = s->forced[k][i];
        for (int c = 0; c < LANES_HOME_GUARDS; c++) {
            AT(to->at[at].guard_constant[c], l) = s->guard_constant[k][c];
            AT(to->slope_constant[at][c], l) = s->slope_constant[k][c];
        }
    }
}

/* no motion is anywhere: lanes of a group without one compute with whatever is
 * there, to no effect */
static void NAME(clear_groups)(Pool *pool)
{
    for (int64_t group = 0; group * LANES_W < pool->motions; group++) {
        NAME(Group) *g = &NAME(home)(pool, group)->group;
        memset(g->x, 0, sizeof g->x);
        memset(g->tangent, 0, sizeof g->tangent);
        for (int h = 0; h < LANES_HOMES; h++)
            g->at[h] = NAME(fill)(-1.0);
    }
}

/* a lane is in its mode at its goal, at home or at the end of the period; its
 * states are in the group */
static INLINE void NAME(arrive)(Pool *pool, NAME(Group) * g, int64_t slot)
{
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    const int home = t->mode[lane->mode].home;
    if (home < 0) return;
    if (!(lane->settled & 1u << home)) {
        NAME(settle)(pool, slot, home);
        lane->settled |= 1u << home;
    }
    const int at = LANES_GRID - t->steps + lane->goal;
    AT(g->at[home], slot % LANES_W) = at;
    pool->earliest = at < pool->earliest ? at : pool->earliest;
}

/* a lane goes on by itself from point k of its grid */
static INLINE void NAME(go_alone)(Pool *pool, int64_t slot, int k)
{
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    const LaneMode *mode = &t->mode[lane->mode];
    NAME(Group) *g = NAME(group)(pool, slot);
    for (int j = 0; j < 2 * LANES_HARMONICS; j++)
        lane->z[MODEL_NX + j] = t->phasor[lane_point(k)][j];
    memset(lane->known, 0, sizeof lane->known);
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            lane->tangent[n][i] = AT(g->tangent[n][i], slot % LANES_W);
    lane->goal = mode->on_grid ? k + 1 : t->steps;
    lane->left = t->h * (lane->goal - k);
    pool_queue(pool, slot, mode->home >= 0 ? QUEUE_EVENT : mode->on_grid ? QUEUE_SERIES : QUEUE_STRIDE);
}

/* of a group that has come to a point of the grid: lanes that some guard stops
 */
static __attribute__((noinline)) void NAME(from_group)(Pool *pool, int64_t group, M stopped, int at)
{
    NAME(Group) *g = NAME(group)(pool, group * LANES_W);
    WHERE (stopped) {
        const int64_t slot = group * LANES_W + l;
        Lane *lane = &pool->lanes[slot];
        for (int i = 0; i < MODEL_NX; i++)
            lane->z[i] = AT(g->x[i], l);
        for (int h = 0; h < LANES_HOMES; h++)
            AT(g->at[h], l) = -1.0;
        NAME(go_alone)(pool, slot, at - (LANES_GRID - pool->tables[slot].steps));
    }
}

/* lanes in which some guard may fall on the step of the grid from x, where guards are g0, to next, where they are g1: by
   Bernstein's coefficients of the cubic through values and rates at both ends */
static INLINE M NAME(may_meet)(const NAME(HomeColumns) * s, int at, const V *x, const V *next, const V *g0, const V *g1)
{
    (void)next; /* of a model without contacts */
    V d0[LANES_NHG], d1[LANES_NHG], tail[LANES_NHG], size[MODEL_NX];
    M found = NAME(none)();
    for (int i = 0; i < MODEL_NX; i++)
        size[i] = NAME(size)(x[i]);
    for (int c = 0; c < LANES_HOME_GUARDS; c++) {
        d0[c] = s->slope_constant[lane_point(at)][c];
        d1[c] = s->slope_constant[lane_point(at + 1)][c];
        tail[c] = s->tail_constant[c];
    }
    LANES_BOUND_SUMS(s->slope, x, d0);
    LANES_BOUND_SUMS(s->slope, next, d1);
    LANES_BOUND_SUMS(s->tail, size, tail);
    for (int c = 0; c < LANES_HOME_GUARDS; c++) {
        const V ends = NAME(least)(g0[c], g1[c]);
        found |= ~(NAME(least)(ends, NAME(least)(g0[c] + d0[c], g1[c] - d1[c])) > tail[c]);
    }
    return found;
}

/* one step of the grid of a group: all of it, and back for those that a guard
   stops: the next step waits for no comparison */
static INLINE void NAME(advance)(Pool *pool, int64_t group, int at)
{
    NAME(Home) *all = NAME(home)(pool, group);
    NAME(Group) *g = &all->group;
    for (int home = 0; home < LANES_HOMES; home++) {
        const NAME(HomeColumns) *s = &all->columns[home];
        V x[MODEL_NX], next[MODEL_NX], g0[LANES_NHG], g1[LANES_NHG], bound[LANES_NHG], size[MODEL_NX];
        const M here = g->at[home] == NAME(fill)((double)at);
        M stopped = NAME(none)();
        if (!NAME(any)(here)) continue;
        for (int i = 0; i < MODEL_NX; i++) {
            x[i] = g->x[i];
            next[i] = s->at[lane_point(at)].forced[i];
            size[i] = NAME(size)(x[i]);
        }
        LANES_STEP_SUMS(s->step, x, next);
        for (int i = 0; i < MODEL_NX; i++)
            g->x[i] = NAME(pick)(here, next[i], x[i]);
        g->at[home] = NAME(pick)(here, NAME(fill)((double)(at + 1)), g->at[home]);
        for (int c = 0; c < LANES_HOME_GUARDS; c++) {
            g0[c] = s->at[lane_point(at)].guard_constant[c];
            g1[c] = s->at[lane_point(at + 1)].guard_constant[c];
            bound[c] = s->bound_constant[c];
        }
        LANES_HOME_SUMS(s->guard, x, g0);
        LANES_HOME_SUMS(s->guard, next, g1);
        LANES_BOUND_SUMS(s->bound, size, bound);
        for (int c = 0; c < LANES_HOME_GUARDS; c++)
            stopped |= here & ~(NAME(least)(g0[c], g1[c]) > bound[c]);
        if (NAME(any)(stopped)) stopped &= NAME(may_meet)(s, at, x, next, g0, g1);
        for (int n = 0; n < pool->directions; n++) {
            for (int i = 0; i < MODEL_NX; i++)
                next[i] = NAME(fill)(0.0);
            LANES_STEP_SUMS(s->step, g->tangent[n], next);
            for (int i = 0; i < MODEL_NX; i++)
                g->tangent[n][i] = NAME(pick)(here & ~stopped, next[i], g->tangent[n][i]);
        }
        if (!NAME(any)(stopped)) continue;
        for (int i = 0; i < MODEL_NX; i++)
            g->x[i] = NAME(pick)(stopped, x[i], g->x[i]);
        NAME(from_group)(pool, group, stopped, at);
    }
}
