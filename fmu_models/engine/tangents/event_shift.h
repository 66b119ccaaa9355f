/* By how much an event comes later for a neighbour (event_shift.c). */
#pragma once

#include "variation.h"

typedef struct {
    Pair later;   /* derivative of the variable of the series at the event, by the first indicator that falls there */
    double speed; /* at which that indicator falls, per second */
    Pair speed_change; /* and its derivative */
    int untimed;       /* no indicator says when the event is */
    int corner[PAIR];  /* others fall at the same instant, but not for the neighbour */
} Shift;

/* of the event at s, the end of the step in use, where the variable of the variations is `at`, along both directions; 0
   where it has no derivative */
int event_shift(const Run *r, const Variation *l, double s, double at, Shift *shift);
