/* x' = 1, back to zero at every multiple of the period; notes whether it was ever asked beyond its time event */
#define NX 1
#define NZ 0
#define NP 1
#define PARAMETERS 0.1
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    m->mode[1] |= m->t > m->next_time;
    dx[0] = 1.0;
}
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    const int ticks = m->t == m->next_time;
    if (isinf(m->next_time)) m->next_time = m->p[0];
    if (!ticks) return 0;
    m->mode[0]++;
    m->next_time = (m->mode[0] + 1) * m->p[0];
    m->x[0] = 0.0;
    return 1;
}
static void after_step(Model *m) {}
