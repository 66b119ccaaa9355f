/*
 * The master's own state, shared by its parts. A step is a curve on [t, t + length]: the methods of integration make
 * it, the rest evaluates it.
 */
#pragma once

#include "fmi_calls.h"
#include "sparse.h"
#include "tableau.h"
#include "tolerances.h"

#include <complex.h>

enum { DENSE_TERMS = 8, SEARCH_NODES = 8 };
enum { SURFACES = 4, SIDES = 1 << SURFACES }; /* slid along at once: each one more doubles the evaluations */

/* what a part tells its caller: go on, try a shorter step, or stop (the report is filled) */
typedef enum { FINE, SHORTER, STOP } Outcome;

typedef struct {
    double time;         /* of the last event of this indicator */
    int moved;           /* it changed the states */
    double counted_time; /* of the last one that was not a mere return from the far side */
    double gap;          /* before it */
    double ratio;        /* of the last two gaps */
    int gaps;
    int returns; /* in a row that came at once */
    int ratios;  /* equal ones in a row */
    int events;  /* since window */
    double window;
} Watch;

/* a motion along the surfaces of indicators */
typedef struct {
    int n;    /* surfaces; 0: no such motion */
    int near; /* further indicators, whose zero was just passed: off the surfaces they keep their sides */
    int indicator[SURFACES];
    int sides;                     /* whose mode the FMU is in: bit i is set above the i-th surface */
    double part, offset[SURFACES]; /* of the indicators, at which the FMU changes its mode: part of their gradients */
    double home[SURFACES];         /* their values where the run is */
    double share[SURFACES];        /* of the upper side in the mean, at the last evaluation */
    double rates[SIDES][SURFACES]; /* of the indicators along the field on these sides */
    double *fields;                /* SIDES rows of n */
    double *normal;                /* SURFACES rows of n: x + offset * normal is above the surface, and on the others */
    double *gradient;              /* SURFACES rows of n, scaled by the nominal values of the states */
    double *point, *check, *z;
    double *values; /* recorded variables on one side */
} Slide;

typedef struct {
    const FmuInstance *fmu;
    Run *run;
    int n, nz, nu;
    int slots;     /* nz, and one more where the run ends at a section */
    double t;      /* where the run is */
    double asked;  /* time at which the FMU was evaluated last */
    double h;      /* proposed length of the next step */
    double *x, *f; /* states and derivatives there */
    double *rates; /* that the FMU said last, with what status */
    int rates_status;
    double *settled; /* states for which it said them, at the time asked; it may have been moved since */
    double *nominal, *before;
    double *u;
    int trial_status, trial_errors; /* the FMU refused trial points */
    int refused;                    /* Function that discarded last */
    int64_t knot;                   /* the piece of the input table in use */
    int inputs_vary;                /* within it */
    double next_event;              /* time event of the FMU */
    double *clocked;                /* room for a variable that has clocks */
    int64_t told;                   /* clocks that the FMU said to tick in the midst of a partition: a bit each */
    int64_t shown;                  /* the piece of the inputs in use inside steps */
    int64_t looks;                  /* inside steps of Co-Simulation, since this call began */
    int terminate, crossed;
    RunStatus ended; /* why, once a part has said STOP */
    int fresh;       /* f is to be computed anew */
    int bad_state;   /* whose derivative was not finite */
    /* method in use */
    int stiff;
    const Tableau *tableau;
    int stiff_hits, stiff_misses, calm_hits, calm_needed;
    /* the step: on [t, t + length] */
    double length, step_error;
    double *x1, *f1, *stage, *k;
    double *dense; /* DENSE_TERMS rows of n */
    int dense_terms, dense_ready;
    double *error, *error_low;
    /* stiff method */
    Pattern pattern;
    PatternKind pattern_kind;
    int64_t undeclared; /* entries of the Jacobian that the FMU does not declare */
    int check_pattern;  /* it may be another one since an event */
    double *jacobian;   /* entries of the pattern */
    double *real_lu;    /* band of the pattern */
    double complex *complex_lu;
    int *real_pivot, *complex_pivot;
    Factors real_factors, complex_factors; /* instead, where the pattern has an order of elimination */
    double *stages_z, *stages_w, *stages_f, *seed;
    double lu_length, newton_rate, last_error, last_length;
    int jacobian_ready, jacobian_fresh, newton_poor, lu_ready, previous_ready;
    /* indicators */
    double *z, *z1, *point; /* at t; scratch; states of a point of the step */
    signed char *side;      /* 1: positive, -1: zero or below */
    signed char *fired;
    double *samples;      /* nodes x slots */
    double *node_inverse; /* from values at the nodes to the coefficients of the polynomial */
    Watch *watch;
    Slide slide;
    int doubtful;   /* indicator whose polynomial was not trusted in the last interval, from 1; 0: none */
    int unresolved; /* such an indicator changes faster than the nodes of the step can show: a shorter step is needed */
    double resolved; /* length of steps that show the indicators */
    int stalled;
    double last_event_time;
    int quick_slides;   /* that began soon after one another */
    double slide_time;  /* at which the last one began */
    int64_t pace_steps; /* tried since pace_time */
    double pace_time;
} Master;
