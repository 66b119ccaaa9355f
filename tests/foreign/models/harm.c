/* Co-Simulation, FMI 2: x' = u; a step that goes beyond t = 0.5 is refused (harm = 0) or kills its process (1) */
#define NX 1
#define NZ 0
#define NP 2
#define PARAMETERS 0.0, 0.0
#define STARTS 0.0
#define CO_SIMULATION
#define SAVES 1
#define REFUSES(m, end) ((end) > 0.5 && (m)->p[1] == 0.0)
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->p[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    if (end > 0.5 && m->p[1] == 1.0) *(volatile int *)0 = 1;
    m->x[0] += m->p[0] * (end - m->t);
    m->t = end;
    return 0;
}
