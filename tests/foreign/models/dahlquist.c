/* x' = -k x */
#define NX 1
#define NZ 0
#define NP 1
#define PARAMETERS 1.0
#define STARTS 1.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -m->p[0] * m->x[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
