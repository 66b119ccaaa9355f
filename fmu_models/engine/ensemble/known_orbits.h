/* When a motion needs to be followed no farther: it repeats itself, or has come to an orbit that is known. */
#pragma once

#include "../model/run_state.h"
#include "request.h"

/* the points of the last steps, and for how many steps each period has held */
typedef struct {
    const Ensemble *e;
    double *memory;
    int64_t seen;     /* points since the start */
    int64_t held;     /* whether any period holds at present */
    int telling;      /* a number of a point that tells most of them apart by its distance alone; -1: none */
    int64_t expected; /* known point that comes next; -1: none */
    int64_t met;      /* known points met in a row */
} Arrival;

/* numbers that are kept on the way */
int64_t arrival_numbers(int64_t longest);
void arrival_start(Arrival *a, const Ensemble *e, double *memory);
/* the period that the motion has come to with this point, MODEL_NX states and the time; 0: none yet */
int64_t arrival_period(Arrival *a, const double *x, double time);
/* the known orbit that it has come to; -1: none yet */
int64_t arrival_orbit(Arrival *a, const double *x);
