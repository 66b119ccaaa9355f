/* The factors of a mode that is linear, per kind of number: the one in force where this is included. */
#include "../model/run_state.h"

#define linear_row KIND(linear_row)
#define linear_factors KIND(linear_factors)

/* the series of a row */
Real *linear_row(Jets *j, const LinearMode *m, int row);
/* the factors of the rows of m, with j for evaluations, from a point whose order 0 has been evaluated */
void linear_factors(Point *at, Jets *j, const LinearMode *m, LinearFactors *f);

/*
 * What terms of order n > 1 of the inputs, which `of` has, make of a row, by some entries of its factors: so many orders
 * later what one of order 1 does,
 *
 *     y[k] += T_(k-n+1) (k-n+1)! n!/k! u[n]
 */
#define LINEAR_ADD_CURVES(series, of, column, factor, begin, end)                                                      \
    for (int e = begin; e < end; e++) {                                                                                \
        const int input = (column)[e] - Z_INPUT;                                                                       \
        for (int n = 2; input >= 0 && input < 2 * MODEL_NU && n <= MODEL_INPUT_DEGREE; n++) {                          \
            double share = 1.0;                                                                                        \
            for (int k = n; k <= LINEAR_ORDER; k++, share *= (k - n + 1.0) / k)                                        \
                (series)[k] += share * (factor)[e][k - n]                                                              \
                               * (input < MODEL_NU ? (of)->u[input] : (of)->du[input - MODEL_NU])[n];                  \
        }                                                                                                              \
    }
