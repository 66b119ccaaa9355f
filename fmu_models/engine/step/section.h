/* Crossings of a level by a state. */
#pragma once

#include "../model/run_state.h"

/* pause at the crossings of a level from now on; one at this very instant is none */
void section_watch(Run *r, int state, double level, int direction);
/* where the step in use next crosses the section, up to a place, in the variable of its series; -1 if it does not */
double section_next(Run *r, double to);
