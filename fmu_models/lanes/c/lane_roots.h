/* Where polynomials fall through zero, in all lanes at once; included once per target by lane_code.h. */
/* value, slope and curvature of a polynomial, or of its terms up to some order */
static INLINE void NAME(horner)(const V *q, int order, V u, V *f, V *d, V *dd)
{
    V a = q[order];
    V b = NAME(fill)(0.0);
    V c = NAME(fill)(0.0);
    LANES_UNROLL
    for (int k = order - 1; k >= 0; k--) {
        c = c * u + b;
        b = b * u + a;
        a = a * u + q[k];
    }
    *f = a;
    *d = b;
    *dd = c + c;
}

/* where q falls through zero between low, where it is f_low > 0, and high, where it is f_high <= 0; undecided lanes are
   marked. Halley's method, whose error after a step e is about e (e q''/q')^2, in a bracket */
static __attribute__((noinline)) V NAME(root)(const V *q, V low, V f_low, V high, V f_high, M wanted, M *undecided)
{
    enum { MOST = 60 };
    const V one = NAME(fill)(1.0);
    const V half = NAME(fill)(0.5);
    const V zero = NAME(fill)(0.0);
    M frozen = ~wanted;
    V u = low + (high - low) * (f_low / (f_low - f_high));
    for (int i = 0; i < 2; i++) {
        /* the low orders lead near to it */
        V f, d, dd;
        NAME(horner)(q, LANES_GUESS, u, &f, &d, &dd);
        const V next = u - f * d / (d * d - half * f * dd);
        u = NAME(pick)((M)(next >= low) & (M)(next <= high), next, u);
    }
    for (int i = 0; i < MOST && NAME(any)(~frozen); i++) {
        V f, d, dd;
        NAME(horner)(q, LANES_ORDER, u, &f, &d, &dd);
        const M below = (M)(f <= zero);
        high = NAME(pick)(below & ~frozen, u, high);
        low = NAME(pick)(~below & ~frozen, u, low);
        const V newton = f / d;
        const V curved = newton * (dd / d);
        const V bend = one - half * curved;
        V next = u - newton / NAME(pick)((M)(bend > half), bend, one);
        const M inside = (M)(next >= low) & (M)(next <= high);
        next = NAME(pick)(inside, next, half * (low + high));
        const V step = NAME(size)(next - u);
        const M close = inside & (M)(step <= NAME(fill)(2e-6)) & (M)(step * curved * curved <= NAME(fill)(1e-17));
        const M there = (M)(f == zero) | (M)(high - low <= NAME(fill)(2e-16) * high);
        u = NAME(pick)(frozen | (M)(f == zero), u, next);
        frozen |= close | there;
    }
    *undecided |= ~frozen;
    return u;
}

/*
 * The first fall of a guard on [0, 1], as its place; 2 where there is none. Marked are lanes that shorter sub-steps may
 * decide.
 */
static INLINE V NAME(guard_falls)(const V *q, M wanted, M *longer)
{
    const V zero = NAME(fill)(0.0);
    const V one = NAME(fill)(1.0);
    const V third = NAME(fill)(1.0 / 3.0);
    const V none = NAME(fill)(2.0);
    V rest = NAME(size)(q[4]);
    for (int k = 5; k <= LANES_ORDER; k++) {
        rest += NAME(size)(q[k]);
    }
    const V b2 = q[0] + third * (q[1] + q[1] + q[2]);
    const V b3 = q[0] + q[1] + q[2] + q[3];
    const V low = NAME(least)(NAME(least)(q[0], q[0] + third * q[1]), NAME(least)(b2, b3));
    M open = wanted & ~(M)(low > rest);
    if (!NAME(any)(open)) {
        return none;
    }
    V rest1 = zero;
    V rest2 = zero;
    V end = q[LANES_ORDER];
    V slope_end = NAME(fill)((double)LANES_ORDER) * q[LANES_ORDER];
    for (int k = LANES_ORDER; k >= 4; k--) {
        rest1 += NAME(fill)((double)k) * NAME(size)(q[k]);
        rest2 += NAME(fill)((double)(k * (k - 1))) * NAME(size)(q[k]);
    }
    for (int k = LANES_ORDER - 1; k >= 1; k--) {
        end += q[k];
        slope_end += NAME(fill)((double)k) * q[k];
    }
    end += q[0];
    const V twice = q[2] + q[2];
    const V e2 = q[1] + twice + NAME(fill)(3.0) * q[3];
    const V e1 = q[1] + q[2];
    const M falls = (M)(NAME(most)(NAME(most)(q[1], e1), e2) + rest1 < zero);
    const M rises = (M)(NAME(least)(NAME(least)(q[1], e1), e2) > rest1);
    const V bend_end = twice + NAME(fill)(6.0) * q[3];
    const M upward = (M)(NAME(least)(twice, bend_end) > rest2);
    const M downward = (M)(NAME(most)(twice, bend_end) + rest2 < zero);
    const M above = (M)(q[0] > zero);
    const M at_start = open & ~above & (M)(q[1] < zero);
    M undecided = open & ~above & ~at_start;
    open &= above;
    const M ends_below = (M)(end <= zero);
    /* rises; falls or bends one way, and stays above at the end where that says enough */
    M clear = rises | (falls & ~ends_below) | (downward & ~ends_below) | (upward & (M)(q[1] >= zero))
              | (upward & ~ends_below & (M)(slope_end <= zero));
    M single = (falls | downward | upward) & ends_below & ~clear;
    M dips = open & upward & ~clear & ~single;
    /* what bends upward lies above the tangents at both ends */
    const V meet = q[0] + q[1] * ((end - slope_end - q[0]) / (q[1] - slope_end));
    clear |= dips & (M)(meet > zero);
    dips &= ~clear;
    V high = one;
    V f_high = end;
    if (NAME(any)(dips)) {
        V slope[LANES_ORDER + 1];
        V f, d, dd;
        for (int k = 0; k < LANES_ORDER; k++) {
            slope[k] = -NAME(fill)((double)(k + 1)) * q[k + 1];
        }
        slope[LANES_ORDER] = zero;
        /* the slope rises through zero: its opposite falls */
        const V lowest = NAME(root)(slope, zero, slope[0], one, -slope_end, dips, &undecided);
        NAME(horner)(q, LANES_ORDER, lowest, &f, &d, &dd);
        clear |= dips & (M)(f > zero);
        single |= dips & (M)(f <= zero);
        high = NAME(pick)(dips, lowest, high);
        f_high = NAME(pick)(dips, f, f_high);
    }
    *longer |= open & ~clear & ~single;
    single &= open & ~clear;
    V place = NAME(pick)(at_start, zero, none);
    if (NAME(any)(single)) {
        const V found = NAME(root)(q, zero, q[0], high, f_high, single, &undecided);
        place = NAME(pick)(single, found, place);
    }
    *longer |= undecided;
    return place;
}
