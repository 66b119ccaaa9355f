/*
 * Elementary functions from sums and products alone, by plain series after a reduction of the argument. What is lost
 * by rounding on the way is carried along as the low part of a number, so that results are within a digit of the last
 * place (log2, tan, atan, sinh, cosh and tanh: up to three).
 *
 *     exp   x = n ln 2 + r,    exp(x) = 2^n exp(r),    |r| <= ln 2/2
 *     log   x = 2^n m,         log(x) = n ln 2 + 2 artanh((m - 1)/(m + 1)),    1/sqrt 2 <= m < sqrt 2
 *     pow   exp(y log(x)) with both parts of the logarithm
 *     sin   x = n pi/2 + r,    one of +-sin(r), +-cos(r),    |r| <= pi/4
 *     atan  pi/2 - atan(1/x) above 1, pi/4 + atan((x - 1)/(x + 1)) above tan(pi/8)
 *     fma   the exact product, and its sum with a last part that is rounded to odd
 *
 * Source: Muller et al., Handbook of Floating-Point Arithmetic (2018), chapters 4 and 10; Dekker, Numerische Mathematik
 * 18 (1971), for the exact sum and product; Boldo and Melquiond, IEEE Transactions on Computers 57 (2008), for fma.
 */
#include "mathematics.h"

#include <stdint.h>

/* a number as an unevaluated sum, the low part below half a digit of the high one */
typedef struct {
    double high, low;
} Pair2;

/* ln 2 with a first part of 40 bits, of which whole multiples are exact; pi/2 in three parts, pi/4 in two */
static const double LN2 = 0.6931471805592082, LN2_REST = 7.371002565167799e-13;
static const Pair2 LN2_PAIR = {0.6931471805599453, 2.3190468138462996e-17};
static const double HALF_PI[] = {1.5707963267948966, 6.123233995736766e-17, -1.4973849048591698e-33};

static Pair2 sum(double a, double b)
{
    const double s = a + b, of_b = s - a;
    return (Pair2){s, (a - (s - of_b)) + (b - of_b)};
}

static Pair2 product(double a, double b)
{
    const double split = 134217729.0; /* 2^27 + 1 */
    const double p = a * b, ta = split * a, tb = split * b;
    const double ah = ta - (ta - a), al = a - ah, bh = tb - (tb - b), bl = b - bh;
    return (Pair2){p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
}

/* a + b to an odd last digit where it is not exact: rounded once more to fewer digits, it is as if rounded once */
static double odd_sum(double a, double b)
{
    const Pair2 s = sum(a, b);
    union {
        double value;
        int64_t bits;
    } odd = {.value = s.high};
    if (s.low != 0.0 && !(odd.bits & 1)) odd.bits += (s.low > 0.0) == (s.high > 0.0) ? 1 : -1;
    return odd.value;
}

double same_fma(double a, double b, double c)
{
    if (!isfinite(a * b) || !isfinite(c) || a == 0.0 || b == 0.0 || c == 0.0) return a * b + c;
    int ea, eb, ec;
    a = frexp(a, &ea);
    b = frexp(b, &eb);
    c = frexp(c, &ec);
    const int e = ea + eb, above = ec - e;
    if (above > 60) return ldexp(c, ec);
    /* what is below all digits of the product tells by its sign alone */
    c = ldexp(c, above < -120 ? -120 : above);
    const Pair2 p = product(a, b), low = sum(c, p.low), high = sum(p.high, low.high);
    return ldexp(high.high + odd_sum(low.low, high.low), e);
}

static Pair2 added(Pair2 a, Pair2 b)
{
    const Pair2 s = sum(a.high, b.high);
    return sum(s.high, s.low + (a.low + b.low));
}

static Pair2 multiplied(Pair2 a, Pair2 b)
{
    const Pair2 p = product(a.high, b.high);
    return sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

/* polynomial with the coefficients 1/(2 i + 1) for i from first to last, of z^(i - first) */
static double odd_reciprocals(double z, int first, int last, double sign)
{
    double value = 0.0;
    for (int i = last; i >= first; i--)
        value = value * z * sign + 1.0 / (2 * i + 1);
    return value;
}

/* sum over i >= first of sign^(i - first) z^(i - first) k! / (k + 2 (i - first))!, without the first k! */
static double by_factorials(double z, int k, int terms, double sign)
{
    double value = 1.0;
    for (int i = terms; i > 0; i--)
        value = 1.0 + sign * value * z / ((k + 2 * i - 1) * (k + 2 * i));
    return value;
}

static double exp_of(Pair2 x)
{
    if (x.high != x.high) return x.high;
    if (x.high > 709.79) return INFINITY;
    if (x.high < -745.14) return 0.0;
    const double n = rint(x.high * 1.4426950408889634);
    const Pair2 reduced = sum(x.high - n * LN2, x.low - n * LN2_REST);
    const double r = reduced.high;
    double tail = 1.0; /* of r^2/2, in parts of it */
    for (int i = 15; i > 2; i--)
        tail = 1.0 + tail * r / i;
    const double value = 1.0 + (r + (0.5 * r * r * tail + reduced.low * (1.0 + r)));
    /* in two steps, since 2^n alone may be too large or too small for a number */
    const int half = (int)n / 2;
    return ldexp(ldexp(value, half), (int)n - half);
}

double same_exp(double x) { return exp_of((Pair2){x, 0.0}); }

/* of a positive finite number */
static Pair2 log_of(double x)
{
    int n;
    double m = frexp(x, &n);
    if (m < 0.7071067811865476) {
        m *= 2.0;
        n--;
    }
    /* s = (m - 1)/(m + 1), and what its division leaves */
    const Pair2 below = sum(m, 1.0);
    const double above = m - 1.0;
    const double quotient = above / below.high;
    const Pair2 back = product(quotient, below.high);
    const Pair2 s = sum(quotient, ((above - back.high) - back.low - quotient * below.low) / below.high);
    const Pair2 z = multiplied(s, s);
    /* 1 + z/3 + z^2/5 + z^3/7 in both parts, what follows in one */
    Pair2 series = {0.14285714285714285, 7.93016446160826e-18};
    series = added(series, (Pair2){z.high * odd_reciprocals(z.high, 4, 14, 1.0), 0.0});
    series = added((Pair2){0.2, -1.1102230246251566e-17}, multiplied(z, series));
    series = added((Pair2){0.3333333333333333, 1.850371707708594e-17}, multiplied(z, series));
    series = added((Pair2){1.0, 0.0}, multiplied(z, series));
    const Pair2 of_m = multiplied((Pair2){2.0 * s.high, 2.0 * s.low}, series);
    return added(multiplied((Pair2){n, 0.0}, LN2_PAIR), of_m);
}

double same_log(double x)
{
    if (x != x || x == INFINITY) return x;
    if (x <= 0.0) return x == 0.0 ? -INFINITY : NAN;
    return log_of(x).high;
}

double same_log2(double x) { return 1.4426950408889634 * same_log(x); }

double same_pow(double x, double y)
{
    if (x == 1.0 || y == 0.0) return 1.0;
    if (x != x || y != y) return NAN;
    const double size = fabs(x);
    const int whole = rint(y) == y, odd = whole && rint(0.5 * y) != 0.5 * y;
    const double sign = odd && signbit(x) ? -1.0 : 1.0;
    if (size == 1.0 && isinf(y)) return 1.0;
    if (size == 0.0 || isinf(size) || isinf(y)) return (size > 1.0) == (y > 0.0) ? sign * INFINITY : sign * 0.0;
    if (x < 0.0 && !whole) return NAN;
    const Pair2 logarithm = log_of(size);
    if (fabs(y) > 1e20) return (logarithm.high > 0.0) == (y > 0.0) ? sign * INFINITY : sign * 0.0;
    return sign * exp_of(multiplied(logarithm, (Pair2){y, 0.0}));
}

/* what is left of an angle after whole quarters of a turn, and how many these are */
static Pair2 reduced_angle(double x, int *quarter)
{
    const double n = rint(x * 0.6366197723675814);
    const Pair2 first = product(n, HALF_PI[0]), second = product(n, HALF_PI[1]);
    const Pair2 r = sum(x - first.high, -first.low);
    const Pair2 rest = sum(r.high, -second.high);
    *quarter = (int)(n - 4.0 * floor(0.25 * n));
    return sum(rest.high, rest.low + (r.low - second.low - n * HALF_PI[2]));
}

static double sin_of(Pair2 r)
{
    const double z = r.high * r.high;
    return r.high + (r.low * (1.0 - 0.5 * z) - r.high * z * by_factorials(z, 3, 8, -1.0) / 6.0);
}

static double cos_of(Pair2 r)
{
    const double z = r.high * r.high, half = 0.5 * z, w = 1.0 - half;
    return w + (((1.0 - w) - half) + (z * z * by_factorials(z, 4, 8, -1.0) / 24.0 - r.high * r.low));
}

/* sine of so many quarters of a turn and the angle */
static double turned(double x, int quarters)
{
    int quarter;
    if (!(fabs(x) <= 4503599627370496.0)) return NAN;
    const Pair2 r = reduced_angle(x, &quarter);
    const int place = (quarter + quarters) & 3;
    const double value = place & 1 ? cos_of(r) : sin_of(r);
    return place & 2 ? -value : value;
}

double same_sin(double x) { return turned(x, 0); }

double same_cos(double x) { return turned(x, 1); }

double same_tan(double x) { return turned(x, 0) / turned(x, 1); }

double same_sinh(double x)
{
    if (fabs(x) < 1.0) return x + x * (x * x) * by_factorials(x * x, 3, 9, 1.0) / 6.0;
    const double half = same_exp(0.5 * fabs(x));
    const double value = 0.5 * half * half - 0.5 / half / half;
    return x < 0.0 ? -value : value;
}

double same_cosh(double x)
{
    const double half = same_exp(0.5 * fabs(x));
    return 0.5 * half * half + 0.5 / half / half;
}

double same_tanh(double x)
{
    if (fabs(x) < 0.5) return same_sinh(x) / same_cosh(x);
    const double value = 1.0 - 2.0 / (same_exp(2.0 * fabs(x)) + 1.0);
    return x < 0.0 ? -value : value;
}

double same_atan(double x)
{
    const double size = fabs(x), near = size > 1.0 ? 1.0 / size : size;
    const int middle = near > 0.4142135623730951;
    const double t = middle ? (near - 1.0) / (near + 1.0) : near;
    const double tail = -t * (t * t) * odd_reciprocals(t * t, 1, 21, -1.0);
    double value = middle ? 0.7853981633974483 + (t + (tail + 3.061616997868383e-17)) : t + tail;
    if (size > 1.0) value = HALF_PI[0] - (value - HALF_PI[1]);
    return x < 0.0 ? -value : value;
}
