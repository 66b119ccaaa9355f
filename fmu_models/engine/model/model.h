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
 * A contact of friction slips (lambda = force law), sticks (lambda is whatever keeps y' = 0, as long as
 * -capacity_minus < lambda < capacity) or is away (lambda = 0). A stop touches (lambda = force law), has released
 * while still inside (lambda = 0) or is away (lambda = 0); its y is the rate of its depth. A contact with bounds is
 * away where its depth(t,u,x) is negative.
 *
 * Everything is generated as Taylor recurrences: a function called with order k computes the
 * k-th Taylor coefficient of its results from the coefficients 0..k of what it reads. Order 0 is
 * plain evaluation; order 1 along an imposed straight line is a directional derivative. The series run in the time
 * since the start of the step, or in its square root (step/taylor.c): t, u and du say how they depend on it.
 */
#pragma once

#include "../model_sizes.h" /* generated: MODEL_NQ ... below, and MODEL_NAME, MODEL_TOKEN */

#include "inlining.h"

/*
 * MODEL_NQ   coordinates                  MODEL_NV   velocities, or all states of a system without a body
 * MODEL_NZ   internal states of laws      MODEL_NI   event indicators
 * MODEL_NE   of them, elements of arrays
 * MODEL_NC   contacts                     MODEL_NP   parameters
 * MODEL_NU   inputs, the signals behind   MODEL_NY   outputs
 * MODEL_NS   periodic signals             MODEL_NK   the most knots that one of them has
 * MODEL_ND   constants derived from the parameters
 * MODEL_NW   intermediate results that need Taylor coefficients
 * MODEL_NR   of them, reciprocals
 * MODEL_NH   harmonics of the time
 * MODEL_NM   entries of the mass matrix that are kept, 0 where accelerations need none (model/mass_matrix.h)
 * MODEL_CONSTANT_INERTIA  1 if W and G, and the mass matrix, depend on the parameters alone
 * MODEL_BOUNDED  1 if any contact has a depth
 * MODEL_YIELDS   1 if states have bounds at which they yield
 * MODEL_RESTS    1 if the resets of any switch may end in rest
 * MODEL_DIRECTED  1 if any contact holds more in one direction than in the other
 * MODEL_REACH  1 if some function may be flat where it is expanded and not beyond (step/reach.h)
 * MODEL_LINEAR  1 if few states, in every mode, are linear with constant factors (step/linear.c)
 * MODEL_RELEASES  1 if any stop lets go when its force falls to zero
 * MODEL_IMPACTS  rigid contacts
 * MODEL_CONES  friction with two directions (step/cone_forces.c)
 * MODEL_IS_MAP  1 if the states rest and jump by a rule at equal times (model_iterate): then there is no contact
 * MODEL_TOKEN  string that identifies the model (FMI 2 guid, FMI 3 instantiationToken)
 */
#define MODEL_NX (MODEL_NQ + MODEL_NV + MODEL_NZ) /* states: q, then v, then z */

#define MODEL_FLOWING (MODEL_IS_MAP ? 0 : MODEL_NX) /* states that an importer integrates */

enum { MODEL_MAX_ORDER = 30 };   /* highest Taylor order of the states */
enum { MODEL_INPUT_DEGREE = 6 }; /* of the polynomials that inputs follow between two writes, at most */
#define MODEL_TERMS (MODEL_MAX_ORDER + 1)
#define MODEL_ROOM(n) ((n) > 0 ? (n) : 1) /* C has no arrays of length zero */
enum { NC = MODEL_ROOM(MODEL_NC) };
#define MODEL_INERTIA_TERMS (MODEL_CONSTANT_INERTIA ? 1 : MODEL_TERMS + 1)

/* the power of the series variable that is time: 1, or 2 where the series run in the root of time */
static inline int time_power(int rooted) { return rooted ? 2 : 1; }

/* A rigid contact that is away is open, one that touches closed; one that chatters is held like a closed one, while
   infinitely many small bounces die out. */

/* the indicators of a contact: of its depth (a closed rigid contact: its force), and of its slip, stick margin or
   release */
typedef enum { SLOT_NORMAL = 0, SLOT_TANGENTIAL = 1, SLOTS = 2 } Slot;

/* of models that are linear with constant factors in every mode (step/linear.c) */
enum {
    /* to make one takes ten steps: as many as the states of some contacts make together */
    LINEAR_MODES = !MODEL_LINEAR ? 1
    : MODEL_NC < 2               ? 4
                                 : 32,
    LINEAR_READ = MODEL_LINEAR ? 4 * NC : 1, /* series of contacts, at most */
    LINEAR_ENTRIES = MODEL_LINEAR ? (MODEL_NX + 2 * NC) * (MODEL_NX + 2 * (MODEL_NH + MODEL_NU))
                                  : 1, /* modes of more are not kept */
    LINEAR_ORDER = 28 /* of their series, whose terms cost little: beyond it the search for events does */
};

/* the columns and rows of their factors: x, sine and cosine of each harmonic, u, the rates of u, t; states, then what is
   read of contacts */
enum {
    Z_SINE = MODEL_NX,
    Z_INPUT = Z_SINE + 2 * MODEL_NH,
    Z_RATE = Z_INPUT + MODEL_NU,
    Z_TIME = Z_RATE + MODEL_NU,
    Z_COLUMNS,
    Z_ROWS = MODEL_NX + LINEAR_READ
};

/* one phase of an impact */
typedef struct {
    signed char held[MODEL_ROOM(
        MODEL_NC)]; /* the rate after it is prescribed: rigid contacts with an impulse, friction that sticks */
    signed char
        friction[MODEL_ROOM(MODEL_NC)]; /* how the friction of rigid contacts with an impulse slips; else away */
} ImpactPhase;

#include "scalar_real.h"
#include "model_kind.h"

/* the side, +1 or -1, on which a force in stick is nearer to its bound */
static inline int nearer_side(double force, double plus, double minus)
{
    if (MODEL_DIRECTED) return plus - force < minus + force ? 1 : -1;
    return force > 0.0 ? 1 : -1;
}

/* that of contact c at order 0 */
static inline int stick_side(const Jets *j, int c)
{
    return nearer_side(j->force[c][0], stick_bound(j, c, 1)[0], stick_bound(j, c, -1)[0]);
}

/* start values and facts, indexed as above */
extern const double model_start_parameters[MODEL_ROOM(MODEL_NP)];
extern const double model_start_inputs[MODEL_ROOM(MODEL_NU)];
extern const double model_start_states[MODEL_ROOM(MODEL_NX)];
extern const double model_nominal_states[MODEL_ROOM(MODEL_NX)]; /* typical magnitudes (in all.c) */
extern const char *const model_contact_names[MODEL_ROOM(MODEL_NC)];
extern const unsigned char model_contact_sticks[MODEL_ROOM(MODEL_NC)]; /* 0: the law is continuous at zero slip */
extern const unsigned char model_contact_compliant[MODEL_ROOM(MODEL_NC)];
extern const unsigned char model_contact_tangential[MODEL_ROOM(MODEL_NC)]; /* neither compliant nor impulsive */
extern const unsigned char model_contact_bounded[MODEL_ROOM(MODEL_NC)]; /* has a depth: stops, friction with a region */
extern const unsigned char
    model_contact_releases[MODEL_ROOM(MODEL_NC)]; /* a stop that lets go when its force falls to zero */
extern const unsigned char model_contact_remembers[MODEL_ROOM(MODEL_NC)]; /* its law reads memory */
extern const unsigned char
    model_contact_rooted[MODEL_ROOM(MODEL_NC)]; /* its law has half-integer powers of its depth */
extern const unsigned char model_contact_resets[MODEL_ROOM(
    MODEL_NC)]; /* states jump where y falls to zero from: 1 plus, 2 minus, 3 both; 4: where stick begins or ends; 8:
                   the jumps may end in rest: stick holds the rate of y at zero, not y */
extern const unsigned char model_contact_impulsive[MODEL_ROOM(MODEL_NC)];
extern const unsigned char model_contact_rubs[MODEL_ROOM(MODEL_NC)]; /* friction that is not of a rigid contact */
extern const unsigned char
    model_contact_cone[MODEL_ROOM(MODEL_NC)]; /* 1: friction with two directions, the contacts behind it: 2 and 3 */
extern const short model_contact_partner[MODEL_ROOM(
    MODEL_NC)]; /* of a rigid contact its friction, of that the rigid contact; -1: none */
extern const unsigned char model_contact_clocks[MODEL_ROOM(MODEL_NC)]; /* the ticks of the clocks that it has */
extern const unsigned char
    model_contact_poisson[MODEL_ROOM(MODEL_NC)]; /* restitution by Poisson's rule, else by Newton's */

extern const short model_contact_first[MODEL_ROOM(MODEL_NC)]; /* of an array: index of the state of its first element */
extern const short model_contact_elements[MODEL_ROOM(MODEL_NC)]; /* and how many it has; 0: it is none */

/* the intermediate results that are the phase, sine and cosine of each harmonic */
extern const short model_angle[MODEL_ROOM(MODEL_NH)], model_sine[MODEL_ROOM(MODEL_NH)],
    model_cosine[MODEL_ROOM(MODEL_NH)];

/* inputs that are set from outside; signals, which the model drives itself, are behind them */
enum { MODEL_SET_INPUTS = MODEL_NU - MODEL_NS };

static inline int contact_may_rest(int c) { return MODEL_RESTS && (model_contact_resets[c] & 8); }

/* friction with two directions, and one of them: their states are one */
static inline int cone_is_whole(int c) { return MODEL_CONES > 0 && model_contact_cone[c] == 1; }
static inline int cone_is_side(int c) { return MODEL_CONES > 0 && model_contact_cone[c] > 1; }

/* a bound that yields: y is what is left to it of a state, which its own flow changes */
static inline int contact_yields(int c) { return MODEL_YIELDS && !model_contact_rubs[c] && model_contact_sticks[c]; }

/* an array of elements that yield: y is what is left to the next (elements.h) */
static inline int contact_is_array(int c) { return MODEL_NE > 0 && model_contact_elements[c] > 0; }

/* the array of the element whose state is x[i] */
static inline int array_of(int i)
{
    int c = 0;
    while (i >= model_contact_first[c] + model_contact_elements[c])
        c++;
    return c;
}

/* whether a contact carries whatever force keeps its y at rest: sticking friction, a closed rigid contact */
static inline int contact_is_held(const signed char *state, int c)
{
    if (MODEL_IMPACTS > 0 && model_contact_impulsive[c]) return state[c] != CONTACT_AWAY;
    return state[c] == CONTACT_STICK && !cone_is_whole(c);
}

/* whether it has a force by a law of its own: it slips or touches, and is neither a rigid contact nor the friction of
   one */
static inline int contact_has_law(const signed char *state, int c)
{
    if (MODEL_IMPACTS > 0 && (model_contact_impulsive[c] || model_contact_partner[c] >= 0)) return 0;
    return state[c] != CONTACT_STICK && state[c] != CONTACT_AWAY && state[c] != CONTACT_RELEASED;
}

/* whether its release decides: a stop that lets go when its force falls to zero, and is inside */
static inline int contact_may_release(const signed char *state, int c)
{
    return MODEL_RELEASES && model_contact_releases[c]
           && (state[c] == CONTACT_TOUCHING || state[c] == CONTACT_RELEASED);
}

/* the mass matrix: column of the first entry of each row that is kept, where that would be for column 0, and whether an
   entry depends on more than parameters */
extern const int model_mass_first[MODEL_ROOM(MODEL_NV)];
extern const int model_mass_row[MODEL_ROOM(MODEL_NV)];
extern const unsigned char model_mass_moves[MODEL_ROOM(MODEL_NM)];

/* the contacts whose forces act on driven state i are model_acting[n], n from model_acting_first[i] to that of i + 1;
   those whose forces change the rate of y of contact c, the same; all others have zeros in W and G */
extern const int model_acting_first[MODEL_NV + 1];
extern const int model_acting[];
extern const int model_joined_first[MODEL_NC + 1];
extern const int model_joined[];

/* of a map: the states after a step, angles within their modulus, and the time between two steps, s */
void model_iterate(const double *p, const double *x, double *next);
/* the derivative of the next states, row by row; its determinant */
double model_iterate_derivative(const double *p, const double *x, double *jacobian);
double model_period(const double *p);

/* NULL, or a sentence that says which requirement of the model the parameters violate */
const char *model_violation(const double *p);

/* sum of the magnitudes of the terms whose cancellation makes the slip speed of contact c zero (order 0) */
double model_slip_magnitude(const double *p, const double *d, const Jets *j, int c);
/* the same for its depth */
double model_depth_magnitude(const double *p, const double *d, const Jets *j, int c);
/* the same for slip_rate, of a rigid contact and of its friction; 0 for others */
double model_rate_magnitude(const double *p, const double *d, const Jets *j, int c);
/* what part of the lever of contact c is left of the terms it is the sum of, and of what it could be elsewhere: 1 away
   from its zeros, rounding or 0 at them (order 0) */
double model_lever(const double *p, const double *d, const Jets *j, int c);
/* the part of the kinetic energy that is quadratic in the velocities, J; 0 without a body */
double model_kinetic_energy(const Point *at);

#include "elements.h"
