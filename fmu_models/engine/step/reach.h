/* How far a step may reach, where functions may be flat at its start and not beyond. */
#ifndef STICKSLIP_REACH_H
#define STICKSLIP_REACH_H

#include "../model/run_state.h"

/* the length, no longer than h, over which nothing that the series of the step do not show moves rates, or what decides
   events, beyond the tolerance; order: to which the states are known; uses r->scratch */
double reach_of_step(Run *r, int order, double h);

#endif
