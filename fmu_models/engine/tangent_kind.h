/* The tangents themselves, for tangent.c and look.c, which work in their kind of number. */
#ifndef STICKSLIP_TANGENT_KIND_H
#define STICKSLIP_TANGENT_KIND_H

#include "tangent.h"

typedef struct {
    Point at;
    Jets jets;
    int order;    /* to which jets holds the series in time from the point; 0: it does not */
    int untimed;  /* the last event has no indicator that says when it is */
    Real y[MODEL_ROOM(MODEL_NY)]; /* outputs at the time looked at */
} Tangent;

struct Tangents {
    int count;
    int gathered; /* the derivatives of the series of the step stand side by side */
    Jets scratch;
    double x[MODEL_ROOM(MODEL_NX)]; /* states at the time looked at */
    Tangent list[]; /* look.c says what stands behind it */
};

/* so small that its square vanishes, so large that nothing underflows */
#define EPS 1e-100

/* time since the start of the step, for a tangent, at a time that is the same for all */
static inline Real since_start(const Tangent *t, double length)
{
    return length - cimag(t->at.time) * _Complex_I;
}

#endif
