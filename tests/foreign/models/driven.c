/* x' = u + step; counts its events */
#define NX 1
#define NZ 0
#define NP 2
#define PARAMETERS 0.0, 0.0
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->p[0] + m->p[1]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->mode[0]++;
    return 0;
}
static void after_step(Model *m) {}
