/* u' = 1 + u^2 v - 4 u + d u_xx, v' = 3 u - u^2 v + d v_xx on 25 points between u = 1, v = 3 (Hairer & Wanner II, IV.10) */
#define N 25
#define NX 50
#define NZ 0
#define NP 1
#define PARAMETERS 0.02
#define STARTS [0 ... N - 1] = 1.0, [N... NX - 1] = 3.0
#include "model.h"

static double bend(const double *y, int i, double end)
{
    return (N + 1.0) * (N + 1.0) * ((i > 0 ? y[i - 1] : end) - 2.0 * y[i] + (i < N - 1 ? y[i + 1] : end));
}

static void derivatives(Model *m, double *dx)
{
    const double *u = m->x, *v = m->x + N;
    for (int i = 0; i < N; i++) {
        dx[i] = 1.0 + u[i] * u[i] * v[i] - 4.0 * u[i] + m->p[0] * bend(u, i, 1.0);
        dx[N + i] = 3.0 * u[i] - u[i] * u[i] * v[i] + m->p[0] * bend(v, i, 3.0);
    }
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
