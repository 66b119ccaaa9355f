/* The series of an indicator over a step, and of its derivative along two directions (indicator_series.c). */
#pragma once

#include "../step/roots.h"
#include "variation.h"

typedef struct {
    int order; /* to which they are known */
    double value[POLYNOMIAL_TERMS];
    Pair derivative[POLYNOMIAL_TERMS];
} IndicatorSeries;

/* of a slot of contact c, up to its sign, along the two directions of l; side: of the margin of what sticks, the sign of
   the force that it is left by */
void indicator_series(const Run *r, const Variation *l, int c, int slot, int side, IndicatorSeries *f);
/* the margin of what sticks: it has two sides */
int indicator_is_margin(const Run *r, int c, int slot);
/* second derivative at s of a series of that order */
double indicator_bend(const double *series, int order, double s);
