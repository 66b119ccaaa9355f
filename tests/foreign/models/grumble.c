/* x' = -x up to t = 1; beyond there are no rates, and it says so; as a warning there are */
#define NX 1
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#define FAILS (m->t > 1.0)
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = -m->x[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
