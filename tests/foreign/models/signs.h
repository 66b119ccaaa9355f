/* Motions whose rates depend on the signs of the first two states: indicators are these, modes their signs. */
#include "model.h"

static void indicators(Model *m, double *z)
{
    z[0] = m->x[0];
    z[1] = m->x[1];
}
static int update(Model *m)
{
    m->mode[0] = m->x[0] > 0.0 ? 1 : -1;
    m->mode[1] = m->x[1] > 0.0 ? 1 : -1;
    return 0;
}
static void after_step(Model *m) {}
