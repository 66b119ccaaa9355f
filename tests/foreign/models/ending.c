/* x' = -1; ends the run where x = 0 */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -1.0; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    m->terminates = m->x[0] <= 0.0;
    return 0;
}
static void after_step(Model *m) {}
