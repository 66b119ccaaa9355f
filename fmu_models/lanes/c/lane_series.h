/* Sub-steps by series, in all lanes of a batch; included once per target by lane_code.h. */
/* the series of the states over a sub-step of length h: its variable runs from 0 to 1. From order LANES_LOW on only the
   endless states have terms */
static INLINE void NAME(expand)(const NAME(Batch) * b, V h, V (*y)[LANES_Z])
{
    /* 1/k! */
    static const double part[] = {
        1.0,        1.0,         1.0 / 2,      1.0 / 6,       1.0 / 24,       1.0 / 120,       1.0 / 720,
        1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800, 1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800};
    V now[LANES_Z], rates[MODEL_NX], turn[LANES_NH], flow[LANES_NF];
    for (int j = 0; j < LANES_Z; j++)
        y[0][j] = now[j] = b->z[j];
    for (int j = 0; j < LANES_HARMONICS; j++)
        turn[j] = h * b->wave[j];
    for (int e = 0; e < LANES_FLOW; e++)
        flow[e] = h * b->flow[e];
    LANES_UNROLL
    for (int k = 1; k <= LANES_ORDER; k++) {
        if (k <= LANES_LOW)
            LANES_FLOW(flow, now, rates);
        else
            LANES_FLOW_HIGH(flow, now, rates);
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
        for (int j = 0; j < LANES_Z; j++)
            if (k <= LANES_LOW || lanes_endless[j]) y[k][j] = now[j] * NAME(fill)(part[k]);
    }
}

/* coefficients of all guards from order 0 to another */
static INLINE void NAME(guards)(const NAME(Batch) * b, V (*y)[LANES_Z], int to, V (*q)[LANES_ORDER + 1])
{
    (void)y; /* of a model without contacts */
    V g[LANES_NG];
    LANES_UNROLL
    for (int k = 0; k <= to; k++) {
        for (int i = 0; i < LANES_GUARDS; i++)
            g[i] = k == 0 ? b->guard_constant[i] : NAME(fill)(0.0);
        if (k <= LANES_LOW)
            LANES_GUARD_SUMS(b->guard, y[k], g);
        else
            LANES_GUARD_SUMS_HIGH(b->guard, y[k], g);
        for (int i = 0; i < LANES_GUARDS; i++)
            q[i][k] = g[i];
    }
}

/* guards that have been left just now are known to be zero */
static INLINE void NAME(left_now)(NAME(Batch) * b, V (*q)[LANES_ORDER + 1], M some)
{
    const V zero = NAME(fill)(0.0);
    for (int g = 0; g < LANES_GUARDS; g++)
        b->known[g] -= (b->known[g] == NAME(none)()) & (q[g][0] == zero) & (q[g][1] > zero) & some;
}

/* a stop that has let go and is left on the way: nothing changes but its guards. Lanes in which its guard g falls all the
   way to below zero */
static INLINE M NAME(leaves)(const NAME(Batch) * b, const V *q, V rest)
{
    const V slope = NAME(fill)(4.0) * rest;
    const V e1 = q[1] + q[2];
    const V e2 = e1 + q[2] + NAME(fill)(3.0) * q[3];
    const V end = q[0] + q[1] + q[2] + q[3];
    return b->released & (NAME(most)(NAME(most)(q[1], e1), e2) + slope < NAME(fill)(0.0))
           & (end + rest < NAME(fill)(0.0));
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
    for (int i = 0; i < MODEL_NX; i++)
        size[i] = NAME(size)(b->z[i]);
    for (int g = 0; g < LANES_GUARDS; g++) {
        V tail;
        EACH(tail, b->mode[l]->tail_constant[g])
        for (int i = 0; i < MODEL_NX; i++) {
            V factor;
            EACH(factor, b->mode[l]->tail[g][i])
            tail += factor * size[i];
        }
        const M known = b->known[g] > NAME(none)();
        const V a0 = NAME(pick)(known, q[g][1], q[g][0]);
        const V a1 = NAME(pick)(known, q[g][2], q[g][1]);
        const V a2 = NAME(pick)(known, q[g][3], q[g][2]);
        const V a3 = NAME(pick)(known, zero, q[g][3]);
        const V b1 = a0 + third * a1;
        const V b2 = a0 + third * (a1 + a1 + a2);
        const V b3 = a0 + a1 + a2 + a3;
        const V low = NAME(least)(NAME(least)(a0, b1), NAME(least)(b2, b3));
        M falls = ~(low > tail * fourth) | (b->known[g] > NAME(none)() + 1);
        if (lanes_compliant[lanes_guard_contact[g]] && lanes_digits[lanes_guard_contact[g]] == 3
            && lanes_guard_slot[g] == GUARD_NORMAL) {
            const M silent = falls & ~known & NAME(leaves)(b, q[g], tail * fourth);
            *left = NAME(pick)(silent, NAME(fill)((double)g), *left);
            falls &= ~silent;
        }
        found |= falls;
    }
    return found;
}

/* without the roots at the start that are known; what stays at zero falls nowhere */
static INLINE void NAME(deflate)(V *q, M known)
{
    const M none = NAME(none)();
    const M always = known >= none + LANES_ZERO;
    M count = known & ~always;
    while (NAME(any)(count)) {
        const M more = count > none;
        for (int k = 0; k < LANES_ORDER; k++)
            q[k] = NAME(pick)(more, q[k + 1], q[k]);
        q[LANES_ORDER] = NAME(pick)(more, NAME(fill)(0.0), q[LANES_ORDER]);
        count += more;
    }
    if (NAME(any)(always))
        for (int k = 0; k <= LANES_ORDER; k++)
            q[k] = NAME(pick)(always, NAME(fill)(k == 0 ? 1.0 : 0.0), q[k]);
}

/* some lanes to a place u of the sub-step */
static INLINE void NAME(go)(NAME(Batch) * b, V (*y)[LANES_Z], V h, V u, M some)
{
    const M whole = (u == NAME(fill)(1.0)) & (h == b->left);
    /* even and odd orders apart: two short chains */
    const V square = u * u;
    for (int j = 0; j < LANES_Z; j++) {
        const int first = lanes_endless[j] ? LANES_ORDER : LANES_LOW;
        V part[2] = {y[0][j], NAME(fill)(0.0)};
        LANES_UNROLL
        for (int n = LANES_ORDER; n >= 0; n--)
            if (n <= first) part[n % 2] = n >= first - 1 ? y[n][j] : part[n % 2] * square + y[n][j];
        b->z[j] = NAME(pick)(some, first > 0 ? part[0] + u * part[1] : part[0], b->z[j]);
    }
    const V left = NAME(most)(b->left - h * u, NAME(fill)(0.0));
    b->left = NAME(pick)(some, NAME(pick)(whole, NAME(fill)(0.0), left), b->left);
}

/* a sub-step of some lanes in which probably no guard falls; where one may they want an event */
static __attribute__((noinline)) void NAME(series)(Pool *pool, NAME(Batch) * b, M some)
{
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    const V h = NAME(least)(b->left, b->longest);
    NAME(expand)(b, h, y);
    NAME(guards)(b, y, 3, q);
    NAME(left_now)(b, q, some);
    V gone = NAME(fill)(-1.0);
    const M open = NAME(doubtful)(b, h, q, &gone);
    const M made = some & ~open;
    NAME(go)(b, y, h, NAME(fill)(1.0), made);
    NAME(vary)(b, NAME(pick)(made, h, NAME(fill)(0.0)), pool->directions);
    for (int g = 0; g < LANES_GUARDS; g++)
        b->known[g] &= ~made;
    b->wants = NAME(choose)(some & open, NAME(none)() + QUEUE_EVENT, b->wants);
    NAME(stops)(b, made, gone);
    WHERE (some)
        b->lane[l]->rounds++;
    WHERE (made)
        NAME(pass_on)(pool, b, l);
}
