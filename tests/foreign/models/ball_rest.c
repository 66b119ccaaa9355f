/* ball.c that comes to rest: a speed below 0.1 m/s after a bounce becomes none, and gravity with it */
#define NX 2
#define NZ 1
#define NP 2
#define PARAMETERS 9.81, 0.7
#define STARTS 1.0, 0.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = m->x[1];
    dx[1] = -m->p[0];
}
static void indicators(Model *m, double *z) { z[0] = m->x[0] == 0.0 && m->x[1] == 0.0 ? 1.0 : m->x[0]; }
static int update(Model *m)
{
    if (m->x[0] > 0.0) return 0;
    m->mode[0]++;
    m->x[0] = 0.0;
    m->x[1] = fabs(m->p[1] * m->x[1]);
    if (m->x[1] < 0.1) m->x[1] = m->p[0] = 0.0;
    return 1;
}
static void after_step(Model *m) {}
