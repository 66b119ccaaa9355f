/* A step of the given length from (t, x, f) by an implicit method: x1, f1 and its error in units of the tolerance. */
#pragma once

#include "master_state.h"

Outcome stiff_try(Master *m, double length, double *error);
Outcome stiff_dense(Master *m);
/* whether the factors of this step are worth more than a next one that is longer by so little */
int stiff_keeps(const Master *m, double growth);
