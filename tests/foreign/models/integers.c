/* Co-Simulation: x' = u; counts at events the whole numbers x passes, and its steps; ends at the time last */
#define NX 1
#define NZ 0
#define NP 2
#define PARAMETERS 1.0, 1e9
#define STARTS 0.25
#define CO_SIMULATION
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->p[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->mode[0] = (int)floor(m->x[0]);
    return 0;
}
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    const double next = m->mode[0] + 1.0, reached = m->x[0] + m->p[0] * (end - m->t);
    m->terminates = end > m->p[1];
    if (m->terminates) return 0;
    if (reached < next) {
        m->x[0] = reached;
        m->t = end;
        m->mode[1]++;
        return 0;
    }
    m->t += (next - m->x[0]) / m->p[0];
    m->x[0] = next;
    return 1;
}
