/* Co-Simulation: x' = 1; a step that goes beyond t = 0.75 is discarded there */
#define NX 1
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 0.0
#define CO_SIMULATION
#define DISCARDS(m) ((m)->mode[0])
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 1.0; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    const double reached = fmin(end, 0.75);
    m->mode[0] = end > reached;
    m->x[0] += reached - m->t;
    m->t = reached;
    return 0;
}
