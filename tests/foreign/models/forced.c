/* x'' + 2 d x' + x = f cos(omega t) */
#define NX 2
#define NZ 0
#define NP 3
#define PARAMETERS 0.1, 0.5, 1.3
#define STARTS 1.0, 0.0
#define JACOBIAN
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = m->x[1];
    dx[1] = m->p[1] * cos(m->p[2] * m->t) - 2.0 * m->p[0] * m->x[1] - m->x[0];
}
static void jacobian(Model *m, const double *seed, double *dx)
{
    dx[0] = seed[1];
    dx[1] = -seed[0] - 2.0 * m->p[0] * seed[1];
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
