/* x' = -sgn(x); y' = -1, put up a little at zero again and again: no motion along both */
#define NX 2
#define NZ 2
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0, 2.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = -m->mode[0];
    dx[1] = -1.0;
}
static void indicators(Model *m, double *z)
{
    z[0] = m->x[0];
    z[1] = m->x[1];
}
static int update(Model *m)
{
    m->mode[0] = m->x[0] > 0.0 ? 1 : -1;
    if (m->x[1] > 0.0) return 0;
    m->x[1] = 1e-13;
    m->mode[1]++;
    return 1;
}
static void after_step(Model *m) {}
