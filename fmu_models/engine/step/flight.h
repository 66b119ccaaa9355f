/* The way of a free flight to the next impact, in one step. */
#pragma once

#include "../model/run_state.h"

/* whether the states of a mode are parabolas, and all that is looked at are depths */
int flight_is_flight(const LinearMode *m);

/* end the step, whose series by sums are there, where the first gap closes, or at `limit`; 0 where series are as good: the
   flight is short beside what drives the walls, or grazes one */
int flight_step(Run *r, double limit);
