/* r' = -sgn(r^2 - 1) r, phi' = omega, in x and y: slides on the unit circle */
#define NX 2
#define NZ 1
#define NP 1
#define PARAMETERS 2.0
#define STARTS 2.0, 0.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = -m->mode[0] * m->x[0] - m->p[0] * m->x[1];
    dx[1] = -m->mode[0] * m->x[1] + m->p[0] * m->x[0];
}
static void indicators(Model *m, double *z) { z[0] = m->x[0] * m->x[0] + m->x[1] * m->x[1] - 1.0; }
static int update(Model *m)
{
    double z;
    indicators(m, &z);
    m->mode[0] = z > 0.0 ? 1 : -1;
    return 0;
}
static void after_step(Model *m) {}
