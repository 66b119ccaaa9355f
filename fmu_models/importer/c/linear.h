/* Real and complex linear systems, n x n by rows. */
#pragma once

#include <complex.h>

/* a becomes its factors, rows exchanged as pivot says; 0 if it is singular */
int linear_real_factor(double *a, int n, int *pivot);
int linear_complex_factor(double complex *a, int n, int *pivot);
/* b becomes the solution */
void linear_real_solve(const double *a, int n, const int *pivot, double *b);
void linear_complex_solve(const double complex *a, int n, const int *pivot, double complex *b);
