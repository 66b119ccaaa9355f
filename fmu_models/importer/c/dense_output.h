/* The dense output of all methods. */
#pragma once

#include "master_state.h"

void dense_value(const Master *m, double theta, double *x);
