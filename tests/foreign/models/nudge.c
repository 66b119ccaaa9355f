/* x' = -1, put back a hair's breadth above zero at every event */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -1.0; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    if (m->x[0] > 0.0) return 0;
    m->x[0] = 1e-14;
    m->mode[0]++;
    return 1;
}
static void after_step(Model *m) {}
