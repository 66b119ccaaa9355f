/* a state at rest; an indicator that falls and wavers by time alone: a - b t - sin(w t), and -1 from the
   time falls on */
#define NX 1
#define NZ 1
#define NP 4
#define PARAMETERS 1.5, 0.02, 50.0, 1e9
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 0.0; }
static void indicators(Model *m, double *z)
{
    z[0] = m->t < m->p[3] ? m->p[0] - m->p[1] * m->t - sin(m->p[2] * m->t) : -1.0;
}
static int update(Model *m)
{
    double z;
    indicators(m, &z);
    m->mode[0] += z <= 0.0;
    return 0;
}
static void after_step(Model *m) {}
