/* x' = 1, brought back by one after any step that ended above one */
#define NX 1
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = 1.0; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    if (!m->wants_event) return 0;
    m->wants_event = 0;
    m->mode[1]++;
    m->x[0] -= 1.0;
    return 1;
}
static void after_step(Model *m)
{
    m->mode[0]++;
    m->wants_event = m->x[0] > 1.0;
}
