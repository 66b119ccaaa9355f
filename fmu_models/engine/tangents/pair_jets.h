/*
 * The recurrences of model/jets.h, differentiated: coefficient k of the variation Y of y = f(a) from the series a and y
 * and the variation A of a, orders 0..k, and 0..k-1 of its own. With y' the series of df/da, Y = y' A; where that is no
 * series at hand, the equation that y solves is differentiated.
 *
 * A capital letter is the variation of what has the small one.
 *
 * Source: Griewank and Walther, Evaluating Derivatives (2008), chapter 13.
 */
#pragma once

#include "pair.h"

#if MODEL_NW > 200
#define PAIR_JET static CALLED
#else
#define PAIR_JET static inline __attribute__((unused))
#endif

/* sum of a[i] B[k-i] over first <= i <= last, in two sums, neither of which waits for the other */
PAIR_JET Pair pair_convolution(const double *a, const Pair *B, int k, int first, int last)
{
    Pair one = PAIR_ZERO;
    Pair two = PAIR_ZERO;
    int i = first;
    for (; i + 1 <= last; i += 2) {
        one += a[i] * B[k - i];
        two += a[i + 1] * B[k - i - 1];
    }
    if (i <= last) one += a[i] * B[k - i];
    return one + two;
}

/* a B */
PAIR_JET Pair pair_product(const double *a, const Pair *B, int k) { return pair_convolution(a, B, k, 0, k); }

/* a B + b A, in four sums */
PAIR_JET Pair pair_both(const double *a, const Pair *A, const double *b, const Pair *B, int k)
{
    Pair one = PAIR_ZERO;
    Pair two = PAIR_ZERO;
    Pair three = PAIR_ZERO;
    Pair four = PAIR_ZERO;
    int i = 0;
    for (; i + 1 <= k; i += 2) {
        one += a[i] * B[k - i];
        two += b[i] * A[k - i];
        three += a[i + 1] * B[k - i - 1];
        four += b[i + 1] * A[k - i - 1];
    }
    if (i <= k) {
        one += a[i] * B[k - i];
        two += b[i] * A[k - i];
    }
    return (one + two) + (three + four);
}

/* a B where B is of order 1, or 2 where the series run in the root of time */
PAIR_JET Pair pair_phase(const double *a, const Pair *B, int k)
{
    return pair_convolution(a, B, k, k < 2 ? 0 : k - 2, k);
}

static inline int pair_is_zero(Pair a) { return a[0] == 0.0 && a[1] == 0.0; }

/* sum of a[i] b[k-i] over 0 <= i <= last, which all directions share */
PAIR_JET double pair_shared(const double *a, const double *b, int k, int last)
{
    double one = 0.0;
    double two = 0.0;
    int i = 0;
    for (; i + 1 <= last; i += 2) {
        one += a[i] * b[k - i];
        two += a[i + 1] * b[k - i - 1];
    }
    if (i <= last) one += a[i] * b[k - i];
    return one + two;
}

/* y = 1/(b0 + b1 b): Y = -y^2 (B0 + b1 B + B1 b), B0 and B1 only where `moved`; y2: y^2 in every direction, of which
   coefficient k is set */
PAIR_JET Pair pair_reciprocal(int moved, Pair B0, double b1, Pair B1, const double *b, const Pair *B, const double *y,
                              Pair *y2, int k)
{
    double square = 2.0 * pair_shared(y, y, k, ((k + 1) >> 1) - 1);
    if (k % 2 == 0) square += y[k >> 1] * y[k >> 1];
    y2[k] = (Pair){square, square};
    Pair one = PAIR_ZERO;
    Pair two = PAIR_ZERO;
    int i = 0;
    for (; i + 1 <= k; i += 2) {
        one += y2[i] * B[k - i];
        two += y2[i + 1] * B[k - i - 1];
    }
    if (i <= k) one += y2[i] * B[k - i];
    Pair rest = b1 * (one + two);
    if (moved) rest += B0 * y2[k];
    if (moved && !pair_is_zero(B1)) rest += B1 * pair_product(b, y2, k);
    return -rest;
}

/* y = q/(b0 + b1 b): (b0 + b1 b) y = q, of which Q is coefficient k */
PAIR_JET Pair pair_quotient(Pair Q, double b0, Pair B0, double b1, Pair B1, const double *b, const Pair *B,
                            const double *y, const Pair *Y, int k)
{
    Pair one = y[0] * B[k];
    Pair two = PAIR_ZERO;
    for (int i = 1; i <= k; i++) {
        one += y[i] * B[k - i];
        two += b[i] * Y[k - i];
    }
    Pair rest = Q - b1 * (one + two);
    if (!pair_is_zero(B0)) rest -= B0 * y[k];
    if (!pair_is_zero(B1)) rest -= B1 * pair_shared(y, b, k, k);
    return rest / (b0 + b1 * b[0]);
}

/* y = sqrt(a): 2 y Y = A */
PAIR_JET Pair pair_sqrt(const Pair *A, const double *y, const Pair *Y, int k)
{
    return (A[k] - 2.0 * pair_convolution(y, Y, k, 1, k)) / (2.0 * y[0]);
}

/* the same where a may begin with zeros, as jet_root has it */
PAIR_JET Pair pair_root(const double *a, const Pair *A, const double *y, const Pair *Y, int k)
{
    if (a[0] > 0.0) return pair_sqrt(A, y, Y, k);
    if (k == 0 || a[0] < 0.0) return PAIR_ZERO;
    if (a[1] == 0.0) return (A[k + 1] - 2.0 * pair_convolution(y, Y, k + 1, 2, k)) / (2.0 * y[1]);
    return k == 1 ? PAIR_ZERO : (Pair){NAN, NAN};
}

/* time reduced by whole turns has the derivatives of time */
PAIR_JET Pair pair_angle(double rate, Pair Rate, Pair Offset, const double *t, const Pair *T, double rest, int k)
{
    const Pair moved = rate * T[k] + Rate * t[k];
    return k == 0 ? moved + Rate * rest + Offset : moved;
}

PAIR_JET Pair pair_turns(double frequency, Pair Frequency, Pair Offset, const double *t, const Pair *T, double rest,
                         int k)
{
    const double turn = 6.283185307179586;
    return pair_angle(turn * frequency, turn * Frequency, Offset, t, T, rest, k);
}

/* y = a^e: k a[0] y[k] = sum of ((e + 1) i - k) a[i] y[k-i] over 1 <= i <= k */
PAIR_JET Pair pair_power(const double *a, const Pair *A, double e, Pair E, const double *y, const Pair *Y, int k)
{
    if (k == 0) {
        const Pair moved = e * pow(a[0], e - 1.0) * A[0];
        return pair_is_zero(E) ? moved : moved + E * (y[0] * log(a[0]));
    }
    Pair sum = -k * y[k] * A[0];
    double by_exponent = 0.0;
    for (int i = 1; i <= k; i++) {
        sum += ((e + 1.0) * i - k) * (y[k - i] * A[i] + a[i] * Y[k - i]);
        by_exponent += i * a[i] * y[k - i];
    }
    return (sum + by_exponent * E) / (k * a[0]);
}

/* y = a^e, e > 1, where a may begin with zeros, which the series of the motion shows to beyond k: Y = e a^(e - 1) A */
PAIR_JET Pair pair_lifted(const double *a, const Pair *A, double e, const double *y, const Pair *Y, int k)
{
    Pair sum = PAIR_ZERO;
    double q[MODEL_TERMS + 1];
    int n = 1;
    if (a[0] > 0.0) return pair_power(a, A, e, PAIR_ZERO, y, Y, k);
    while (n < MODEL_MAX_ORDER && a[n] == 0.0)
        n++;
    const double first = (e - 1.0) * n;
    if (a[0] < 0.0 || k < first || first != floor(first)) return PAIR_ZERO;
    for (int i = 0; i <= k - (int)first && n + i <= MODEL_MAX_ORDER; i++) {
        q[i] = i == 0 ? pow(a[n], e - 1.0) : 0.0;
        for (int m = 1; m <= i; m++)
            q[i] += (e * m - i) * a[n + m] * q[i - m] / (i * a[n]);
        sum += e * q[i] * A[k - (int)first - i];
    }
    return sum;
}

/* y = log(a): a Y = A */
PAIR_JET Pair pair_log(const double *a, const Pair *A, const Pair *Y, int k)
{
    return (A[k] - pair_convolution(a, Y, k, 1, k)) / a[0];
}

/* y = atan(a), a2 = a a: (1 + a2) Y = A */
PAIR_JET Pair pair_atan(const Pair *A, const double *a2, const Pair *Y, int k)
{
    return (A[k] - pair_convolution(a2, Y, k, 1, k)) / (1.0 + a2[0]);
}

#undef PAIR_JET

/* order k of X with M X = B - dM x from that of B, which is in its place (model/mass_matrix.h) */
static inline __attribute__((unused)) void pair_mass_solve(const InertiaSeries *M, const InertiaPairs *dM,
                                                           const double *factor, const double *x, Pair *X, int stride,
                                                           int k)
{
#define MASS_PLACE(i, c) (model_mass_row[i] + (c))
    for (int i = 0; i < MODEL_NV; i++) {
        for (int c = model_mass_first[i]; c <= i; c++) {
            const int place = MASS_PLACE(i, c);
            const int last = model_mass_moves[place] ? k : 0; /* order of the entry and its variation */
            for (int m = 0; m <= last; m++) {
                X[i * stride + k] -= dM[place][m] * x[c * stride + k - m];
                if (c < i) X[c * stride + k] -= dM[place][m] * x[i * stride + k - m];
            }
            if (last > 0) {
                X[i * stride + k] -= pair_convolution(M[place], X + c * stride, k, 1, k);
                if (c < i) X[c * stride + k] -= pair_convolution(M[place], X + i * stride, k, 1, k);
            }
        }
    }
    for (int i = 0; i < MODEL_NV; i++)
        for (int c = model_mass_first[i]; c < i; c++)
            X[i * stride + k] -= factor[MASS_PLACE(i, c)] * X[c * stride + k];
    for (int i = 0; i < MODEL_NV; i++)
        X[i * stride + k] *= factor[MASS_PLACE(i, i)];
    for (int i = MODEL_NV - 1; i >= 0; i--)
        for (int c = model_mass_first[i]; c < i; c++)
            X[c * stride + k] -= factor[MASS_PLACE(i, c)] * X[i * stride + k];
#undef MASS_PLACE
}
