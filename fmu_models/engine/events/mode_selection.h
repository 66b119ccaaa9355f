/* Which contacts are held from one instant on. */
#pragma once

#include "../model/run_state.h"

/* the contacts marked may change state: choose, set their known zeros, project; moved: x changed */
RunStatus selection_make(Run *r, const signed char *candidate, const signed char *at_limit, int *moved);
