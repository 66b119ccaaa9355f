/* Rates and forces of contacts, with bounds of the forces. */
#pragma once

/* rates y = b + G l for forces l between bounds; y > 0 only where l is at its lower bound, y < 0 only at its upper */
typedef struct {
    int n;
    const double *G;             /* (n, n), by rows */
    const double *b;             /* rates without these forces */
    const double *size;          /* sums of the magnitudes of the terms of b: a small part of it is zero */
    const double *lower, *upper; /* bounds of the forces, infinite where there is none */
    const double *mu;            /* the friction of a rigid contact: bounds are wider by mu times the force of ... */
    const int *partner;          /* ... that unknown; else 0 and -1 */
    double tolerance;            /* what part of the magnitudes is zero */
    const signed char *fixed;    /* unknowns that keep their state, whether it fits or not; NULL: none */
} BoxProblem;
