/* ball.c with the edge of h < 0 as condition: at h = 0 nothing happens, and before the next bounce h must have been
   seen above */
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
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    const int below = m->x[0] < 0.0, edge = below && !m->mode[1];
    m->mode[1] = below;
    if (edge) {
        m->mode[0]++;
        m->x[1] *= -m->p[1];
    }
    return edge;
}
static void after_step(Model *m) {}
