/* a bar (mass 1, inertia 1/2) on two supports with dry friction, one at its end 1, one at -arm, pulled and twisted by
   loads that grow with time: v' = pull t - F1 - F2, w'/2 = twist t - F1 + arm F2, Fi = mu_i sgn(slip i), the signs held
   between events; no state for sticking */
#define NX 3
#define NZ 2
#define NP 5
#define PARAMETERS 1.0, 0.5, 0.8, 0.1, 1.0
#define STARTS 0.0, 1.0, 0.3
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    const double *p = m->p, f1 = p[0] * m->mode[0], f2 = p[1] * m->mode[1];
    dx[0] = m->x[1];
    dx[1] = p[2] * m->t - f1 - f2;
    dx[2] = 2.0 * (p[3] * m->t - f1 + p[4] * f2);
}
static void indicators(Model *m, double *z)
{
    z[0] = m->x[1] + m->x[2];
    z[1] = m->x[1] - m->p[4] * m->x[2];
}
static int update(Model *m)
{
    double z[2];
    indicators(m, z);
    for (int i = 0; i < 2; i++)
        m->mode[i] = z[i] > 0.0 ? 1 : -1;
    return 0;
}
static void after_step(Model *m) {}
