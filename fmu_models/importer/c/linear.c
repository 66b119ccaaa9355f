/* Systems of equations by factors with row exchange. */
#include "linear.h"

#include <math.h>

Band linear_band(int n, int lower, int upper)
{
    const int64_t width = 2 * (int64_t)lower + upper + 1;
    return (Band){n, lower, upper, width < n ? (int)width : n};
}

static int least(int64_t a, int64_t b) { return (int)(a < b ? a : b); }
static double real_size(double a) { return fabs(a); }
static double complex_size(double complex a) { return fabs(creal(a)) + fabs(cimag(a)); }

#define LINEAR(kind, Number)                                                                                           \
    int linear_##kind##_factor(Number *a, Band band, int *pivot)                                                       \
    {                                                                                                                  \
        const int n = band.n;                                                                                          \
        for (int k = 0; k < n; k++) {                                                                                  \
            const int below = least(n, (int64_t)k + band.lower + 1);                                                   \
            const int right = least(n, (int64_t)k + band.lower + band.upper + 1);                                      \
            Number *row = a + linear_row(&band, k);                                                                    \
            int best = k;                                                                                              \
            for (int i = k + 1; i < below; i++)                                                                        \
                if (kind##_size(a[linear_row(&band, i) + k]) > kind##_size(a[linear_row(&band, best) + k])) best = i;  \
            pivot[k] = best;                                                                                           \
            Number *other = a + linear_row(&band, best);                                                               \
            if (!(kind##_size(other[k]) > 0.0)) return 0;                                                              \
            for (int j = k; j < right && best != k; j++) {                                                             \
                const Number swapped = row[j];                                                                         \
                row[j] = other[j];                                                                                     \
                other[j] = swapped;                                                                                    \
            }                                                                                                          \
            const Number inverse = 1.0 / row[k];                                                                       \
            for (int i = k + 1; i < below; i++) {                                                                      \
                Number *lower = a + linear_row(&band, i);                                                              \
                const Number factor = lower[k] *= inverse;                                                             \
                if (factor != 0.0)                                                                                     \
                    for (int j = k + 1; j < right; j++)                                                                \
                        lower[j] -= factor * row[j];                                                                   \
            }                                                                                                          \
        }                                                                                                              \
        return 1;                                                                                                      \
    }                                                                                                                  \
                                                                                                                       \
    void linear_##kind##_solve(const Number *a, Band band, const int *pivot, Number *b)                                \
    {                                                                                                                  \
        const int n = band.n;                                                                                          \
        for (int k = 0; k < n; k++) {                                                                                  \
            const int below = least(n, (int64_t)k + band.lower + 1);                                                   \
            const Number swapped = b[pivot[k]];                                                                        \
            b[pivot[k]] = b[k];                                                                                        \
            b[k] = swapped;                                                                                            \
            for (int i = k + 1; i < below; i++)                                                                        \
                b[i] -= a[linear_row(&band, i) + k] * swapped;                                                         \
        }                                                                                                              \
        for (int k = n - 1; k >= 0; k--) {                                                                             \
            const int right = least(n, (int64_t)k + band.lower + band.upper + 1);                                      \
            const Number *row = a + linear_row(&band, k);                                                              \
            for (int j = k + 1; j < right; j++)                                                                        \
                b[k] -= row[j] * b[j];                                                                                 \
            b[k] /= row[k];                                                                                            \
        }                                                                                                              \
    }

LINEAR(real, double)
LINEAR(complex, double complex)
