/* x' = 1; from its time event on the next one is a rounding of time ahead, again and again */
#define NX 1
#define NZ 0
#define NP 1
#define PARAMETERS 0.5
#define STARTS 0.0
#define CO_SIMULATION
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 1.0; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->mode[0]++;
    m->next_time = m->t < m->p[0] ? m->p[0] : nextafter(m->t, INFINITY);
    return 0;
}
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    m->x[0] += end - m->t;
    m->t = end;
    return 0;
}
