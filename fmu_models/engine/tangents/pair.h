/* Numbers along two directions, side by side. */
#pragma once

#include "../model/run_state.h"

/* what every processor has a register for */
typedef double Pair __attribute__((vector_size(16)));
enum { PAIR = 2 };
#define PAIR_ZERO ((Pair){0.0, 0.0})

typedef Pair PairSeries[MODEL_TERMS + 1];
typedef Pair InertiaPairs[MODEL_INERTIA_TERMS];

/* c[0] + c[1] s + ... + c[n] s^n in both directions, and its slopes */
Pair pair_value(const Pair *c, int n, double s);
Pair pair_slope(const Pair *c, int n, double s);
