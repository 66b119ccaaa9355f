/*
 * Taylor recurrences: coefficient k of a function of series from the coefficients 0..k of its arguments and, where the
 * recurrence needs them, 0..k-1 of its own result and of its companions (passed as series, coefficient k not yet set).
 *
 * With y = f(a), differentiate and compare coefficients: k y[k] = sum_{i=1..k} i a[i] (df/da)[k-i].
 *
 * Included once per kind of number (scalar.h). Thousands of them are called instead of being part of their caller, or
 * the compiler takes minutes.
 *
 * Sources: Jorba and Zou, Experimental Mathematics 14 (2005), section 2.2; Griewank and Walther, Evaluating Derivatives
 * (2008), chapter 13. Where a function is not analytic (a division by zero, the root of zero) they give inf or nan.
 */
#if MODEL_NW > 200
#define JET static CALLED
#else
#define JET static inline
#endif

/* sum of a[i] b[k-i] over first <= i <= last, in two sums, neither of which waits for the other */
JET Real jet_convolution(const Real *a, const Real *b, int k, int first, int last)
{
    Real one = 0.0;
    Real two = 0.0;
    int i = first;
    for (; i + 3 <= last; i += 4) {
        one += a[i] * b[k - i] + a[i + 1] * b[k - i - 1];
        two += a[i + 2] * b[k - i - 2] + a[i + 3] * b[k - i - 3];
    }
    for (; i <= last; i++)
        one += a[i] * b[k - i];
    return one + two;
}

/* 1/k times the sum of i a[i] b[k-i] over 1 <= i <= last: what a' b adds to the integral of the product */
JET Real jet_integral(const Real *a, const Real *b, int k, int last)
{
    Real sum = 0.0;
    for (int i = 1; i <= last; i++)
        sum += i * a[i] * b[k - i];
    return sum / k;
}

/* a b */
JET Real jet_product(const Real *a, const Real *b, int k) { return jet_convolution(a, b, k, 0, k); }

/* a a, with the symmetric terms added once */
JET Real jet_square(const Real *a, int k)
{
    const Real pairs = 2.0 * jet_convolution(a, a, k, 0, (k + 1) / 2 - 1);
    return k % 2 == 0 ? pairs + a[k / 2] * a[k / 2] : pairs;
}

/* q = 1/(b0 + b1 b) */
JET Real jet_reciprocal(Real b0, Real b1, const Real *b, const Real *q, int k)
{
    return k == 0 ? 1.0 / (b0 + b1 * b[0]) : -b1 * q[0] * jet_convolution(b, q, k, 1, k);
}

/* q = a/(b0 + b1 b) */
JET Real jet_quotient(const Real *a, Real b0, Real b1, const Real *b, const Real *q, int k)
{
    return (a[k] - b1 * jet_convolution(b, q, k, 1, k)) / (b0 + b1 * b[0]);
}

/* y = sqrt(a) */
JET Real jet_sqrt(const Real *a, const Real *y, int k)
{
    return k == 0 ? sqrt(a[0]) : (a[k] - jet_convolution(y, y, k, 1, k - 1)) / (2.0 * y[0]);
}

/*
 * y = sqrt(a) where a may begin with zeros. In a series in the root s of time, a depth just entered is
 * a = s^2 b, b[0] > 0, and y = s sqrt(b): coefficient k of y then needs coefficient k + 1 of a. A negative a counts as
 * zero, of any function that y is a factor of together with a. At a zero of a that is none in s, the slope of the root
 * is left out (where a y is wanted it has no part in it) and the rest refused.
 */
JET Real jet_root(const Real *a, const Real *y, int k)
{
    if (PART(a[0]) > 0.0) return jet_sqrt(a, y, k);
    if (k == 0 || PART(a[0]) < 0.0) return 0.0;
    if (k > 0 && PART(a[1]) == 0.0)
        return k == 1 ? sqrt(a[2]) : (a[k + 1] - jet_convolution(y, y, k + 1, 2, k - 1)) / (2.0 * y[1]);
    return k == 1 ? 0.0 : NAN;
}

/* rate t + offset for the sine, with rate t reduced by whole turns; the time is t[0] + rest */
JET Real jet_angle(Real rate, Real offset, const Real *t, double rest, int k)
{
    if (k > 0) return rate * t[k];
    /* two pi in two parts; every product with its rounding error */
    const double turn = 6.283185307179586, turn_rest = 2.4492935982947064e-16;
    const double angle = PART(rate) * PART(t[0]);
    const double angle_rest = fma(PART(rate), PART(t[0]), -angle) + PART(rate) * rest;
    const double turns = rint(angle / turn);
    const double whole = turns * turn;
    const double whole_rest = fma(turns, turn, -whole) + turns * turn_rest;
    const Real tangent = rate * t[0] - angle; /* zero but for the tangent */
    return (angle - whole) + (angle_rest - whole_rest) + tangent + offset;
}

/* the same for rate = 2 pi frequency */
JET Real jet_turns(Real frequency, Real offset, const Real *t, double rest, int k)
{
    const double turn = 6.283185307179586;
    if (k > 0) return turn * frequency * t[k];
    const double turns = PART(frequency) * PART(t[0]);
    const double turns_rest = fma(PART(frequency), PART(t[0]), -turns) + PART(frequency) * rest;
    const Real tangent = frequency * t[0] - turns; /* zero but for the tangent */
    return turn * ((turns - rint(turns)) + turns_rest + tangent) + offset;
}

/* y = a^e for a constant exponent: a y' = e a' y */
JET Real jet_power(const Real *a, Real e, const Real *y, int k)
{
    if (k == 0) return pow(a[0], e);
    Real sum = 0.0;
    for (int i = 1; i <= k; i++)
        sum += ((e + 1.0) * i - k) * a[i] * y[k - i];
    return sum / (k * a[0]);
}

/*
 * y = a^e, e > 1, where a may begin with zeros: a = s^n b, b[0] > 0, and y = s^(e n) b^e if e n is whole, as it is of
 * halves in the root s of time. In time itself y is left out there: no step begins so (step/taylor.c). A negative a
 * counts as zero.
 */
JET Real jet_lifted(const Real *a, Real e, const Real *y, int k)
{
    int n = 1;
    if (PART(a[0]) > 0.0) return jet_power(a, e, y, k);
    while (n < k && PART(a[n]) == 0.0)
        n++;
    const double first = PART(e) * n;
    if (PART(a[0]) < 0.0 || k < first || first != floor(first)) return 0.0;
    const int i = k - (int)first;
    if (i == 0) return pow(a[n], e);
    Real sum = 0.0;
    for (int m = 1; m <= i; m++)
        sum += ((e + 1.0) * m - i) * a[n + m] * y[k - m];
    return sum / (i * a[n]);
}

/* y = exp(a) */
JET Real jet_exp(const Real *a, const Real *y, int k) { return k == 0 ? exp(a[0]) : jet_integral(a, y, k, k); }

/* y = log(a): a y' = a' */
JET Real jet_log(const Real *a, const Real *y, int k)
{
    return k == 0 ? log(a[0]) : (a[k] - jet_integral(y, a, k, k - 1)) / a[0];
}

/* y = sin(a), c = cos(a) */
JET Real jet_sin(const Real *a, const Real *c, int k) { return k == 0 ? sin(a[0]) : jet_integral(a, c, k, k); }

/* y = cos(a), s = sin(a) */
JET Real jet_cos(const Real *a, const Real *s, int k) { return k == 0 ? cos(a[0]) : -jet_integral(a, s, k, k); }

/* sine and cosine of the phase that was last asked for: slip, depth and laws ask for the same one, one by one; a cosine
   of zero, which no number has, stands for none */
JET const Wave *jet_wave(Real phase, Wave *last)
{
    if (!(last->phase == phase && last->cosine != 0.0)) *last = (Wave){phase, sin(phase), cos(phase)};
    return last;
}

/* the same where a is linear in time: of order 1, or 2 where the series run in the root of time */
JET Real jet_sin_phase(const Real *a, const Real *c, Wave *last, int k)
{
    return k == 0 ? jet_wave(a[0], last)->sine : jet_integral(a, c, k, k < 2 ? k : 2);
}

JET Real jet_cos_phase(const Real *a, const Real *s, Wave *last, int k)
{
    return k == 0 ? jet_wave(a[0], last)->cosine : -jet_integral(a, s, k, k < 2 ? k : 2);
}

/* y = sinh(a), c = cosh(a) */
JET Real jet_sinh(const Real *a, const Real *c, int k) { return k == 0 ? sinh(a[0]) : jet_integral(a, c, k, k); }

/* y = cosh(a), s = sinh(a) */
JET Real jet_cosh(const Real *a, const Real *s, int k) { return k == 0 ? cosh(a[0]) : jet_integral(a, s, k, k); }

/* w = sqrt(a a + b b), of orders above 0 where it is not zero */
static CALLED Real jet_length(const Real *w, const Real *a, const Real *b, int k)
{
    if (k == 0) return sqrt(a[0] * a[0] + b[0] * b[0]);
    if (PART(w[0]) == 0.0) return 0.0;
    return (jet_product(a, a, k) + jet_product(b, b, k) - jet_convolution(w, w, k, 1, k - 1)) / (2.0 * w[0]);
}

/* y = tanh(a), y2 = y y: y' = (1 - y2) a' */
JET Real jet_tanh(const Real *a, const Real *y2, int k)
{
    return k == 0 ? tanh(a[0]) : a[k] - jet_integral(a, y2, k, k);
}

/* y = atan(a), a2 = a a: (1 + a2) y' = a' */
JET Real jet_atan(const Real *a, const Real *a2, const Real *y, int k)
{
    return k == 0 ? atan(a[0]) : (a[k] - jet_integral(y, a2, k, k - 1)) / (1.0 + a2[0]);
}

#undef JET
