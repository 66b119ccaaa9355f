/* turns round at every event, whatever the side: chatters at x = 0, and no side has equations of its own */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->mode[0]; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m)
{
    m->mode[0] = m->mode[0] == -1 ? 1 : -1;
    return 0;
}
static void after_step(Model *m) {}
