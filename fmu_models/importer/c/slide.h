/* Sliding along the surfaces of indicators. */
#pragma once

#include "master_state.h"

Outcome slide_begin(Master *m, int indicator);
Outcome slide_field(Master *m, double t, const double *x, double *dx);
Outcome slide_conditions(Master *m, double t, const double *x, double *z);
Outcome slide_project(Master *m);
int slide_along(const Master *m, int indicator);
Outcome slide_leave(Master *m, int indicator); /* to the side on which its share of the mean ends */
/* after an event during a sliding motion: it goes on, or the surface of the indicator left was left (-1: none) */
Outcome slide_resume(Master *m, int *left);
Outcome slide_values(Master *m, double t, const double *x, double *values);
