/* x' = -sgn(x), y' = -sgn(y): slides along x = 0 into the corner */
#define NX 2
#define NZ 2
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0, 2.0
#include "signs.h"

static void derivatives(Model *m, double *dx)
{
    dx[0] = -m->mode[0];
    dx[1] = -m->mode[1];
}
