/* The order in which the states of a sparse system are eliminated: always one with the fewest neighbours left. */
#pragma once

#include <stdint.h>

/* order (n), of a matrix whose columns and rows are given; the work of the factors in multiplications, negative where it
   would be more than the most, or there is no room */
double elimination_order(int n, const int64_t *starts[2], const int *lists[2], double most, int *order);
