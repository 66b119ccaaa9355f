/* The derivative of the states by those at the start, along a run. */
#pragma once

#include "master_state.h"

void tangent_start(Master *m);
Outcome tangent_slopes(Master *m);                /* at the present point, in the mode that holds there */
Outcome tangent_advance(Master *m, double theta); /* over the step as far as theta */
Outcome tangent_before(Master *m, double length); /* an event at the end of a step of that length */
void tangent_after(Master *m, int states_decide); /* the event; f is the field after it */
