/* The fields of a foreign FMU on all sides of the surfaces it slides along, and their mean. */
#pragma once

#include "master_state.h"

/* gradients and the ways off the surfaces; found 0 if one depends on no state, or two are parallel */
Outcome surfaces_normals(Master *m, int *found);
/* the FMU is put beside all surfaces, where the run is (point), and chooses its mode there; agreed 0 if it moves the
   states */
Outcome surfaces_take(Master *m, int sides, int *agreed);
/* fields and rates on all sides, and the shares of the mean; solved 0 if there is none */
Outcome surfaces_mean(Master *m, double t, const double *x, int *solved);
/* of the field on these sides in the mean */
double surfaces_weight(const Slide *s, int sides);
int surfaces_attract(const Slide *s);   /* what leaves the surfaces is led back */
int surfaces_inside(const Slide *s);    /* all shares are between 0 and 1 */
int surfaces_additive(const Master *m); /* the field is a sum with one term for each surface */
