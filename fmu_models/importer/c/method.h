/* A step by the method in use. */
#ifndef STICKSLIP_METHOD_H
#define STICKSLIP_METHOD_H

#include "master_state.h"

Outcome method_try(Master *m, double length, double *error);
Outcome method_dense(Master *m);

#endif
