/* The right-hand side, whatever it is at present: the FMU, or the mean field of a sliding motion. */
#pragma once

#include "master_state.h"

Outcome motion_rates(Master *m, double t, const double *x, double *dx);
/* those of the surfaces of a sliding motion are its own conditions */
Outcome motion_indicators(Master *m, double t, const double *x, double *z);
