/* NX - 1 cells about one that all of them feel, and that feels their mean: its row and column are full */
#define NX 41
#define NZ 0
#define NP 1
#define PARAMETERS 1e3
#define STARTS [0 ... NX - 1] = 0.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    double mean = 0.0;
    for (int k = 1; k < NX; k++) {
        dx[k] = k * m->p[0] * (m->x[0] - m->x[k]);
        mean += m->x[k] / (NX - 1);
    }
    dx[0] = m->p[0] * (mean - 2.0 * m->x[0]);
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
