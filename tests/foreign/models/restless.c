/* x' = -1; at x = 0 its discrete states never settle */
#define NX 1
#define NZ 1
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#define RESTLESS (m->x[0] <= 0.0)
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -1.0; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
