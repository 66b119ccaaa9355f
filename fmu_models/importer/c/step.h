/* Lengths of steps, and the method that makes them. */
#pragma once

#include "master_state.h"

Outcome step_first(Master *m);
Outcome step_make(Master *m, double limit, double *error); /* from t, at most limit long, within the tolerance */
double step_growth(Master *m, double error);               /* by which the next step may be longer */
int step_choose(Master *m);         /* automatic choice, after an accepted step: 1 if the method is to change */
void step_change_method(Master *m); /* once the polynomial of the step is no longer asked for */
void step_careful(Master *m);
