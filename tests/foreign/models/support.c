/*
 * x'' + c x' + x = f0 cos(omega t), and beyond x = g a spring ks with dashpot cs that cannot pull: left where its force
 * falls to zero, touched again at x = g. A start beyond g touches if the force is positive.
 */
#define NX 2
#define NZ 1
#define NP 6
#define PARAMETERS 0.05, 0.5, 1.0, 10.0, 0.3, 4.0
#define STARTS 0.0, 0.0
#define JACOBIAN
#include "model.h"

static double force(const Model *m) { return m->p[3] * (m->x[0] - m->p[5]) + m->p[4] * m->x[1]; }

static void derivatives(Model *m, double *dx)
{
    dx[0] = m->x[1];
    dx[1] = m->p[1] * cos(m->p[2] * m->t) - m->p[0] * m->x[1] - m->x[0] - (m->mode[0] ? force(m) : 0.0);
}
static void jacobian(Model *m, const double *seed, double *dx)
{
    dx[0] = seed[1];
    dx[1] = -(1.0 + (m->mode[0] ? m->p[3] : 0.0)) * seed[0] - (m->p[0] + (m->mode[0] ? m->p[4] : 0.0)) * seed[1];
}
static void indicators(Model *m, double *z) { z[0] = m->mode[0] ? force(m) : m->p[5] - m->x[0]; }
static int update(Model *m)
{
    const int beyond = m->x[0] >= m->p[5];
    if (!m->mode[1]) {
        m->mode[0] = beyond && force(m) > 0.0;
        m->mode[1] = 1;
    } else if (m->mode[0]) {
        m->mode[0] = force(m) > 0.0;
    } else {
        m->mode[0] = beyond && m->x[1] > 0.0;
    }
    return 0;
}
static void after_step(Model *m) {}
