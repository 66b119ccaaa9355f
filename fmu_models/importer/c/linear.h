/*
 * Real and complex linear systems whose matrix has a band: row i is zero but from column i - lower to column i + upper.
 * A row is stored from its first column on with room for what row exchange fills in; a band as wide as the matrix is the
 * n x n matrix by rows.
 */
#pragma once

#include <complex.h>
#include <stdint.h>

#if defined(__clang__) || !defined(__GNUC__) /* gcc does not know it */
#pragma STDC CX_LIMITED_RANGE ON
#endif

typedef struct {
    int n, lower, upper;
    int width; /* of a stored row */
} Band;

Band linear_band(int n, int lower, int upper);
static inline Band linear_dense(int n) { return linear_band(n, n - 1, n - 1); }

/* where column 0 of a row would be stored */
static inline int64_t linear_row(const Band *b, int i)
{
    const int first = i - b->lower, last = b->n - b->width;
    return (int64_t)i * b->width - (first < 0 ? 0 : first < last ? first : last);
}

/* a becomes its factors, rows exchanged as pivot says; 0 if it is singular */
int linear_real_factor(double *a, Band band, int *pivot);
int linear_complex_factor(double complex *a, Band band, int *pivot);
/* b becomes the solution */
void linear_real_solve(const double *a, Band band, const int *pivot, double *b);
void linear_complex_solve(const double complex *a, Band band, const int *pivot, double complex *b);
