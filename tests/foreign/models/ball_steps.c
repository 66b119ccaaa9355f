/* Co-Simulation of a ball by its exact flights, h'' = -g and v = -e v at impacts; a flight too short to be resolved is
   none, and the ball falls through the floor */
#define NX 2
#define NZ 0
#define NP 2
#define PARAMETERS 9.81, 0.7
#define STARTS 1.0, 0.0
#define CO_SIMULATION
#include "model.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = m->x[1];
    dx[1] = -m->p[0];
}
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    if (!m->mode[1]) return 0;
    m->mode[1] = 0;
    m->mode[0]++;
    m->x[1] *= -m->p[1];
    return 1;
}
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    const double g = m->p[0], v = m->x[1];
    const double flight = m->x[0] >= 0.0 ? (v + sqrt(v * v + 2.0 * g * m->x[0])) / g : 0.0;
    const int lands = flight > 1e-13 && m->t + flight < end;
    const double by = lands ? flight : end - m->t;
    m->x[0] = lands ? 0.0 : m->x[0] + by * (v - 0.5 * g * by);
    m->x[1] = v - g * by;
    m->t += by;
    m->mode[1] = lands;
    return lands;
}
