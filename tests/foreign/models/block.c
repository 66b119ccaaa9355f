/* a block on a belt: x'' = -x - mu sgn(x' - belt), the sign held between events; no state for sticking */
#define NX 2
#define STARTS 0.0, 0.0
#define PARAMETERS 1.0, 0.5
#include "body.h"

static double acceleration(const Model *m) { return -m->x[0] - m->p[0] * m->mode[0]; }
static void indicators(Model *m, double *z) { z[0] = m->x[1] - m->p[1]; }
static int update(Model *m)
{
    m->mode[0] = m->x[1] > m->p[1] ? 1 : -1;
    return 0;
}
