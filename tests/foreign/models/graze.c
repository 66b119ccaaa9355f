/* x' = 1; the indicator is below zero between x = 0.5 - 5e-7 and 0.5 + 5e-7 only */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 1.0; }
static void indicators(Model *m, double *z) { z[0] = (m->x[0] - 0.5) * (m->x[0] - 0.5) - 2.5e-13; }
static int update(Model *m)
{
    double z;
    indicators(m, &z);
    m->mode[0] += z <= 0.0;
    return 0;
}
static void after_step(Model *m) {}
