/*
 * The contract between the engine and the C generated for one model.
 *
 * A model is a flow with contacts, written in factored form:
 *
 *     q'  = v
 *     v'  = a(t,u,x) + W(x) lambda          without and with contact forces; v may be any states, q may be none
 *     z'  = zrate(t,u,x,sign)               internal states of laws (bristles)
 *     y   = slip(t,u,x)                     slip speed, speed of approach or switching function of each contact
 *     y'  = slip_rate(t,u,x) + G(x) lambda  its rate without and with contact forces
 *
 * A contact of friction slips (lambda = force law, odd in the sign of the slip), sticks (lambda is whatever keeps
 * y' = 0, as long as |lambda| < capacity) or is away (lambda = 0). A stop touches (lambda = force law), has released
 * while still inside (lambda = 0) or is away (lambda = 0); its y is the rate of its depth. A contact with bounds is
 * away where its depth(t,u,x) is negative.
 *
 * Everything is generated as Taylor recurrences: a function called with order k computes the
 * k-th Taylor coefficient of its results from the coefficients 0..k of what it reads. Order 0 is
 * plain evaluation; order 1 along an imposed straight line is a directional derivative. The series run in the time
 * since the start of the step, or in its square root (engine/taylor.c): t, u and du say how they depend on it.
 */
#ifndef STICKSLIP_MODEL_H
#define STICKSLIP_MODEL_H

#include "model_sizes.h" /* generated: MODEL_NQ ... below, and MODEL_NAME, MODEL_TOKEN */

/*
 * MODEL_NQ   coordinates                  MODEL_NV   velocities, or all states of a system without a body
 * MODEL_NZ   internal states of laws      MODEL_NI   event indicators
 * MODEL_NC   contacts                     MODEL_NP   parameters
 * MODEL_NU   inputs                       MODEL_NY   outputs
 * MODEL_ND   constants derived from the parameters
 * MODEL_NW   intermediate results that need Taylor coefficients
 * MODEL_CONSTANT_INERTIA  1 if W and G depend on the parameters alone
 * MODEL_BOUNDED  1 if any contact has a depth
 * MODEL_TOKEN  string that identifies the model (FMI 2 guid, FMI 3 instantiationToken)
 */
#define MODEL_NX (MODEL_NQ + MODEL_NV + MODEL_NZ) /* states: q, then v, then z */

enum { MODEL_MAX_ORDER = 30 };             /* highest Taylor order of the states */
#define MODEL_TERMS (MODEL_MAX_ORDER + 1)
#define MODEL_ROOM(n) ((n) > 0 ? (n) : 1)  /* C has no arrays of length zero */

/* states of a contact; the numbers are what the FMU shows as "<contact>_state" */
typedef enum {
    CONTACT_SLIP_MINUS = -1,
    CONTACT_STICK = 0,
    CONTACT_SLIP_PLUS = 1,
    CONTACT_AWAY = 2,
    CONTACT_TOUCHING = 3,
    CONTACT_RELEASED = 4
} ContactState;

/* one Taylor series: coefficient k belongs to (time since the start of the step)^k, or to that power of its root */
typedef double Series[MODEL_TERMS + 1];

/* all series of one step; the engine fills t, u, x and sign, the model the rest */
typedef struct {
    Series t;
    double time_rest;                         /* what rounding took from t[0]; only a phase needs it */
    Series u[MODEL_ROOM(MODEL_NU)];
    Series du[MODEL_ROOM(MODEL_NU)];          /* rates of the inputs */
    Series x[MODEL_ROOM(MODEL_NX)];
    double sign[MODEL_ROOM(MODEL_NC)];        /* of the slip speed of each slipping contact, +1 or -1; else 0 */
    double memory[MODEL_ROOM(MODEL_NC)];      /* speed at which the contact was last entered */
    Series a[MODEL_ROOM(MODEL_NV)];           /* rates of v without contact forces */
    Series zrate[MODEL_ROOM(MODEL_NZ)];
    Series slip[MODEL_ROOM(MODEL_NC)];
    Series slip_rate[MODEL_ROOM(MODEL_NC)];   /* without contact forces */
    Series capacity[MODEL_ROOM(MODEL_NC)];    /* largest force in stick */
    Series depth[MODEL_ROOM(MODEL_NC)];       /* of a contact with bounds; positive inside */
    Series release[MODEL_ROOM(MODEL_NC)];     /* of a stop that releases by force: has the sign of its force */
    Series force[MODEL_ROOM(MODEL_NC)];       /* lambda */
    Series y[MODEL_ROOM(MODEL_NY)];
    Series W[MODEL_ROOM(MODEL_NV)][MODEL_ROOM(MODEL_NC)];
    Series G[MODEL_ROOM(MODEL_NC)][MODEL_ROOM(MODEL_NC)];
    Series w[MODEL_ROOM(MODEL_NW)];
} Jets;

/* start values and facts, indexed as above */
extern const double model_start_parameters[MODEL_ROOM(MODEL_NP)];
extern const double model_start_inputs[MODEL_ROOM(MODEL_NU)];
extern const double model_start_states[MODEL_ROOM(MODEL_NX)];
extern const char *const model_contact_names[MODEL_ROOM(MODEL_NC)];
extern const unsigned char model_contact_sticks[MODEL_ROOM(MODEL_NC)];   /* 0: the law is continuous at zero slip */
extern const unsigned char model_contact_is_stop[MODEL_ROOM(MODEL_NC)];
extern const unsigned char model_contact_bounded[MODEL_ROOM(MODEL_NC)];  /* has a depth: stops, friction with a region */
extern const unsigned char model_contact_releases[MODEL_ROOM(MODEL_NC)]; /* a stop that lets go when its force falls to zero */
extern const unsigned char model_contact_remembers[MODEL_ROOM(MODEL_NC)]; /* its law reads memory */
extern const unsigned char model_contact_rooted[MODEL_ROOM(MODEL_NC)];   /* its law has half-integer powers of its depth */
extern const unsigned char model_contact_resets[MODEL_ROOM(MODEL_NC)];   /* states jump where y falls to zero from: 1 plus, 2 minus, 3 both */

/* NULL, or a sentence that says which requirement of the model the parameters violate */
const char *model_violation(const double *p);

/* constants derived from the parameters: d has MODEL_ND entries */
void model_prepare(const double *p, double *d);

/* series slip */
void model_slip(const double *p, const double *d, Jets *j, int k);
/* series depth, of contacts that have one; called after slip */
void model_depth(const double *p, const double *d, Jets *j, int k);
/* series a (reads nothing of the contacts but the sign of those that do not stick) */
void model_acceleration(const double *p, const double *d, Jets *j, int k);
/* series W and G; with MODEL_CONSTANT_INERTIA only k = 0 is ever asked for */
void model_inertia(const double *p, const double *d, Jets *j, int k);
/* force of contact c while it slips with sign[c], or touches; called after slip, depth and acceleration */
void model_law(const double *p, const double *d, Jets *j, int k, int c);
/* series release of contact c; called after slip and depth */
void model_release(const double *p, const double *d, Jets *j, int k, int c);
/* slip_rate and capacity of contact c; called after acceleration */
void model_stick(const double *p, const double *d, Jets *j, int k, int c);
/* series zrate; called after the forces */
void model_internal(const double *p, const double *d, Jets *j, int k);
/* outputs; called last; may read everything above except slip_rate and capacity */
void model_outputs(const double *p, const double *d, Jets *j, int k);

/* sum of the magnitudes of the terms whose cancellation makes the slip speed of contact c zero (order 0) */
double model_slip_magnitude(const double *p, const double *d, const Jets *j, int c);
/* the same for its depth */
double model_depth_magnitude(const double *p, const double *d, const Jets *j, int c);
/* states after the jump of contact c, from order 0 of the series */
void model_reset(const double *p, const double *d, const Jets *j, int c, double *x);

#endif
