/* Forces of contacts that are held, or at a bound of their force, with the rates that belong to that. */
#pragma once

#include "box_problem.h"

/* doubles of room that a problem of n unknowns needs; where mu > 0 or G is not symmetric, with the second */
#define COMPLEMENTARITY_ROOM(n) (((n) + 10) * (n))
#define LEMKE_ROOM(n) ((4 * (n) + 8) * (n)) /* lemke.c */

/*
 * state: 0 held, -1 or +1 at the lower or upper bound; on entry where the search starts. 1 and states and forces if a
 * solution was found, else 0. Without room for Lemke's algorithm (NULL) only symmetric problems are sure to be solved.
 */
int complementarity_solve(const BoxProblem *problem, signed char *state, double *force, double *room,
                          double *lemke_room);
