/* NX cells of which each feels the mean of all */
#define NX 6000
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS [0 ... NX - 1] = 1.0
#define RATES 10001
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    double sum = 0.0;
    for (int k = 0; k < NX; k++)
        sum += m->x[k];
    for (int k = 0; k < NX; k++)
        dx[k] = 1e3 * (sum / NX - 2.0 * m->x[k]);
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
