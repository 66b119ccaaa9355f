/*
 * The steps of a map: states that rest, and jump by the rule of the model at equal times,
 *
 *     x(t0 + k period + 0) = f(x(t0 + k period - 0), p),   k = 1, 2, ...
 *
 * t0 the start of the run. A step is due where the time has come to it within rounding of sums of steps; of several
 * that an importer has passed all are made. A new period counts from the last step on.
 */
#pragma once

#include "instance.h"

/* time of the next event that is known beforehand: the step of a map, the knot of a signal in Model Exchange; else
   infinite */
double iteration_next(Core *core);
/* instance_update, and all steps that are due at the present time */
Status iteration_update(Instance *m, const char *function, int *changed);
/* go to the end, or to the next step before it, where it is then due; *event is set there */
Status iteration_advance(Instance *m, const char *function, double end, int stop_at_event, int *event);
