/* States and outputs of a motion within its step, and their derivatives (tangent_output.c). */
#ifndef STICKSLIP_TANGENT_OUTPUT_H
#define STICKSLIP_TANGENT_OUTPUT_H

#include "tangent.h"

/* states, and outputs if asked for, at r's own time (held) or later within the step */
void tangents_evaluate(const Run *r, Tangents *tangents, double time, int outputs);
/* of what was evaluated: a state or an output, and its derivative along tangent k */
double tangents_value(const Tangents *tangents, int output, int index);
double tangents_derivative(Tangents *tangents, int k, int output, int index);

#endif
