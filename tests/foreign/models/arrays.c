/* x' = A x + u, FMI 3: states, matrix and inputs are arrays; counts updates in one of whole numbers, which an enumeration
   halves */
#define NX 2
#define NZ 0
#define NP 6
#define PARAMETERS 0.0, 1.0, -4.0, 0.0, 0.0, 0.0
#define STARTS 1.0, 0.0
#define CO_SIMULATION
#define SIZE(v) ((v) == 1 || (v) == 101 || (v) == 205 ? 2u : (v) == 201 ? 4u : (v) == 401 ? 3u : 1u)
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    const double *a = m->p;
    dx[0] = a[0] * m->x[0] + a[1] * m->x[1] + m->p[4];
    dx[1] = a[2] * m->x[0] + a[3] * m->x[1] + m->p[5];
}
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    for (int i = 0; i < 3; i++)
        m->mode[i] += i + 1;
    return 0;
}
static void after_step(Model *m) {}
/* by many small steps of the midpoint rule */
static int do_step(Model *m, double end)
{
    const double h = (end - m->t) / 2000;
    double dx[2], x[2];
    for (int k = 0; k < 2000; k++) {
        memcpy(x, m->x, sizeof x);
        derivatives(m, dx);
        for (int i = 0; i < 2; i++)
            m->x[i] = x[i] + 0.5 * h * dx[i];
        derivatives(m, dx);
        for (int i = 0; i < 2; i++)
            m->x[i] = x[i] + h * dx[i];
    }
    m->t = end;
    return 0;
}
fmi3Status fmi3GetInt64(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Int64 *values, size_t m)
{
    *values = ((Model *)c)->mode[2] / 2;
    return fmi3OK;
}
