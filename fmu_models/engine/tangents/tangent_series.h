/* The tangents themselves. From where this is included, numbers have a tangent, until scalar_real.h is. */
#include "../model/run_state.h"

#include "../model/scalar_tangent.h"

#ifndef STICKSLIP_TANGENT_SERIES_H
#define STICKSLIP_TANGENT_SERIES_H

#include "../model/model_kind.h"
#include "../step/contact_forces.h"
#include "../step/flow.h"

typedef struct {
    Point at;
    Jets jets;
    int order;                    /* to which jets holds the series in time from the point; 0: it does not */
    int untimed;                  /* the last event has no indicator that says when it is */
    Real y[MODEL_ROOM(MODEL_NY)]; /* outputs at the time evaluated at */
} Tangent;

struct Tangents {
    int count;
    int gathered; /* the derivatives of the series of the step stand side by side */
    Jets scratch;
    double x[MODEL_ROOM(MODEL_NX)]; /* states at the time evaluated at */
    Tangent list[];                 /* tangent_output.c says what stands behind it */
};

/* so small that its square vanishes, so large that nothing underflows */
#define EPS 1e-100

/* time since the start of the step, for a tangent, at a time that is the same for all */
static inline Real since_start(const Tangent *t, double length) { return length - cimag(t->at.time) * _Complex_I; }

#endif
