/* The tolerances of the master. */
#pragma once

/* every tolerance of the master, with its reason */
typedef struct {
    int event_iterations; /* calls of update at one event before the FMU counts as not converging */
    int stalled_events;   /* events in a row without any progress in time before something is wrong */
    int trial_errors;     /* steps in a row that the FMU refused with an error before it is believed */
    int chatter_events;   /* returns of one indicator in a row, each within chatter_gap, that make a sliding motion */
    double chatter_gap;   /* relative to the time: far below what a step resolves, far above its rounding */
    int rate_events;      /* events of one indicator over which its rate is taken */
    double rate_gap;      /* relative to the run: at this mean gap the run would need a hundred million events */
    int quick_slides;     /* sliding motions in a row that are left as soon as they begin (within rate_gap) */
    int pace_steps;       /* tried steps over which their length is judged */
    double pace;          /* relative to the run: with less progress over that many, it would need a thousand million */
    int noise_steps;      /* tried steps after which rates are asked for twice, where steps are short */
    double noise_pace;    /* relative to the run: length of steps that are short, for the run needs 1e5 of them */
    double noise;         /* in units of the tolerance: change of such a step by the difference of two equal calls */
    int zeno_ratios;      /* equal ratios of gaps in a row that make a geometric sequence */
    double zeno_spread;   /* how equal */
    double zeno_rest;     /* relative to the time: rest of the sequence below which it is declared over */
    double zeno_still;    /* relative: a state that moves by less over the rest of the run rests at the limit */
    double graze;         /* relative to the indicator on the step: a minimum below it is looked at closely */
    double trust;         /* relative: interpolation error of an indicator up to which its polynomial is taken for it */
    double decay;         /* relative: last coefficients of an indicator that moves once to and fro on the step */
    int halvings;         /* of a step whose indicator is not trusted */
    double unresolved;    /* relative to the run: no step is made shorter than this for the sake of indicators */
} MasterTolerances;

extern const MasterTolerances master_tolerances;
