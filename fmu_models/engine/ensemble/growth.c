/*
 * Growth of the differences that tangents carry: Gram and Schmidt's method, twice, so that what is left of a vector
 * beside those before it is at right angles to them to rounding.
 *
 * Source: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980).
 */
#include "growth.h"

#include <math.h>

#include "lane_stepper.h"

double growth_product(const double *a, const double *b, int length)
{
    double sum = 0.0;
    for (int i = 0; i < length; i++)
        sum += a[i] * b[i];
    return sum;
}

double growth_norm(const double *v, int n) { return sqrt(growth_product(v, v, n)); }

/* take out of v what lies along the k vectors before it, a distance apart */
static void growth_beside(double *v, const double *before, int k, int apart, int length)
{
    for (int j = 0; j < k; j++) {
        const double *u = before + (long)j * apart;
        const double along = growth_product(u, v, length);
        for (int i = 0; i < length; i++)
            v[i] -= along * u[i];
    }
}

void growth_orthonormalize(double *vectors, int n, int apart, int length, int losing, double *growth)
{
    const double least = losing ? GROWTH_TAKEN : GROWTH_ROUNDING;
    double largest = 1.0; /* they came in as unit vectors */
    for (int k = 0; k < n; k++) {
        double *v = vectors + (long)k * apart;
        const double whole = growth_norm(v, length);
        largest = fmax(largest, whole);
        growth_beside(v, vectors, k, apart, length);
        growth_beside(v, vectors, k, apart, length);
        const double size = growth_norm(v, length);
        const int lost = !(size > 0.0) || (k > 0 && size <= least * whole) || (losing && size <= least * largest);
        growth[k] *= lost ? 0.0 : size;
        for (int i = 0; i < length; i++)
            v[i] = lost ? 0.0 : v[i] / size;
    }
}
