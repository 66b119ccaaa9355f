/* The Jacobian of the rates by the states, as a pattern and its entries. */
#pragma once

#include "master_state.h"

Outcome jacobian_make(Master *m);      /* where the run is: m->pattern, m->jacobian */
double jacobian_rate(const Master *m); /* its largest row sum, scaled by the nominal values of the states, 1/s */
void jacobian_free(Master *m);
