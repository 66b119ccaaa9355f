/* Zeros of the indicators on a part of a step; places are fractions of the step throughout. */
#pragma once

#include "master_state.h"

typedef enum { CLEAR, UNSURE, BRACKET } Finding;
void search_nodes(Master *m);                        /* the tables of interpolation */
int search_beyond(const Master *m, int i, double z); /* z is not on the side on which indicator i began the step */
Outcome search_sample(Master *m, double theta, double *z);
/* first bracket of all indicators in [from, from + width]; UNSURE: halve it */
Outcome search_interval(Master *m, double from, double width, int may_halve, Finding *finding, int *which, double *low,
                        double *high);
Outcome search_lowest(Master *m, double from, double width, double to); /* of an interval that was searched, up to */
Outcome search_close(Master *m, int i, double *low,
                     double *high); /* the bracket of indicator i, down to the resolution of time */
