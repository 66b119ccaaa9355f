/* Strobes of many motions at once, by a stepper beside the FMU (lane_stepper.h). */
#pragma once

#include "../fmi/instance.h"
#include "request.h"

/* whether what is asked for is made in lanes */
int lane_runs_possible(const Ensemble *e);
/* bytes of the room for a stepper; 0 where it is none for this model */
int64_t lane_runs_room(const void *stepper, int64_t longest);
/* all runs */
Status lane_runs(Instance *m, Ensemble *e);
