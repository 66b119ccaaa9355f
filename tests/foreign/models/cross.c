/* x' = 1/2 - sgn(x), y' = -1/4 - sgn(y), w' = sgn(x) sgn(y): no sum of one term for each surface */
#define NX 3
#define NZ 2
#define NP 0
#define PARAMETERS 0.0
#define STARTS 0.3, 0.2, 0.0
#include "signs.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = 0.5 - m->mode[0];
    dx[1] = -0.25 - m->mode[1];
    dx[2] = m->mode[0] * m->mode[1];
}
