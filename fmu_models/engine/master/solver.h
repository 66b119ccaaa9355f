/*
 * The master's own state, shared by its parts. A step is a curve on [t, t + length]: the methods of integration make it, the rest
 * evaluates it.
 */
#ifndef STICKSLIP_SOLVER_H
#define STICKSLIP_SOLVER_H

#include "explicit.h"
#include "face.h"

enum { DENSE_TERMS = 8, SEARCH_NODES = 8 };

/* what a part tells its caller: go on, try a shorter step, or stop (the report is filled) */
typedef enum { FINE, SHORTER, STOP } Outcome;

typedef struct {
    double time;                /* of the last event of this indicator */
    int moved;                  /* it changed the states */
    double counted_time;        /* of the last one that was not a mere return from the far side */
    double gap;                 /* before it */
    double ratio;               /* of the last two gaps */
    int gaps;
    int returns;                /* in a row that came at once */
    int ratios;                 /* equal ones in a row */
    int events;                 /* since window */
    double window;
} Watch;

typedef struct {
    int active, indicator;
    double side;                /* of the surface whose mode the FMU is in: +1 above, -1 below */
    double offset;              /* of the indicator, at which the FMU changes its mode */
    double *normal;             /* x + offset * normal is above the surface */
    double *gradient;           /* of the indicator, scaled by the nominal values of the states */
    double rate_above, rate_below, share; /* of the indicator, and of the field above in the mean, at the last evaluation */
    double *above, *below, *point, *check, *z;
    double *values;             /* recorded variables below the surface */
} Slide;

struct Master {
    const Face *face;
    Run *run;
    int n, nz, nu;
    int slots;                  /* nz and one more: the second condition of a sliding motion */
    double t;                   /* where the run is */
    double h;                   /* proposed length of the next step */
    double *x, *f;              /* states and derivatives there */
    double *nominal, *before;
    double *u;
    int trial_status, trial_errors; /* the FMU refused trial points */
    int64_t knot;               /* the piece of the input table in use */
    int inputs_vary;            /* within it */
    double next_event;          /* time event of the FMU */
    int terminate;
    RunStatus ended;            /* why, once a part has said STOP */
    int fresh;                  /* f is to be computed anew */
    int bad_state;              /* whose derivative was not finite */
    /* method in use */
    int stiff;
    const Tableau *tableau;
    int stiff_hits, stiff_misses, calm_hits, calm_needed;
    /* the step: on [t, t + length] */
    double length, step_error;
    double *x1, *f1, *stage, *k;
    double *dense;              /* DENSE_TERMS rows of n */
    int dense_terms, dense_ready;
    double *error, *error_low;
    /* stiff method */
    double *jacobian, *real_lu, *complex_lu;
    int *real_pivot, *complex_pivot;
    double *stages_z, *stages_w, *stages_f, *seed;
    double lu_length, newton_rate, last_error, last_length;
    int jacobian_ready, jacobian_fresh, newton_poor, lu_ready, previous_ready;
    /* indicators */
    double *z, *z1, *point;     /* at t; scratch; states of a point of the step */
    signed char *side;          /* 1: positive, -1: zero or below */
    signed char *fired;
    double *samples;            /* nodes x slots */
    double *node_inverse;       /* from values at the nodes to the coefficients of the polynomial */
    Watch *watch;
    Slide slide;
    int stalled;
    double last_event_time;
    int quick_slides;           /* that began soon after one another */
    double slide_time;          /* at which the last one began */
    int64_t pace_steps;         /* tried since pace_time */
    double pace_time;
};

/* field.c: the right-hand side, whatever it is at present */
Outcome field_at(Master *m, double t, const double *x);                     /* puts the FMU there */
Outcome field(Master *m, double t, const double *x, double *dx);
Outcome field_raw(Master *m, double t, const double *x, double *dx);        /* of the FMU in its present mode */
Outcome field_indicators(Master *m, double t, const double *x, double *z);  /* slots; of a sliding motion: its own conditions */
Outcome field_inputs(Master *m, double t);
Outcome field_fail(Master *m, Function function, int status);               /* what a status of FMI means for the run */
Outcome field_report(Master *m, RunStatus status, double t, int64_t index, double value);
double field_norm(const Master *m, const double *v, const double *x, const double *y); /* root mean square in units of the tolerance */

/* explicit.c, stiff.c: a step of the given length from (t, x, f): x1, f1 and its error in units of the tolerance */
Outcome explicit_try(Master *m, double length, double *error);
Outcome explicit_dense(Master *m);
int explicit_is_stiff(Master *m);
Outcome stiff_try(Master *m, double length, double *error);
Outcome stiff_dense(Master *m);
Outcome stiff_jacobian(Master *m);
double stiff_rate(const Master *m);                                         /* bound of the rates of the linearized motion */
void dense_value(const Master *m, double theta, double *x);

/* events.c */
Outcome events_sides(Master *m);                     /* sides of all indicators where the run is */
/* first event of the step: its end, as a fraction of the step; -1: none. fired is set; the step may have become a shorter one */
Outcome events_locate(Master *m, double latest, double *theta);
Outcome events_update(Master *m, int enter, int jump); /* event mode, iterated; jump: inputs jump there */

/* search.c: fractions of the step throughout */
typedef enum { CLEAR, UNSURE, BRACKET } Finding;
void search_nodes(Master *m);                        /* the tables of interpolation */
int search_beyond(const Master *m, int i, double z); /* z is not on the side on which indicator i began the step */
Outcome search_sample(Master *m, double theta, double *z);
/* first bracket of all indicators in [from, from + width]; UNSURE: halve it */
Outcome search_interval(Master *m, double from, double width, int may_halve, Finding *finding, int *which, double *low, double *high);
Outcome search_close(Master *m, int i, double *low, double *high); /* the bracket of indicator i, down to the resolution of time */

/* step.c */
Outcome step_first(Master *m);
Outcome step_make(Master *m, double limit, double *error); /* from t, at most limit long, within the tolerance */
double step_growth(Master *m, double error);         /* by which the next step may be longer */
void step_choose(Master *m);                         /* automatic choice of the method, after an accepted step */
void step_careful(Master *m);

/* zeno.c */
void zeno_reset(Master *m);
/* after an event of this indicator; slides: it chatters; returned: it only came back from the far side of zero */
Outcome zeno_watch(Master *m, int indicator, int moved, int *slides, int *returned);
Outcome zeno_stalled(Master *m);

/* slide.c */
Outcome slide_begin(Master *m, int indicator);
Outcome slide_field(Master *m, double t, const double *x, double *dx);
Outcome slide_conditions(Master *m, double t, const double *x, double *z);
Outcome slide_project(Master *m);
Outcome slide_leave(Master *m, double side);
Outcome slide_resume(Master *m, int *left);          /* after an event of something else during a sliding motion */
Outcome slide_values(Master *m, double t, const double *x, double *values);

/* the method in use */
Outcome method_try(Master *m, double length, double *error);
Outcome method_dense(Master *m);

/* cosimulation.c */
RunStatus cosimulation_run(Master *m);

#endif
