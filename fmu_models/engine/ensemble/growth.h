/* Growth of the differences that tangents carry. */
#ifndef STICKSLIP_GROWTH_H
#define STICKSLIP_GROWTH_H

/* make n vectors of a length orthonormal, in order, and add the logarithms of their sizes to growth; -INFINITY and a
   vector of zeros where nothing but rounding is left of one; losing: differences may have been lost altogether */
void growth_orthonormalize(double *vectors, int n, int length, int losing, double *growth);

#endif
