/*
 * First fall of a polynomial to zero, found for certain: Bernstein coefficients bound the polynomial on an
 * interval, their sign changes bound the number of its roots (Descartes), bisection separates the roots.
 *
 *     first_fall(c, n, h): the smallest s in (0, h] with c(s) <= 0 and c > 0 before, or -1
 *         nothing to do if the parabola of the first three terms stays above the sum of the negative others
 *         the low orders, whose tail is bounded by the sum of its terms, mostly decide at a fraction of the cost:
 *             above the tail            -> no root here
 *             falling faster than it    -> at most one root: bracket if the end is not positive, else none here
 *             otherwise                 -> halve; after a few halvings leave it to the whole polynomial:
 *         intervals, left first:
 *             no sign change            -> no root here
 *             one change, + to -        -> bracket, refine by Newton's method, its next term too, kept inside the bracket
 *             narrower than resolution  -> the polynomial touches zero without being seen to cross: no fall
 *             otherwise                 -> halve (de Casteljau)
 */
#include "roots.h"

#include <float.h>
#include <math.h>

/* where the order is a constant its loops are unrolled, a third of the instructions */
#if defined(__GNUC__)
#define UNROLLED static inline __attribute__((always_inline))
#else
#define UNROLLED static inline
#endif

enum { HALVINGS = 50, QUICK_HALVINGS = 6, LOW = 8, HIGH = 12 };

/* value, slope and half the curvature at s, even and odd powers apart: two chains of half the length */
static double value_and_slopes(const double *c, int n, double s, double *slope, double *bend)
{
    const double t = s * s;
    int k = n - n % 2;
    double even = c[k], even1 = 0.0, even2 = 0.0;
    double odd = k < n ? c[n] : 0.0, odd1 = 0.0, odd2 = 0.0;
    for (k -= 2; k >= 0; k -= 2) {
        even2 = even2 * t + even1;
        even1 = even1 * t + even;
        even = even * t + c[k];
        odd2 = odd2 * t + odd1;
        odd1 = odd1 * t + odd;
        odd = odd * t + c[k + 1];
    }
    /* p = E(t) + s O(t) with t = s^2; E1 and O1 are first derivatives by t, E2 and O2 halves of second ones */
    *slope = odd + 2.0 * (s * even1 + t * odd1);
    *bend = even1 + 4.0 * t * even2 + s * (3.0 * odd1 + 4.0 * t * odd2);
    return even + s * odd;
}

#define Number double
#define POLYNOMIAL(name) polynomial_##name
#include "polynomial.h"

/*
 * the root in a bracket with c(low) > 0 >= c(high), from a first guess: with x Newton's step and b the bend in parts of
 * the slope, x - b x^2 leaves an error of the order (b^2 + d) x^3, where d, of the third derivative, is of order 1
 */
static double refine(const double *c, int n, double low, double high, double s)
{
    for (int i = 0; i < 100; i++) {
        double slope, bend;
        const double value = value_and_slopes(c, n, s, &slope, &bend);
        if (value > 0.0)
            low = s;
        else
            high = s;
        const double newton = -value / slope;
        const double ratio = bend / slope * newton;
        const double next = s + (fabs(ratio) < 0.25 ? newton * (1.0 - ratio) : newton);
        if (!(next >= low && next <= high)) {
            s = 0.5 * (low + high);
            continue;
        }
        if (fabs(next - s) <= DBL_EPSILON * s
            || 8.0 * (ratio * ratio + newton * newton) * fabs(newton) <= DBL_EPSILON * s) {
            return next;
        }
        s = next;
    }
    return high;
}

/* a few steps of Newton's method from a point towards the root in a bracket, until the value is within `near` */
static double guess(const double *c, int n, double low, double high, double s, double near)
{
    for (int i = 0; i < 4; i++) {
        double slope, bend;
        const double value = value_and_slopes(c, n, s, &slope, &bend);
        const double next = s - value / slope;
        s = next > low && next < high ? next : 0.5 * (low + high);
        if (fabs(value) <= near) break;
    }
    return s;
}

/* Bernstein coefficients on [0, 1] of the polynomial with power coefficients b */
UNROLLED void to_bernstein(const double *b, int n, double *beta)
{
    /* the reciprocals of the binomial coefficients, by multiplications alone */
    static const double RECIPROCAL[POLYNOMIAL_TERMS] = {
        0.0,      1.0 / 1,  1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,  1.0 / 9,  1.0 / 10,
        1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16, 1.0 / 17, 1.0 / 18, 1.0 / 19, 1.0 / 20, 1.0 / 21,
        1.0 / 22, 1.0 / 23, 1.0 / 24, 1.0 / 25, 1.0 / 26, 1.0 / 27, 1.0 / 28, 1.0 / 29, 1.0 / 30, 1.0 / 31, 1.0 / 32,
    };
    double share = 1.0;
    beta[0] = b[0];
    for (int k = 1; k <= n; k++) {
        share *= k * RECIPROCAL[n - k + 1];
        beta[k] = b[k] * share;
    }
    for (int k = 1; k <= n; k++)
        for (int i = n; i >= k; i--)
            beta[i] += beta[i - 1];
}

/* halves at the middle: beta becomes the right half, left gets the left one */
UNROLLED void halve(double *beta, int n, double *left)
{
    left[0] = beta[0];
    for (int k = 1; k <= n; k++) {
        for (int i = 0; i <= n - k; i++)
            beta[i] = 0.5 * (beta[i] + beta[i + 1]);
        left[k] = beta[0];
    }
}

/* sign changes, a zero counted as negative: a touch at the very end of an interval is a fall */
static int sign_changes(const double *beta, int n)
{
    int changes = 0;
    for (int i = 1; i <= n; i++)
        changes += (beta[i] > 0.0) != (beta[i - 1] > 0.0);
    return changes;
}

/* the sum of the magnitudes of the terms beyond an order */
static double tail_of(const double *b, int order, int n)
{
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    int k = order + 1;
    for (; k + 3 <= n; k += 4)
        for (int i = 0; i < 4; i++)
            sum[i] += fabs(b[k + i]);
    for (; k <= n; k++)
        sum[0] += fabs(b[k]);
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* whether the parabola of the first three terms stays above all that the others may take */
static int certainly_positive(const double *b, double tail, double slack)
{
    const double MARGIN = 1e-9; /* far beyond rounding */
    double rest = tail;
    for (int k = 3; k <= LOW; k++)
        rest -= b[k] < 0.0 ? b[k] : 0.0;
    double lowest = fmin(b[0], b[0] + b[1] + b[2]);
    if (b[1] < 0.0 && -b[1] < 2.0 * b[2]) lowest = b[0] - b[1] * b[1] / (4.0 * b[2]);
    return lowest - rest > slack + MARGIN * b[0];
}

/* a point before the root of b - slack in an interval on which b falls, near it, from a first guess; b is positive
   there */
static double before_root(const double *b, int n, double slack, double low, double high, double s)
{
    const double NEAR = 1e-3;
    if (!(s > low && s < high)) s = 0.5 * (low + high);
    for (int i = 0; i < 8; i++) {
        double slope, bend;
        const double value = value_and_slopes(b, n, s, &slope, &bend) - slack;
        double next = s - value / slope;
        if (value > 0.0) {
            if (next - s <= NEAR * s) return s;
            low = s;
        } else {
            high = s;
            next -= NEAR * next; /* from beyond the root Newton's method on a falling arc stays there */
        }
        s = next > low && next < high ? next : 0.5 * (low + high);
    }
    return low;
}

/*
 * first_fall on [0, 1] in units of it, up to a place there, by an order and what lies beyond it; -2 where they do not
 * decide. With slack > 0 a point near and before the first place at which b falls below slack.
 */
UNROLLED double fall_by_order(const double *b, int n, int order, double tail, double slack, double until)
{
    const double NARROW = 1.5 / (1 << QUICK_HALVINGS);
    const double slopes = n * tail; /* no more than that is the slope of the tail */
    double stack[QUICK_HALVINGS + 1][HIGH + 1];
    double start[QUICK_HALVINGS + 1], width[QUICK_HALVINGS + 1];
    int top = 0;
    to_bernstein(b, order, stack[0]);
    start[0] = 0.0;
    width[0] = 1.0;
    while (top >= 0) {
        double *beta = stack[top];
        double least = beta[0];
        double flattest = -INFINITY;
        for (int i = 1; i <= order; i++) {
            const double rise = beta[i] - beta[i - 1];
            flattest = rise > flattest ? rise : flattest;
            least = beta[i] < least ? beta[i] : least;
        }
        if (least > tail + slack) {
            top--;
            continue;
        }
        const double end = start[top] + width[top];
        if (start[top] > until) return -1.0;
        if (flattest * order < -slopes * width[top]) {
            if (beta[order] > slack - tail && !(polynomial_value(b, n, end) <= slack)) {
                top--;
                continue;
            }
            if (end > until && polynomial_value(b, n, until) > 0.0) return -1.0;
            const double level = slack > 0.0 ? slack + tail : 0.0;
            const double across = start[top] + width[top] * (beta[0] - level) / (beta[0] - beta[order]);
            if (slack > 0.0) return before_root(b, order, level, start[top], end, across);
            return refine(b, n, start[top], end, guess(b, order, start[top], end, across, tail));
        }
        if (width[top] < NARROW) return slack > 0.0 ? start[top] : -2.0;
        halve(beta, order, stack[top + 1]);
        width[top] *= 0.5;
        width[top + 1] = width[top];
        start[top + 1] = start[top];
        start[top] += width[top];
        top++;
    }
    return -1.0;
}

/* the same by low orders, more of them where the terms shrink slowly */
static double quick_fall(const double *b, int n, double tail, double slack, double until)
{
    const double SLOW = 1e-2; /* the tail in parts of the first terms */
    if (n > LOW && tail > SLOW * (fabs(b[0]) + fabs(b[1]) + fabs(b[2])))
        return fall_by_order(b, n, HIGH, tail_of(b, HIGH, n), slack, until);
    return fall_by_order(b, n, LOW, tail, slack, until);
}

/* powers of h, and a sign, put into the coefficients, by four chains of products; none are missing of the low orders */
static void scale(const double *c, int n, double sign, double h, double *b)
{
    double power[4] = {sign, sign * h, sign * (h * h), sign * (h * h * h)};
    const double stride = (h * h) * (h * h);
    int k = 0;
    for (; k + 3 <= n; k += 4) {
        for (int i = 0; i < 4; i++) {
            b[k + i] = c[k + i] * power[i];
            power[i] *= stride;
        }
    }
    for (int i = 0; k <= n; i++, k++)
        b[k] = c[k] * power[i];
    for (; k <= HIGH; k++)
        b[k] = 0.0;
}

double safe_length(const double *c, int n, double sign, double h, double slack)
{
    double b[POLYNOMIAL_TERMS];
    scale(c, n, sign, h, b);
    const double tail = tail_of(b, LOW, n);
    if (certainly_positive(b, tail, slack)) return h;
    if (!(b[0] > slack)) return 0.0;
    const double fall = quick_fall(b, n, tail, slack, 1.0);
    return fall < 0.0 ? h : h * fall;
}

double fall_until(const double *c, int n, double sign, double h, double until)
{
    double b[POLYNOMIAL_TERMS];
    scale(c, n, sign, h, b);
    const double tail = tail_of(b, LOW, n);
    if (certainly_positive(b, tail, 0.0)) return -1.0;
    if (b[0] <= 0.0) return 0.0;
    const double quick = quick_fall(b, n, tail, 0.0, until / h);
    if (quick != -2.0) return quick < 0.0 ? -1.0 : h * quick;
    /* a stack of intervals still to be searched, the leftmost on top */
    double stack[HALVINGS + 1][POLYNOMIAL_TERMS];
    double start[HALVINGS + 1];
    int depth[HALVINGS + 1], top = 0;
    to_bernstein(b, n, stack[0]);
    start[0] = 0.0;
    depth[0] = 0;
    while (top >= 0) {
        double *beta = stack[top];
        const double width = ldexp(1.0, -depth[top]);
        const int changes = sign_changes(beta, n);
        if (changes == 1 && beta[0] > 0.0)
            return h * refine(b, n, start[top], start[top] + width, start[top] + 0.5 * width);
        if (beta[0] <= 0.0) return h * start[top];
        if (depth[top] >= HALVINGS && changes % 2 == 1) return h * (start[top] + width);
        if (changes == 0 || depth[top] >= HALVINGS) {
            top--;
            continue;
        }
        double left[POLYNOMIAL_TERMS];
        halve(beta, n, left);
        const double from = start[top];
        depth[top]++;
        start[top] = from + 0.5 * width;
        top++;
        for (int i = 0; i <= n; i++)
            stack[top][i] = left[i];
        start[top] = from;
        depth[top] = depth[top - 1];
    }
    return -1.0;
}

double signed_first_fall(const double *c, int n, double sign, double h) { return fall_until(c, n, sign, h, h); }

double first_fall(const double *c, int n, double h) { return signed_first_fall(c, n, 1.0, h); }
