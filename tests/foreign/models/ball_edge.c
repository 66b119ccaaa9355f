/* ball.c with the edge of h < 0 as condition: at h = 0 nothing happens, and before the next bounce h must have been
   seen above */
#include "body.h"

static double acceleration(const Model *m) { return -m->p[0]; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    const int below = m->x[0] < 0.0, edge = below && !m->mode[1];
    m->mode[1] = below;
    return edge ? bounce(m) : 0;
}
