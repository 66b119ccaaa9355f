/* Sliding along the surface of an indicator. */
#ifndef STICKSLIP_SLIDE_H
#define STICKSLIP_SLIDE_H

#include "master_state.h"

Outcome slide_begin(Master *m, int indicator);
Outcome slide_field(Master *m, double t, const double *x, double *dx);
Outcome slide_conditions(Master *m, double t, const double *x, double *z);
Outcome slide_project(Master *m);
Outcome slide_leave(Master *m, double side);
Outcome slide_resume(Master *m, int *left); /* after an event of something else during a sliding motion */
Outcome slide_values(Master *m, double t, const double *x, double *values);

#endif
