#include "dense_output.h"

#include <string.h>

/* the dense output of all methods: r0 + th (r1 + (1 - th) (r2 + th (r3 + (1 - th) (...)))) */
void dense_value(const Master *m, double theta, double *x)
{
    const int n = m->n;
    const double rest = 1.0 - theta;
    const int last = m->dense_terms - 1;
    memcpy(x, m->dense + last * n, (size_t)n * sizeof *x);
    for (int k = last - 1; k >= 0; k--) {
        const double factor = k % 2 == 0 ? theta : rest;
        for (int i = 0; i < n; i++)
            x[i] = m->dense[k * n + i] + factor * x[i];
    }
}
