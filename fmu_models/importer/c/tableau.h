/* Explicit Runge-Kutta methods as tables. */
#pragma once

typedef struct {
    int stages, order;
    const double *a; /* strictly lower triangle by rows */
    const double *b, *c;
    const double *e, *e_low; /* stages + 1: error of the embedded methods; e_low (may be NULL) damps the first */
    int dense_stages;        /* further evaluations for the dense output */
    const double *dense_a, *dense_c;
    int dense_rows; /* terms of the dense output beyond the cubic of values and slopes */
    const double *d;
    double stability; /* of length times rate: the end of the real interval of stability, about */
} Tableau;

extern const Tableau tableau_dopri5, tableau_dop853;

enum { TABLEAU_STAGES = 16 }; /* the most a method needs, dense output included */
