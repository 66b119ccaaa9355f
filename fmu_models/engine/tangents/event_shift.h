/* By how much an event comes later for a neighbour (event_shift.c). */
#pragma once

#include "variation.h"

typedef struct {
    double later; /* derivative of the variable of the series at the event, by the first indicator that falls there */
    double speed, speed_change; /* at which that indicator falls, per second, and its derivative */
    int untimed;                /* no indicator says when the event is */
    int corner;                 /* others fall at the same instant, but not for the neighbour */
} Shift;

/* of the event at s, the end of the step in use, where the variable of the variations is `at`, along one of the two
   directions; 0 where it has no derivative */
int event_shift(const Run *r, const Variation *l, int lane, double s, double at, Shift *shift);
