/* The dense output of all methods. */
#ifndef STICKSLIP_DENSE_OUTPUT_H
#define STICKSLIP_DENSE_OUTPUT_H

#include "master_state.h"

void dense_value(const Master *m, double theta, double *x);

#endif
