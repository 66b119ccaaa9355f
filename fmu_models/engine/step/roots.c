/*
 * First fall of a polynomial to zero, found for certain: Bernstein coefficients bound the polynomial on an
 * interval, their sign changes bound the number of its roots (Descartes), bisection separates the roots.
 *
 *     first_fall(c, n, h): the smallest s in (0, h] with c(s) <= 0 and c > 0 before, or -1
 *         nothing to do if the sum of the positive lower bounds of the terms is positive
 *         the low orders, whose tail is bounded by the sum of its terms, mostly decide at a fraction of the cost:
 *             above the tail            -> no root here
 *             falling faster than it    -> at most one root: bracket if the end is not positive, else none here
 *             otherwise                 -> halve; after a few halvings leave it to the whole polynomial:
 *         intervals, left first:
 *             no sign change            -> no root here
 *             one change, + to -        -> bracket, refine by Newton kept inside the bracket
 *             narrower than resolution  -> the polynomial touches zero without being seen to cross: no fall
 *             otherwise                 -> halve (de Casteljau)
 */
#include "roots.h"

#include <float.h>
#include <math.h>

enum { HALVINGS = 50, QUICK_HALVINGS = 6 };

/* value and slope at s, by Horner */
static double value_and_slope(const double *c, int n, double s, double *slope)
{
    double value = c[n];
    double derivative = 0.0;
    for (int k = n - 1; k >= 0; k--) {
        derivative = derivative * s + value;
        value = value * s + c[k];
    }
    *slope = derivative;
    return value;
}

double polynomial_value(const double *c, int n, double s)
{
    double value = c[n];
    for (int k = n - 1; k >= 0; k--) {
        value = value * s + c[k];
    }
    return value;
}

/* the root in a bracket with c(low) > 0 >= c(high), from a first guess */
static double refine(const double *c, int n, double low, double high, double s)
{
    const double NONE =
        1e-30; /* so that no step promises anything of the next, and no flag of a division by zero is left behind */
    double step_before = NONE;
    for (int i = 0; i < 100; i++) {
        double slope;
        const double value = value_and_slope(c, n, s, &slope);
        if (value > 0.0) {
            low = s;
        } else {
            high = s;
        }
        double next = s - value / slope;
        int newton = 1;
        if (!(next > low && next < high)) {
            next = 0.5 * (low + high);
            newton = 0;
        }
        const double step = fabs(next - s);
        /* Newton's steps shrink as step = factor * step_before^2: the next would be this long */
        const double following = newton ? step * (step / step_before) * (step / step_before) : step;
        if (step <= DBL_EPSILON * s || following <= 0.1 * DBL_EPSILON * s) {
            return next;
        }
        step_before = newton ? step : NONE;
        s = next;
    }
    return high;
}

/* a few steps of Newton's method towards the root in a bracket */
static double guess(const double *c, int n, double low, double high)
{
    double s = 0.5 * (low + high);
    for (int i = 0; i < 4; i++) {
        double slope;
        const double value = value_and_slope(c, n, s, &slope);
        const double next = s - value / slope;
        s = next > low && next < high ? next : 0.5 * (low + high);
    }
    return s;
}

/* Bernstein coefficients on [0, 1] of the polynomial with power coefficients b */
static void to_bernstein(const double *b, int n, double *beta)
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
    for (int k = 1; k <= n; k++) {
        for (int i = n; i >= k; i--) {
            beta[i] += beta[i - 1];
        }
    }
}

/* halves at the middle: beta becomes the right half, left gets the left one */
static void halve(double *beta, int n, double *left)
{
    left[0] = beta[0];
    for (int k = 1; k <= n; k++) {
        for (int i = 0; i <= n - k; i++) {
            beta[i] = 0.5 * (beta[i] + beta[i + 1]);
        }
        left[k] = beta[0];
    }
}

/* sign changes, a zero counted as negative: a touch at the very end of an interval is a fall */
static int sign_changes(const double *beta, int n)
{
    int changes = 0;
    for (int i = 1; i <= n; i++) {
        changes += (beta[i] > 0.0) != (beta[i - 1] > 0.0);
    }
    return changes;
}

static int certainly_positive(const double *b, int n)
{
    double bound = b[0];
    for (int k = 1; k <= n; k++) {
        bound += b[k] < 0.0 ? b[k] : 0.0;
    }
    return bound > 0.0;
}

/* least and largest of the Bernstein coefficients, or of their differences from one to the next */
static void bounds(const double *beta, int n, int differences, double *least, double *largest)
{
    *least = INFINITY;
    *largest = -INFINITY;
    for (int i = 0; i + differences <= n; i++) {
        const double value = differences ? beta[i + 1] - beta[i] : beta[i];
        *least = value < *least ? value : *least;
        *largest = value > *largest ? value : *largest;
    }
}

/* the order from which the terms of b, b[0] > 0, are small beside it: sums of their magnitudes, of themselves and of
   their slopes */
static int low_order(const double *b, int n, double *tail, double *slopes)
{
    const double SMALL = 1e-3;
    int order = n;
    *tail = 0.0;
    *slopes = 0.0;
    while (order > 1 && *tail + fabs(b[order]) <= SMALL * b[0]) {
        *tail += fabs(b[order]);
        *slopes += order * fabs(b[order]);
        order--;
    }
    return order;
}

/* a point before the root of b - slack in an interval on which b falls, near it; b is positive there */
static double before_root(const double *b, int n, double slack, double low, double high)
{
    const double NEAR = 1e-3;
    double s = 0.5 * (low + high);
    for (int i = 0; i < 6; i++) {
        double slope;
        const double value = value_and_slope(b, n, s, &slope) - slack;
        double next = s - value / slope;
        next = next > low && next < high ? next : value > 0.0 ? 0.5 * (s + high) : 0.5 * (low + s);
        if (value > 0.0 && next - s <= NEAR * s) {
            return s;
        }
        /* from beyond the root Newton's method on a falling arc stays there */
        s = value > 0.0 ? next : fmax(low, next - NEAR * next);
    }
    return polynomial_value(b, n, s) > slack ? s : low;
}

/*
 * first_fall on [0, 1] in units of it, by the low orders; -2 where they do not decide. With slack > 0 a point near and
 * before the first place at which b falls below slack.
 */
static double quick_fall(const double *b, int n, double slack)
{
    const double NARROW = 1.5 / (1 << QUICK_HALVINGS);
    double stack[QUICK_HALVINGS + 1][POLYNOMIAL_TERMS];
    double start[QUICK_HALVINGS + 1], width[QUICK_HALVINGS + 1];
    double tail, slopes;
    const int order = low_order(b, n, &tail, &slopes);
    int top = 0;
    to_bernstein(b, order, stack[0]);
    start[0] = 0.0;
    width[0] = 1.0;
    while (top >= 0) {
        double *beta = stack[top];
        double least, largest, steepest, flattest;
        bounds(beta, order, 0, &least, &largest);
        if (least > tail + slack) {
            top--;
            continue;
        }
        bounds(beta, order, 1, &steepest, &flattest);
        const double end = start[top] + width[top];
        if (flattest * order < -slopes * width[top]) {
            if (!(polynomial_value(b, n, end) <= slack)) {
                top--;
                continue;
            }
            if (slack > 0.0) {
                return before_root(b, n, slack, start[top], end);
            }
            return refine(b, n, start[top], end, guess(b, order, start[top], end));
        }
        if (width[top] < NARROW) {
            return slack > 0.0 ? start[top] : -2.0;
        }
        halve(beta, order, stack[top + 1]);
        width[top] *= 0.5;
        width[top + 1] = width[top];
        start[top + 1] = start[top];
        start[top] += width[top];
        top++;
    }
    return -1.0;
}

/* powers of h put into the coefficients */
static void scale(const double *c, int n, double h, double *b)
{
    double power = h;
    b[0] = c[0];
    for (int k = 1; k <= n; k++) {
        b[k] = c[k] * power;
        power *= h;
    }
}

double safe_length(const double *c, int n, double h, double slack)
{
    double b[POLYNOMIAL_TERMS];
    scale(c, n, h, b);
    if (!(b[0] > slack)) {
        return 0.0;
    }
    const double fall = quick_fall(b, n, slack);
    return fall < 0.0 ? h : h * fall;
}

double first_fall(const double *c, int n, double h)
{
    double b[POLYNOMIAL_TERMS];
    scale(c, n, h, b);
    if (certainly_positive(b, n)) {
        return -1.0;
    }
    if (b[0] <= 0.0) {
        return 0.0;
    }
    const double quick = quick_fall(b, n, 0.0);
    if (quick != -2.0) {
        return quick < 0.0 ? -1.0 : h * quick;
    }
    /* a stack of intervals still to be searched, the leftmost on top */
    double stack[HALVINGS + 1][POLYNOMIAL_TERMS];
    double start[HALVINGS + 1];
    int depth[HALVINGS + 1];
    int top = 0;
    to_bernstein(b, n, stack[0]);
    start[0] = 0.0;
    depth[0] = 0;
    while (top >= 0) {
        double *beta = stack[top];
        const double width = ldexp(1.0, -depth[top]);
        const int changes = sign_changes(beta, n);
        if (changes == 1 && beta[0] > 0.0) {
            return h * refine(b, n, start[top], start[top] + width, start[top] + 0.5 * width);
        }
        if (beta[0] <= 0.0) {
            return h * start[top];
        }
        if (depth[top] >= HALVINGS && changes % 2 == 1) {
            return h * (start[top] + width);
        }
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
        for (int i = 0; i <= n; i++) {
            stack[top][i] = left[i];
        }
        start[top] = from;
        depth[top] = depth[top - 1];
    }
    return -1.0;
}
