/* A step by the method in use. */
#pragma once

#include "master_state.h"

Outcome method_try(Master *m, double length, double *error);
Outcome method_dense(Master *m);
