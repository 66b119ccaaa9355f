/* The factors of a mode that is linear, per kind of number: the one in force where this is included. */
#include "../model/run_state.h"

#define linear_row KIND(linear_row)
#define linear_factors KIND(linear_factors)

/* the series of a row */
Real *linear_row(Jets *j, const LinearMode *m, int row);
/* the factors of the rows of m, with j for evaluations, from a point whose order 0 has been evaluated */
void linear_factors(Point *at, Jets *j, const LinearMode *m, LinearFactors *f);
