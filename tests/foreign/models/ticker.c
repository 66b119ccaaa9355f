/* no states at all: counts its time events */
#define NX 0
#define NZ 0
#define NP 1
#define PARAMETERS 0.25
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) {}
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->mode[0] += m->t == m->next_time;
    m->next_time = (m->mode[0] + 1) * m->p[0];
    return 0;
}
static void after_step(Model *m) {}
