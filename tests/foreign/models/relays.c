/* x_i' = -sgn(x_i), five of them */
#define NX 5
#define NZ 5
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0, 2.0, 3.0, 4.0, 5.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    for (int i = 0; i < NX; i++)
        dx[i] = -m->mode[i];
}
static void indicators(Model *m, double *z) { memcpy(z, m->x, NX * sizeof *z); }
static int update(Model *m)
{
    for (int i = 0; i < NX; i++)
        m->mode[i] = m->x[i] > 0.0 ? 1 : -1;
    return 0;
}
static void after_step(Model *m) {}
