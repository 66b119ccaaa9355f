/* The FMU at a time and a state with its inputs, and what its statuses mean for a run. */
#pragma once

#include "master_state.h"

Outcome field_at(Master *m, double t, const double *x);                     /* puts the FMU there */
Outcome field_settled(Master *m, double t, const double *x);                /* and has it compute its rates */
int field_is_settled(const Master *m, double t, const double *x);           /* is where field_settled put it last */
Outcome field_values(Master *m, double t, const double *x, double *values); /* recorded variables */
Outcome field_raw(Master *m, double t, const double *x, double *dx);        /* of the FMU in its present mode */
Outcome field_indicators(Master *m, double t, const double *x, double *z);  /* the same for its indicators */
Outcome field_inputs(Master *m, double t);
Outcome field_fail(Master *m, Function function, int status); /* what a status of FMI means for the run */
Outcome field_report(Master *m, RunStatus status, double t, int64_t index, double value);
double field_norm(const Master *m, const double *v, const double *x,
                  const double *y); /* root mean square in units of the tolerance */
