/* States and outputs of a motion within its step, and their derivatives (tangent_output.c). */
#pragma once

#include "tangent.h"

/* states, and outputs if asked for, at r's own time (held) or later within the step */
void tangents_evaluate(const Run *r, Tangents *tangents, double time, int outputs);
/* of what was evaluated: a state, an output or the memory of a contact, and its derivative along tangent k */
typedef enum { OF_STATE, OF_OUTPUT, OF_MEMORY } Of;
double tangents_value(const Tangents *tangents, Of what, int index);
double tangents_derivative(Tangents *tangents, int k, Of what, int index);
/* rates of the states at a time within the step, later than its start */
void tangents_rates(const Run *r, Tangents *tangents, double time, double *rates);
