/* x' = -1 and 4 in turn, whatever the state: what is called twice at one point says two things */
#define NX 1
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->mode[0]++ % 2 ? 4.0 : -1.0; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
