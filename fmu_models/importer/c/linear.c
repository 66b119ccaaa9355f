/* Systems of equations by factors with row exchange; dense, for an FMU tells its Jacobian by columns and no pattern is
   sure. */
#include "linear.h"

#include <math.h>

int linear_real_factor(double *a, int n, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            best = fabs(a[i * n + k]) > fabs(a[best * n + k]) ? i : best;
        pivot[k] = best;
        if (!(fabs(a[best * n + k]) > 0.0)) return 0;
        for (int j = 0; j < n && best != k; j++) {
            const double swapped = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = swapped;
        }
        const double inverse = 1.0 / a[k * n + k];
        for (int i = k + 1; i < n; i++) {
            const double factor = a[i * n + k] *= inverse;
            if (factor != 0.0)
                for (int j = k + 1; j < n; j++)
                    a[i * n + j] -= factor * a[k * n + j];
        }
    }
    return 1;
}

void linear_real_solve(const double *a, int n, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++) {
        const double swapped = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = swapped;
    }
    for (int k = 0; k < n; k++)
        for (int j = 0; j < k; j++)
            b[k] -= a[k * n + j] * b[j];
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            b[k] -= a[k * n + j] * b[j];
        b[k] /= a[k * n + k];
    }
}

/* complex numbers as pairs: c -= a b */
static void subtract_product(double *c, const double *a, const double *b)
{
    const double real = a[0] * b[0] - a[1] * b[1];
    c[1] -= a[0] * b[1] + a[1] * b[0];
    c[0] -= real;
}

static void divide(double *a, const double *b)
{
    const double size = b[0] * b[0] + b[1] * b[1];
    const double real = (a[0] * b[0] + a[1] * b[1]) / size;
    a[1] = (a[1] * b[0] - a[0] * b[1]) / size;
    a[0] = real;
}

static void exchange(double *a, double *b)
{
    for (int part = 0; part < 2; part++) {
        const double swapped = a[part];
        a[part] = b[part];
        b[part] = swapped;
    }
}

int linear_complex_factor(double *a, int n, int *pivot)
{
    for (int k = 0; k < n; k++) {
        int best = k;
        double largest = -1.0;
        for (int i = k; i < n; i++) {
            const double *entry = a + 2 * (i * n + k);
            const double size = fabs(entry[0]) + fabs(entry[1]);
            best = size > largest ? i : best;
            largest = fmax(size, largest);
        }
        pivot[k] = best;
        if (!(largest > 0.0)) return 0;
        for (int j = 0; j < n && best != k; j++)
            exchange(a + 2 * (k * n + j), a + 2 * (best * n + j));
        for (int i = k + 1; i < n; i++) {
            double *factor = a + 2 * (i * n + k);
            divide(factor, a + 2 * (k * n + k));
            for (int j = k + 1; j < n; j++)
                subtract_product(a + 2 * (i * n + j), factor, a + 2 * (k * n + j));
        }
    }
    return 1;
}

void linear_complex_solve(const double *a, int n, const int *pivot, double *b)
{
    for (int k = 0; k < n; k++)
        exchange(b + 2 * k, b + 2 * pivot[k]);
    for (int k = 0; k < n; k++)
        for (int j = 0; j < k; j++)
            subtract_product(b + 2 * k, a + 2 * (k * n + j), b + 2 * j);
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++)
            subtract_product(b + 2 * k, a + 2 * (k * n + j), b + 2 * j);
        divide(b + 2 * k, a + 2 * (k * n + k));
    }
}
