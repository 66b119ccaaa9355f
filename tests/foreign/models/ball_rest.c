/* ball.c that comes to rest: a speed below 0.1 m/s after a bounce becomes none, and gravity with it */
#include "body.h"

static double acceleration(const Model *m) { return -m->p[0]; }
static void indicators(Model *m, double *z) { z[0] = m->x[0] == 0.0 && m->x[1] == 0.0 ? 1.0 : m->x[0]; }
static int update(Model *m)
{
    if (m->x[0] > 0.0) return 0;
    bounce(m);
    m->x[0] = 0.0;
    m->x[1] = fabs(m->x[1]);
    if (m->x[1] < 0.1) m->x[1] = m->p[0] = 0.0;
    return 1;
}
