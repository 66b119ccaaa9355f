/* Where polynomials fall through zero, in all lanes at once; included once per target by lane_code.h. */
/* value, slope and curvature of a polynomial, or of its terms up to some odd order: of its even and odd parts in u^2 */
static INLINE void NAME(horner)(const V *q, int order, V u, V *f, V *d, V *dd)
{
    const V v = u * u;
    V a[2], b[2], c[2];
    for (int odd = 0; odd < 2; odd++) {
        a[odd] = q[order - 1 + odd];
        b[odd] = NAME(fill)(0.0);
        c[odd] = NAME(fill)(0.0);
        LANES_UNROLL
        for (int k = order - 3 + odd; k >= 0; k -= 2) {
            c[odd] = k == order - 3 + odd ? c[odd] : c[odd] * v + b[odd];
            b[odd] = k == order - 3 + odd ? a[odd] : b[odd] * v + a[odd];
            a[odd] = a[odd] * v + q[k];
        }
    }
    /* q = a0 + u a1; b and c are the first derivatives in v, and halves of the second */
    const V twice = u + u;
    const V slopes = b[0] + u * b[1];
    *f = a[0] + u * a[1];
    *d = a[1] + twice * slopes;
    const V four = NAME(fill)(4.0) * v;
    *dd = (slopes + slopes) + NAME(fill)(4.0) * (u * b[1]) + (four + four) * (c[0] + u * c[1]);
}

/* where u is, between low and high, by the cubic of Hermite for u as a function of q, where that rises all the way; else
   by the secant */
static INLINE V NAME(near_root)(V low, V f_low, V d_low, V high, V f_high, V d_high)
{
    const V zero = NAME(fill)(0.0);
    const V width = high - low;
    const V three = NAME(fill)(3.0);
    const V fall = f_low - f_high;
    const V s = f_low / fall;
    const V m0 = -fall / d_low;
    const V m1 = -fall / d_high;
    const V rest = NAME(fill)(1.0) - s;
    const V least = NAME(least)(m0, m1);
    const M rises = (least > zero) & (NAME(most)(m0, m1) < three * width);
    const V cubic = width * (s * s * (three - s - s)) + s * rest * (m0 * rest - m1 * s);
    return low + NAME(pick)(rises, cubic, width * s);
}

/* where q falls through zero between low, where it is f_low > 0, and high, where it is f_high <= 0, from u on; undecided
   lanes are marked. Halley's method, whose error after a step e is about e (e q''/q')^2, in a bracket */
static INLINE V NAME(root)(const V *q, V u, V low, V high, M wanted, M *undecided)
{
    enum { MOST = 60 };
    const V half = NAME(fill)(0.5);
    const V zero = NAME(fill)(0.0);
    M frozen = ~wanted;
    V f, d, dd;
    /* the low orders lead near to it */
    NAME(horner)(q, LANES_GUESS, u, &f, &d, &dd);
    const V near = u - f * d / (d * d - half * f * dd);
    u = NAME(pick)((near > low) & (near < high), near, u);
    for (int i = 0; i < MOST && NAME(any)(~frozen); i++) {
        NAME(horner)(q, LANES_ORDER, u, &f, &d, &dd);
        const M below = (f <= zero);
        high = NAME(pick)(below & ~frozen, u, high);
        low = NAME(pick)(~below & ~frozen, u, low);
        /* Newton's where the curve bends too much */
        const V square = d * d;
        const V curved = f * dd;
        const M bends = square > curved;
        const V next_step = NAME(pick)(bends, f * d, f) / NAME(pick)(bends, square - half * curved, d);
        V next = u - next_step;
        const M inside = (next >= low) & (next <= high);
        next = NAME(pick)(inside, next, half * (low + high));
        const V step = NAME(size)(next - u);
        const M close = inside & (step * curved * curved <= NAME(fill)(1e-17) * square * square)
                        & (step <= NAME(fill)(2e-6));
        const M there = (f == zero) | (high - low <= NAME(fill)(2e-16) * high);
        u = NAME(pick)(frozen | (f == zero), u, next);
        frozen |= close | there;
    }
    *undecided |= ~frozen;
    return u;
}

/* the lowest place of what bends upward, whose slope is d_low < 0 at 0 and d_high > 0 at 1 */
static __attribute__((noinline)) V NAME(lowest)(const V *q, V d_low, V d_high, M wanted, M *undecided)
{
    V slope[LANES_ORDER + 1];
    for (int k = 0; k < LANES_ORDER; k++)
        slope[k] = -NAME(fill)((double)(k + 1)) * q[k + 1];
    slope[LANES_ORDER] = NAME(fill)(0.0);
    /* the slope rises through zero: its opposite falls */
    return NAME(root)(slope, d_low / (d_low - d_high), NAME(fill)(0.0), NAME(fill)(1.0), wanted, undecided);
}

/* terms from the fourth order on: what they can change in the second derivative; in the value at most a twelfth of it,
   in the slope a third */
static INLINE V NAME(bend_rest)(const V *q)
{
    V rest[2] = {NAME(fill)(0.0), NAME(fill)(0.0)};
    LANES_UNROLL
    for (int k = LANES_ORDER; k >= 4; k--)
        rest[k % 2] += NAME(fill)((double)(k * (k - 1))) * NAME(size)(q[k]);
    return rest[0] + rest[1];
}

/* lanes in which a guard may fall on [0, to], by Bernstein's coefficients of its first terms */
static INLINE M NAME(may_fall)(const V *q, V rest2, V to)
{
    const V third = to * NAME(fill)(1.0 / 3.0);
    const V square = to * to;
    const V b1 = q[0] + third * q[1];
    const V b2 = b1 + third * (q[1] + to * q[2]);
    const V b3 = q[0] + to * (q[1] + to * q[2]) + square * to * q[3];
    const V low = NAME(least)(NAME(least)(q[0], b1), NAME(least)(b2, b3));
    return ~(low > NAME(fill)(1.0 / 12.0) * (square * square) * rest2);
}

/*
 * The first fall of a guard on [0, 1], as its place; 2 where there is none. Marked are lanes that shorter sub-steps may
 * decide.
 */
static INLINE V NAME(guard_falls)(const V *q, V rest2, M open, M *longer)
{
    const V zero = NAME(fill)(0.0);
    const V one = NAME(fill)(1.0);
    const V none = NAME(fill)(2.0);
    const V rest1 = NAME(fill)(1.0 / 3.0) * rest2;
    V ends[2] = {q[LANES_ORDER - 1], q[LANES_ORDER]};
    V slopes[2] = {NAME(fill)((double)(LANES_ORDER - 1)) * ends[0], NAME(fill)((double)LANES_ORDER) * ends[1]};
    LANES_UNROLL
    for (int k = LANES_ORDER - 2; k >= 1; k--) {
        ends[k % 2] += q[k];
        slopes[k % 2] += NAME(fill)((double)k) * q[k];
    }
    const V end = ends[0] + ends[1] + q[0];
    const V slope_end = slopes[0] + slopes[1];
    const V twice = q[2] + q[2];
    const V e2 = q[1] + twice + NAME(fill)(3.0) * q[3];
    const V e1 = q[1] + q[2];
    const M falls = (NAME(most)(NAME(most)(q[1], e1), e2) + rest1 < zero);
    const M rises = (NAME(least)(NAME(least)(q[1], e1), e2) > rest1);
    const V bend_end = twice + NAME(fill)(6.0) * q[3];
    const M upward = (NAME(least)(twice, bend_end) > rest2);
    const M downward = (NAME(most)(twice, bend_end) + rest2 < zero);
    const M above = (q[0] > zero);
    const M at_start = open & ~above & (q[1] < zero);
    M undecided = open & ~above & ~at_start;
    open &= above;
    const M ends_below = (end <= zero);
    /* rises; falls or bends one way, and stays above at the end where that says enough */
    M clear = rises | (falls & ~ends_below) | (downward & ~ends_below) | (upward & (q[1] >= zero))
              | (upward & ~ends_below & (slope_end <= zero));
    M single = (falls | downward | upward) & ends_below & ~clear;
    M dips = open & upward & ~clear & ~single;
    V high = one;
    V first = NAME(near_root)(zero, q[0], q[1], one, end, slope_end);
    if (NAME(any)(dips)) {
        V f, d, dd;
        /* what bends upward lies above the tangents at both ends */
        const V meet = q[0] + q[1] * ((end - slope_end - q[0]) / (q[1] - slope_end));
        clear |= dips & (meet > zero);
        dips &= ~clear;
        const V lowest = NAME(lowest)(q, q[1], slope_end, dips, &undecided);
        NAME(horner)(q, LANES_ORDER, lowest, &f, &d, &dd);
        clear |= dips & (f > zero);
        single |= dips & (f <= zero);
        high = NAME(pick)(dips, lowest, high);
        first = NAME(pick)(dips, lowest * (q[0] / (q[0] - f)), first);
    }
    *longer |= open & ~clear & ~single;
    single &= open & ~clear;
    V place = NAME(pick)(at_start, zero, none);
    if (NAME(any)(single)) {
        const V found = NAME(root)(q, first, zero, high, single, &undecided);
        place = NAME(pick)(single, found, place);
    }
    *longer |= undecided;
    return place;
}

/* the earliest fall of all guards in lanes `left`; lanes that are not decided are marked. Most lanes have one guard that
   may fall at all: these are searched at once, then others that may fall before; the last one first, for a stop lets go
   before its bound is left */
static INLINE V NAME(earliest_fall)(V (*q)[LANES_ORDER + 1], M left, V *which, M *longer)
{
    V rest[LANES_NG];
    M open[LANES_NG];
    V first = NAME(fill)(2.0);
    *which = NAME(fill)(-1.0);
    for (int g = 0; g < LANES_GUARDS; g++) {
        rest[g] = NAME(bend_rest)(q[g]);
        open[g] = left & NAME(may_fall)(q[g], rest[g], NAME(fill)(1.0));
    }
    for (int round = 0; round < LANES_GUARDS; round++) {
        V one[LANES_ORDER + 1];
        V bend = rest[0];
        V guard = NAME(fill)(0.0);
        M any = open[0];
        memcpy(one, q[0], sizeof one);
        for (int g = 1; g < LANES_GUARDS; g++) {
            guard = NAME(pick)(open[g], NAME(fill)((double)g), guard);
            bend = NAME(pick)(open[g], rest[g], bend);
            for (int k = 0; k <= LANES_ORDER; k++)
                one[k] = NAME(pick)(open[g], q[g][k], one[k]);
            any |= open[g];
        }
        if (!NAME(any)(any)) break;
        const V at = NAME(guard_falls)(one, bend, any, longer);
        const M sooner = (at < first);
        *which = NAME(pick)(sooner, guard, *which);
        first = NAME(pick)(sooner, at, first);
        for (int g = 0; g < LANES_GUARDS - 1; g++) {
            open[g] &= (guard != NAME(fill)((double)g));
            if (NAME(any)(open[g])) open[g] &= NAME(may_fall)(q[g], rest[g], NAME(least)(first, NAME(fill)(1.0)));
        }
        open[LANES_NG - 1] = NAME(none)();
    }
    return first;
}

/* the earliest fall of all guards; how far the sub-step goes where there is none; lanes that are not decided */
static INLINE V NAME(search)(V (*q)[LANES_ORDER + 1], M busy, V *which, M *undecided)
{
    enum { HALVINGS = 12 };
    V reach = NAME(fill)(1.0);
    V place = NAME(fill)(1.0);
    M left = busy;
    *which = NAME(fill)(-1.0);
    for (int n = 0; n < HALVINGS; n++) {
        M longer = NAME(none)();
        V guard;
        const V first = NAME(earliest_fall)(q, left, &guard, &longer);
        const M done = left & ~longer;
        const M falls = done & (first < NAME(fill)(1.5));
        place = NAME(pick)(falls, first * reach, NAME(pick)(done, reach, place));
        *which = NAME(pick)(falls, guard, *which);
        left &= longer;
        if (!NAME(any)(left)) break;
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
