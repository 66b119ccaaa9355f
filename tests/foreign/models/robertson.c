/* Robertson's three reactions; rates 0.04, 3e7 and 1e4 */
#define NX 3
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0, 0.0, 0.0
#define NOMINALS 1.0, 1e-5, 1.0
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    const double slow = 0.04 * m->x[0], back = 1e4 * m->x[1] * m->x[2], fast = 3e7 * m->x[1] * m->x[1];
    dx[0] = back - slow;
    dx[1] = slow - back - fast;
    dx[2] = fast;
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
