/* Complementarity by Lemke's algorithm. */
#pragma once

#include "box_problem.h"

/* states of the members of one group; scale: of their forces; 0 if the algorithm ends on a ray */
int lemke_solve(const BoxProblem *problem, const int *member, int count, const double *scale, signed char *state,
                double *room);
