/* One body: h' = v, v' = acceleration(m), a third state runs like the time; one indicator, two parameters. Unless the
   model says otherwise, a ball that is dropped, with gravity and restitution as parameters */
#ifndef NX
#define NX 2
#define STARTS 1.0, 0.0
#endif
#define NZ 1
#define NP 2
#ifndef PARAMETERS
#define PARAMETERS 9.81, 0.7
#endif
#include "model.h"

static double acceleration(const Model *m);

static void derivatives(Model *m, double *dx)
{
    dx[0] = m->x[1];
    dx[1] = acceleration(m);
    if (NX > 2) dx[NX - 1] = 1.0;
}
static void after_step(Model *m) {}

/* what a ball does at h = 0: its speed turns round, times the restitution */
static int bounce(Model *m)
{
    m->mode[0]++;
    m->x[1] *= -m->p[1];
    return 1;
}
