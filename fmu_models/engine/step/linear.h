/* The series of a step in a mode that is linear with constant factors: sums of numbers that are probed once per mode. */
#pragma once

#include "../model/run_state.h"

/* the series of the states, and those that the length of a step and its events read, to LINEAR_ORDER: the number of
   the mode, from 1; 0, and nothing but order 0, where it has no such sums, more orders are asked for than they have, a
   term is beyond the range of numbers, or a tolerance finer than the default asks for what sums are compared with */
int linear_series(Run *r, Jets *j, int order);

/* a length over which all these keep the tolerance, of the mode; 0 where they have to be looked at */
double linear_length(Run *r);
/* no less than a length of a step of sums to the power of its last term but one */
double linear_power(const Run *r, double length);
