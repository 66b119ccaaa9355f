/* Growth of the differences that tangents carry. */
#pragma once

/* product of two vectors, and the length of one */
double growth_product(const double *a, const double *b, int length);
double growth_norm(const double *v, int n);

/* make n vectors of a length, each so far apart from the one before, orthonormal, in order, and multiply growth by their
   sizes; 0 and a vector of zeros where nothing but rounding is left of one; always_twice: to the same digits whatever is
   left; losing: differences may have been lost altogether */
void growth_orthonormalize(double *vectors, int n, int apart, int length, int always_twice, int losing, double *growth);
