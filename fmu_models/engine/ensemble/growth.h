/* Growth of the differences that tangents carry. */
#pragma once

/* product of two vectors, and the length of one */
double growth_product(const double *a, const double *b, int length);
double growth_norm(const double *v, int n);

/* make n vectors of a length, each so far apart from the one before, orthonormal, in order, and multiply growth by their
   sizes; 0 and a vector of zeros where nothing but rounding is left of one; losing: differences may have been lost
   altogether */
void growth_orthonormalize(double *vectors, int n, int apart, int length, int losing, double *growth);
