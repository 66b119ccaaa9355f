/* How far a step may reach, where functions may be flat at its start and not beyond. */
#pragma once

#include "../model/run_state.h"

typedef double StateSeries[MODEL_TERMS + 1];

/* a difference between neighbours: of states, and of parameters that are zero (or NULL) */
typedef struct {
    const StateSeries *along;
    const double *weightless;
} Neighbour;

/* the length, no longer than h, over which nothing that the series of the step do not show moves rates, or what decides
   events, beyond the tolerance; with a neighbour, whose difference has no function that is flat but in rates, beyond the
   tolerance of that; 0 if it is no longer than `least`. order: to which the states are known; uses
   r->scratch */
double reach_of_step(Run *r, const Neighbour *neighbour, int order, double h, double least);
