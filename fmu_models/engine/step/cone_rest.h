/* The last of the way of a cone to rest, and its margin in stick. */
#pragma once

#include "../model/run_state.h"

/* the step in use, if a cone comes to rest so soon that no series is needed; 0 if none does within the limit */
int cone_rests_at_once(Run *r, double limit);
/* capacity^2 - |lambda|^2 of held cone c, to an order */
void cone_margin(const Jets *j, int c, int order, double *margin);
