/* The tangents themselves. From where this is included, numbers have a tangent, until scalar_real.h is. */
#include "../model/run_state.h"
#include "variation.h"

#include "../model/scalar_tangent.h"

#ifndef STICKSLIP_TANGENT_SERIES_H
#define STICKSLIP_TANGENT_SERIES_H

#include <stdint.h>

#include "../model/model_kind.h"

#include "../model/elements.h"
#include "../model/signals.h"
#include "../step/cone_end.h"
#include "../step/contact_forces.h"
#include "../step/flow.h"

typedef struct {
    Point at;
    Jets jets;                    /* of evaluations at one instant */
    double relative;              /* of the parameters, the largest derivative in parts of its own size, times EPS */
    int corner;                   /* on the way several indicators fell at one instant, but not for its neighbours */
    int untimed;                  /* the last event has no indicator that says when it is */
    Real rest;                    /* the length of a step that ends in the rest of a cone */
    double speed, speed_change;   /* of the indicator of the last event, and its derivative */
    Real y[MODEL_ROOM(MODEL_NY)]; /* outputs at the time evaluated at */
} Tangent;

typedef struct Tangents Tangents;

struct Tangents {
    int count;
    Jets scratch;
    double x[MODEL_ROOM(MODEL_NX)];                     /* states at the time evaluated at */
    double rate[MODEL_ROOM(MODEL_NX)][MODEL_TERMS + 1]; /* of the motion, for variations in the root of the time left */
    Tangent list[];                                     /* and behind it their variations, in pairs */
};

/* so small that its square vanishes, so large that nothing underflows; a power of two, so that nothing is rounded */
#define EPS 0x1p-332

/* of the pair to which tangent k belongs: numbers side by side are aligned, what is before them need not be */
static inline Variation *variation_of(Tangents *tangents, int k)
{
    char *end = (char *)(tangents->list + tangents->count);
    return (Variation *)(void *)(end + -(uintptr_t)end % sizeof(Pair)) + k / PAIR;
}

/* time since the start of the step, for a tangent, at a time that is the same for all */
static inline Real since_start(const Tangent *t, double length) { return length - cimag(t->at.time) * _Complex_I; }

#endif
