/* x' = -1, put back to 1 where it falls to zero; below -0.01 there is no indicator (it discards), beyond t = 2.5 no value
   of x */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#define INDICATED(m) ((m)->x[0] > -0.01)
#define READABLE(m, v) ((m)->t < 2.5)
#define UNREADABLE 2
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -1.0; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    if (m->x[0] > 0.0) return 0;
    m->x[0] = 1.0;
    return 1;
}
static void after_step(Model *m) {}
