/* Derivatives of a motion along directions in start state and parameters (tangent.c). */
#ifndef STICKSLIP_TANGENT_H
#define STICKSLIP_TANGENT_H

#include "run.h"

typedef struct Tangents Tangents;

/* n tangents at r's point: rows of directions in the states (MODEL_NX each) and parameters (MODEL_NP each), NULL for zeros;
   NULL without memory */
Tangents *tangent_new(const Run *r, int n, const double *states, const double *parameters);
void tangent_free(Tangents *tangents);
/* move the run and its n tangents to a time; RUN_ERROR also where the motion has no derivative */
RunStatus tangent_advance(Run *r, double end, Tangents *tangents, int n);
/* rows of derivatives of the states (MODEL_NX each) at the point reached */
void tangent_results(const Tangents *tangents, int n, double *derivatives);

#endif
