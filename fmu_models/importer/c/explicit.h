/* A step of the given length from (t, x, f) by a table: x1, f1 and its error in units of the tolerance. */
#pragma once

#include "master_state.h"

Outcome explicit_try(Master *m, double length, double *error);
Outcome explicit_dense(Master *m);
int explicit_is_stiff(Master *m);
