/* Numbers along two directions, side by side. */
#pragma once

#include "../model/run_state.h"

/* what every processor has a register for */
typedef double Pair __attribute__((vector_size(16)));
enum { PAIR = 2 };
#define PAIR_ZERO ((Pair){0.0, 0.0})

typedef Pair PairSeries[MODEL_TERMS + 1];
typedef Pair InertiaPairs[MODEL_INERTIA_TERMS];

/* c[0] + c[1] s + ... + c[n] s^n in both directions, as polynomial_value sums it */
static inline Pair pair_value(const Pair *c, int n, double s)
{
    const double t = s * s * s;
    Pair first = PAIR_ZERO, second = PAIR_ZERO, third = PAIR_ZERO;
    int k = n;
    for (; k % 3 != 0; k--)
        *(k % 3 == 1 ? &first : &second) = c[k];
    for (; k >= 3; k -= 3) {
        third = third * t + c[k];
        second = second * t + c[k - 1];
        first = first * t + c[k - 2];
    }
    return c[0] + s * (first + s * (second + s * third));
}
