/* Systems of equations by factors with row exchange; dense, for an FMU tells its Jacobian by columns and no pattern is
   sure. */
#include "linear.h"

#include <math.h>

#if defined(__clang__) || !defined(__GNUC__) /* gcc does not know it */
#pragma STDC CX_LIMITED_RANGE ON
#endif

static double real_size(double a) { return fabs(a); }
static double complex_size(double complex a) { return fabs(creal(a)) + fabs(cimag(a)); }

#define LINEAR(kind, Number)                                                                                           \
    int linear_##kind##_factor(Number *a, int n, int *pivot)                                                           \
    {                                                                                                                  \
        for (int k = 0; k < n; k++) {                                                                                  \
            int best = k;                                                                                              \
            for (int i = k + 1; i < n; i++)                                                                            \
                best = kind##_size(a[i * n + k]) > kind##_size(a[best * n + k]) ? i : best;                            \
            pivot[k] = best;                                                                                           \
            if (!(kind##_size(a[best * n + k]) > 0.0)) return 0;                                                       \
            for (int j = 0; j < n && best != k; j++) {                                                                 \
                const Number swapped = a[k * n + j];                                                                   \
                a[k * n + j] = a[best * n + j];                                                                        \
                a[best * n + j] = swapped;                                                                             \
            }                                                                                                          \
            const Number inverse = 1.0 / a[k * n + k];                                                                 \
            for (int i = k + 1; i < n; i++) {                                                                          \
                const Number factor = a[i * n + k] *= inverse;                                                         \
                if (factor != 0.0)                                                                                     \
                    for (int j = k + 1; j < n; j++)                                                                    \
                        a[i * n + j] -= factor * a[k * n + j];                                                         \
            }                                                                                                          \
        }                                                                                                              \
        return 1;                                                                                                      \
    }                                                                                                                  \
                                                                                                                       \
    void linear_##kind##_solve(const Number *a, int n, const int *pivot, Number *b)                                    \
    {                                                                                                                  \
        for (int k = 0; k < n; k++) {                                                                                  \
            const Number swapped = b[pivot[k]];                                                                        \
            b[pivot[k]] = b[k];                                                                                        \
            b[k] = swapped;                                                                                            \
        }                                                                                                              \
        for (int k = 0; k < n; k++)                                                                                    \
            for (int j = 0; j < k; j++)                                                                                \
                b[k] -= a[k * n + j] * b[j];                                                                           \
        for (int k = n - 1; k >= 0; k--) {                                                                             \
            for (int j = k + 1; j < n; j++)                                                                            \
                b[k] -= a[k * n + j] * b[j];                                                                           \
            b[k] /= a[k * n + k];                                                                                      \
        }                                                                                                              \
    }

LINEAR(real, double)
LINEAR(complex, double complex)
