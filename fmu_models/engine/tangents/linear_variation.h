/* Variations of a step whose series are sums (linear_variation.c). Numbers have a tangent where this is included. */
#include "tangent_series.h"

#ifndef STICKSLIP_LINEAR_VARIATION_H
#define STICKSLIP_LINEAR_VARIATION_H

/* of tangent k and the one after it, the variations of the series of the states and of what falls at the end of such a
   step, or of every one that it keeps, from those of the first orders */
void linear_variation(const Run *r, Tangents *tangents, int k, int every);

#endif
