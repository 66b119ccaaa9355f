/* Steps of tangents (tangent_step.c). Numbers have a tangent where this is included, as tangent_series.h says. */
#include "tangent_series.h"

#ifndef STICKSLIP_TANGENT_STEP_H
#define STICKSLIP_TANGENT_STEP_H

/* variations of the step in use, which is cut where they need it */
RunStatus tangent_step(Run *r, Tangents *tangents);
/* slope of state i of the motion within that step, by the variable of its series */
double tangent_slope(const Run *r, Tangents *tangents, int i, double length);

#endif
