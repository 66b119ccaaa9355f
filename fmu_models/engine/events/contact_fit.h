/* Whether contacts fit their states from one instant on, and which they have to change to. */
#pragma once

#include "../model/run_state.h"

enum { ALL_ZERO = MODEL_TERMS }; /* zeros of an indicator that stays zero */

/* one search for states of contacts: the candidates, and what is known of the states tried last */
typedef struct {
    int count;
    int contact[NC];
    const signed char *at_limit; /* sticking contacts whose margin is zero by construction, whatever rounding says */
    signed char before[NC];
    double slip[NC];  /* slip speeds at the instant */
    int series_order; /* orders of the trial's series in r->scratch, 0 if only order 0 is there */
    double length;
    signed char zeros[NC]; /* leading zeros of the indicator of each candidate in this trial */
    double tie;            /* a stick margin below this fraction of the capacity is one */
} Trial;

/* rate of the slip speed at order 0, contact forces included, and the sum of the magnitudes of its terms */
double fit_slip_rate(const Run *r, Jets *j, int c, double *magnitude);
/* whether a contact of friction with a law of its own could be held at all; its capacity is in scratch */
int fit_can_stick(const Run *r, int c);
/* the sides of cones into the states of the whole */
void cones_follow(Run *r);
/* the state that candidate c has to change to, its own if it fits; order 0 of the trial is in scratch */
signed char fit_wanted_state(Run *r, Trial *trial, int c);
