/* x' = 1; after its time event it says that the next one is at no number */
#define NX 1
#define NZ 0
#define NP 1
#define PARAMETERS 0.5
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 1.0; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->next_time = m->t < m->p[0] ? m->p[0] : NAN;
    return 0;
}
static void after_step(Model *m) {}
