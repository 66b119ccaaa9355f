/* What is recorded (recording.c). */
#pragma once

#include "master_state.h"

RunStatus recording_here(Master *m); /* rows of all output times that are reached, of an FMU that moves by itself */

void recording_at(Master *m, double t, const double *x, Outcome *outcome); /* the next row */
Outcome recording_within(Master *m, double t1); /* rows of output times before the end of the step at t1 */
Outcome recording_reached(Master *m);           /* rows of output times that the run has reached */
