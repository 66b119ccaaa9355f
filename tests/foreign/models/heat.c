/* a rod of NX cells between cold ends, in another order than along the rod: x_k' = rate (x_(k-1) - 2 x_k + x_(k+1)) */
#ifndef NX
#define NX 40
#endif
#define NZ 0
#define NP 1
#define PARAMETERS 1e4
#define STARTS [0 ... NX - 1] = 0.0
#define JACOBIAN
#include "model.h"

/* where cell k of the rod is kept */
#ifndef STRIDE
#define STRIDE 7
#endif
static int at(int k) { return STRIDE * k % NX; }

static void jacobian(Model *m, const double *seed, double *dx)
{
    for (int k = 0; k < NX; k++) {
        const double left = k > 0 ? seed[at(k - 1)] : 0.0, right = k < NX - 1 ? seed[at(k + 1)] : 0.0;
        dx[at(k)] = m->p[0] * (left - 2.0 * seed[at(k)] + right);
    }
}
static void derivatives(Model *m, double *dx) { jacobian(m, m->x, dx); }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
