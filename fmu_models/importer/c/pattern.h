/*
 * Which entries of the Jacobian may differ from zero, and what follows: columns that one evaluation tells together, and
 * an order of the states that gathers the entries about the diagonal.
 */
#pragma once

#include "linear.h"

enum { PATTERN_NARROW = 10 }; /* diagonals below the main one of a band whose factors cost next to nothing */

typedef struct {
    int64_t *start; /* (n + 1): where the entries of a column begin; NULL: no pattern yet */
    int *row;       /* of each entry, ascending in a column */
    int *colour;    /* (n): columns of one colour have no row in common */
    int *place;     /* (n): of a state in the order */
    int colours;
    Band band;        /* of the matrix in that order */
    int *elimination; /* (n): states in the order of elimination; NULL where a band is cheaper, else place is none */
} Pattern;

/* each returns 0 where there is no room. rows are copied; NULL: all entries of an n x n matrix */
int pattern_set(Pattern *p, int n, const int64_t *start, const int *rows);
void pattern_free(Pattern *p);
