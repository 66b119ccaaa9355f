/* a rod of NX cells between cold ends, which touch one another once the middle is no warmer than 1/2 */
#define NX 40
#define NZ 1
#define NP 1
#define PARAMETERS 1e3
#define STARTS [0 ... NX - 1] = 1.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    const double *x = m->x;
    for (int k = 0; k < NX; k++)
        dx[k] = m->p[0] * ((k > 0 ? x[k - 1] : 0.0) - 2.0 * x[k] + (k < NX - 1 ? x[k + 1] : 0.0));
    if (m->mode[0]) {
        dx[0] += m->p[0] * (x[NX - 1] - x[0]);
        dx[NX - 1] += m->p[0] * (x[0] - x[NX - 1]);
    }
}
static void indicators(Model *m, double *z) { z[0] = m->x[NX / 2] - 0.5; }
static int update(Model *m)
{
    m->mode[0] = m->x[NX / 2] <= 0.5;
    return 0;
}
static void after_step(Model *m) {}
