/* x' = 1/w within a pulse of width w around a time, 0 elsewhere: x rises by 1. Far from the pulse the indicator is 1 */
#define NX 1
#define NZ 1
#define NP 2
#define PARAMETERS 7.3, 1e-3
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->mode[0] ? 1.0 / m->p[1] : 0.0; }
static void indicators(Model *m, double *z)
{
    const double place = 2.0 * (m->t - m->p[0]) / m->p[1];
    z[0] = 1.0 - 2.0 * exp2(-place * place);
}
static int update(Model *m)
{
    double z;
    indicators(m, &z);
    m->mode[0] = z <= 0.0;
    return 0;
}
static void after_step(Model *m) {}
