/* ball.c that rolls on, s' = 1: h'' = -g; at h = 0 the speed turns round, times e. No state of rest */
#define NX 3
#define STARTS 1.0, 0.0, 0.0
#include "body.h"

static double acceleration(const Model *m) { return -m->p[0]; }
static void indicators(Model *m, double *z) { z[0] = m->x[0]; }
static int update(Model *m) { return m->x[0] > 0.0 || m->x[1] > 0.0 ? 0 : bounce(m); }
