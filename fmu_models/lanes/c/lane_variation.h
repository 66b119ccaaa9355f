/*
 * Differences of neighbours of lanes that go through events; included once per target by lane_code.h.
 *
 *     sub-step   d -> exp(A h) d
 *     event      a neighbour meets it later by dt = -(dg . d) / g', with the slope g' of the guard along the flow f-:
 *                there it is at w = d + f- dt; through the jump, w -> J w, harmonics included; then d -> w - f+ dt
 *     period     at right angles, by Gram and Schmidt's method, as in engine/ensemble/growth.c; before and after it the
 *                caller has them, a column per motion, and during it the groups
 *
 * Left to the series of the engine, which tell it: a guard that falls so slowly that there may be no derivative.
 *
 * Source: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.
 */

/* of the terms of a guard's slope, over a sub-step: the engine has no derivative below a tenth of it (Tolerances.graze) */
#define LANES_SLOW 1e-6

/* from their records, and back */
static INLINE void NAME(load_tangents)(const Pool *pool, NAME(Batch) * b)
{
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            EACH(b->tangent[n][i], b->lane[l]->tangent[n][i])
}

static INLINE void NAME(save_tangents)(const Pool *pool, const NAME(Batch) * b, int l)
{
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            b->lane[l]->tangent[n][i] = b->tangent[n][i][l];
}

/* exp(A h) d in each lane, by the series of the states without harmonics and constants; two at a time: the terms of one
   wait for each other */
static __attribute__((noinline)) void NAME(vary)(NAME(Batch) * b, V h, int64_t directions)
{
    static const double part[] = {1.0,     1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,
                                  1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16};
    enum { TERMS = LANES_VARIED ? LANES_VARIED : LANES_ORDER };
    for (int n = 0; n < directions; n += 2) {
        V now[2][MODEL_NX], sum[2][MODEL_NX], next[2][MODEL_NX];
        memcpy(now, b->tangent[n], sizeof now);
        memcpy(sum, b->tangent[n], sizeof sum);
        LANES_UNROLL
        for (int k = 0; k < TERMS; k++) {
            const V f = h * NAME(fill)(part[k]);
            LANES_VARIATION(b->flow, now[0], next[0]);
            LANES_VARIATION(b->flow, now[1], next[1]);
            for (int i = 0; i < MODEL_NX; i++) {
                now[0][i] = f * next[0][i];
                now[1][i] = f * next[1][i];
                sum[0][i] += now[0][i];
                sum[1][i] += now[1][i];
            }
        }
        memcpy(b->tangent[n], sum, sizeof sum);
    }
}

/* rates of the harmonics, and of all along the flow */
static INLINE void NAME(turn)(const NAME(Batch) * b, const V *z, V *f)
{
    for (int j = 0; j < LANES_HARMONICS; j++) {
        f[MODEL_NX + 2 * j] = -(b->wave[j] * z[MODEL_NX + 2 * j + 1]);
        f[MODEL_NX + 2 * j + 1] = b->wave[j] * z[MODEL_NX + 2 * j];
    }
}

static INLINE void NAME(rates)(const NAME(Batch) * b, const V *z, V *f)
{
    LANES_FLOW(b->flow, z, f);
    for (int i = 0; i < MODEL_NX; i++)
        f[i] += b->constant[i];
    NAME(turn)(b, z, f);
}

/* differences as they are where neighbours meet the guard, and by how much later that is; lanes where there may be no
   derivative are returned */
static __attribute__((noinline)) M NAME(meet)(NAME(Batch) * b, M fell, V guard, int64_t directions)
{
    V f[LANES_Z], size[LANES_Z], bend[LANES_Z], flow[LANES_NF], factor[LANES_NR], slope[LANES_NG], least[LANES_NG];
    V fall = NAME(fill)(-1.0);
    V slow = NAME(fill)(0.0);
    NAME(rates)(b, b->z, f);
    for (int j = 0; j < LANES_Z; j++)
        size[j] = NAME(size)(f[j]);
    /* the terms of the slope, and of what it changes by over a sub-step */
    for (int e = 0; e < LANES_FLOW; e++)
        flow[e] = NAME(size)(b->flow[e]);
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++)
        factor[e] = NAME(size)(b->guard[e]);
    LANES_FLOW(flow, size, bend);
    for (int j = MODEL_NX; j < LANES_Z; j++)
        bend[j] = b->wave[(j - MODEL_NX) / 2];
    for (int j = 0; j < LANES_Z; j++)
        size[j] += b->longest * NAME(size)(bend[j]);
    for (int g = 0; g < LANES_GUARDS; g++)
        slope[g] = least[g] = NAME(fill)(0.0);
    LANES_GUARD_SUMS(b->guard, f, slope);
    LANES_GUARD_SUMS(factor, size, least);
    for (int g = 0; g < LANES_GUARDS; g++) {
        const M here = guard == NAME(fill)((double)g);
        fall = NAME(pick)(here, slope[g], fall);
        slow = NAME(pick)(here, NAME(fill)(LANES_SLOW) * least[g], slow);
    }
    const V per_slope = NAME(fill)(-1.0) / fall;
    for (int n = 0; n < directions; n++) {
        V w[LANES_Z], along[LANES_NG];
        for (int j = 0; j < LANES_Z; j++)
            w[j] = j < MODEL_NX ? b->tangent[n][j] : NAME(fill)(0.0);
        for (int g = 0; g < LANES_GUARDS; g++)
            along[g] = NAME(fill)(0.0);
        LANES_GUARD_SUMS(b->guard, w, along);
        V later = NAME(fill)(0.0);
        for (int g = 0; g < LANES_GUARDS; g++)
            later = NAME(pick)(guard == NAME(fill)((double)g), along[g] * per_slope, later);
        later = NAME(pick)(fell, later, NAME(fill)(0.0));
        b->later[n] = later;
        for (int i = 0; i < MODEL_NX; i++)
            b->tangent[n][i] += f[i] * later;
    }
    for (int j = 0; j < 2 * LANES_HARMONICS; j++)
        b->turn[j] = f[MODEL_NX + j];
    return fell & ~(-fall > slow);
}

/* an impact of one wall: velocities change by so much of it per speed of arrival at it, which guard g has as its rate */
static INLINE void NAME(strike)(NAME(Batch) * b, M hit, int g, V bounce, const V *push, int64_t directions)
{
    for (int n = 0; n < directions; n++) {
        V w[LANES_Z], along[LANES_Z], y[LANES_NG];
        for (int j = 0; j < LANES_Z; j++)
            w[j] = j < MODEL_NX ? b->tangent[n][j] : b->turn[j - MODEL_NX] * b->later[n];
        for (int i = 0; i < MODEL_NX; i++)
            along[i] = i < MODEL_NQ ? w[MODEL_NQ + i] : NAME(fill)(0.0);
        NAME(turn)(b, w, along);
        for (int e = 0; e < LANES_GUARDS; e++)
            y[e] = NAME(fill)(0.0);
        LANES_GUARD_SUMS(b->guard, along, y);
        for (int i = MODEL_NQ; i < MODEL_NX; i++)
            b->tangent[n][i] = NAME(pick)(hit, w[i] - bounce * y[g] * push[i], b->tangent[n][i]);
    }
}

/* back to the time of the motion, in lanes that go on from where they are now */
static INLINE void NAME(leave)(NAME(Batch) * b, M gone, int64_t directions)
{
    V f[LANES_Z];
    NAME(rates)(b, b->z, f);
    for (int n = 0; n < directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            b->tangent[n][i] = NAME(pick)(gone, b->tangent[n][i] - f[i] * b->later[n], b->tangent[n][i]);
}

/* those of a group as the caller has them */
static INLINE V *NAME(given)(const Pool *pool, int64_t group)
{
    return (V *)(void *)pool->tangents + group * pool->directions * MODEL_NX;
}

static INLINE void NAME(begin_tangents)(const Pool *pool, int64_t group, V (*d)[MODEL_NX])
{
    const V *given = NAME(given)(pool, group);
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            d[n][i] = NAME(pick)(NAME(size)(given[n * MODEL_NX + i]) < NAME(fill)(POOL_LEAST), NAME(fill)(0.0),
                                 given[n * MODEL_NX + i]);
}

static INLINE V NAME(product)(const V *a, const V *b)
{
    V sum = a[0] * b[0];
    for (int i = 1; i < MODEL_NX; i++)
        sum += a[i] * b[i];
    return sum;
}

static INLINE V NAME(norm)(const V *d) { return NAME(root_of)(NAME(product)(d, d)); }

/* growth: of each; losing: lanes in which some may have been lost altogether */
static __attribute__((noinline)) void NAME(orthonormalize)(V (*d)[MODEL_NX], int64_t directions, M losing, V *growth)
{
    const V least = NAME(pick)(losing, NAME(fill)(GROWTH_TAKEN), NAME(fill)(GROWTH_ROUNDING));
    V largest = NAME(fill)(1.0);
    for (int k = 0; k < directions; k++) {
        const V whole = NAME(norm)(d[k]);
        for (int j = 0; j < 2 * k; j++) {
            const V *u = d[j % k];
            const V along = NAME(product)(u, d[k]);
            for (int i = 0; i < MODEL_NX; i++)
                d[k][i] -= along * u[i];
        }
        const V size = k > 0 ? NAME(norm)(d[k]) : whole;
        largest = NAME(most)(largest, whole);
        M kept = (size > NAME(fill)(0.0)) & (~losing | (size > least * largest));
        kept &= size > (k > 0 ? least * whole : NAME(fill)(0.0));
        growth[k] = NAME(pick)(kept, size, NAME(fill)(0.0));
        for (int i = 0; i < MODEL_NX; i++)
            d[k][i] = NAME(pick)(kept, d[k][i] / size, NAME(fill)(0.0));
    }
}

/* of lanes that are at the end of a period; 0 if a growth is far */
static INLINE int NAME(end_tangents)(const Pool *pool, int64_t group, V (*d)[MODEL_NX], M there, M losing)
{
    V *given = NAME(given)(pool, group);
    V factor[MODEL_NX];
    M far = NAME(none)();
    if (pool->growth) NAME(orthonormalize)(d, pool->directions, losing, factor);
    for (int n = 0; n < pool->directions && pool->growth; n++) {
        V *growth = (V *)(void *)pool->growth + group * pool->directions + n;
        *growth = NAME(pick)(there, *growth * factor[n], *growth);
        far |= there & ~((*growth > NAME(fill)(1.0 / GROWTH_FAR)) & (*growth < NAME(fill)(GROWTH_FAR)));
    }
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            given[n * MODEL_NX + i] = NAME(pick)(there, d[n][i], given[n * MODEL_NX + i]);
    return !NAME(any)(far);
}
