/*
 * The part of the contract that depends on the kind of number. The arithmetic of model and engine exists twice: for
 * real numbers, and for numbers a + i eps b whose imaginary part carries the derivative b of the real part a along some
 * direction (exact to rounding, since eps^2 vanishes beside 1): the tangent kind, in which tangents/tangent.c moves
 * derivatives through steps and events. scalar_real.h or scalar_tangent.h says which kind this inclusion is of.
 */

/* one Taylor series: coefficient k belongs to (time since the start of the step)^k, or to that power of its root */
typedef Real Series[MODEL_TERMS + 1];
/* the same of what the mass matrix makes: one number where it depends on the parameters alone */
typedef Real InertiaSeries[MODEL_INERTIA_TERMS];

/* a phase, its sine and its cosine */
typedef struct {
    Real phase, sine, cosine;
} Wave;

/* all series of one step; the engine fills t, u, x and sign, the model the rest */
typedef struct {
    Series t;
    double time_rest; /* what rounding took from t[0]; only a phase needs it */
    int apart;        /* no contact touches: orders of slip beyond the rate are left out */
    int curved;       /* inputs have more than a rate */
    Wave wave;        /* that was last asked for */
    Series u[MODEL_ROOM(MODEL_NU)];
    Series du[MODEL_ROOM(MODEL_NU)]; /* rates of the inputs */
    Series x[MODEL_ROOM(MODEL_NX)];
    double sign[MODEL_ROOM(MODEL_NC)];             /* of the slip speed of each slipping contact, +1 or -1; else 0 */
    Real memory[MODEL_ROOM(MODEL_NC)];             /* speed at which the contact was last entered */
    Series a[MODEL_ROOM(MODEL_NV)];                /* rates of v without contact forces */
    Series zrate[MODEL_ROOM(MODEL_NZ - MODEL_NE)]; /* of internal states but the elements of arrays */
    Series pile[MODEL_ROOM(MODEL_NC)];             /* of an array: the force of its springs (elements.h) */
    Real moving[MODEL_ROOM(MODEL_NC)];             /* and the stiffness of those that are free */
    int next[MODEL_ROOM(MODEL_NC)];                /* and the state of the one that yields next, -1: none is free */
    signed char held[MODEL_ROOM(MODEL_NE)];
    Series slip[MODEL_ROOM(MODEL_NC)];
    Series slip_rate[MODEL_ROOM(MODEL_NC)];                           /* without contact forces */
    Series capacity[MODEL_ROOM(MODEL_NC)];                            /* largest force in stick */
    Series capacity_minus[MODEL_DIRECTED ? MODEL_ROOM(MODEL_NC) : 1]; /* the largest of its negative */
    Series depth[MODEL_ROOM(MODEL_NC)];                               /* of a contact with bounds; positive inside */
    Series release[MODEL_ROOM(MODEL_NC)]; /* of a stop that releases by force: has the sign of its force */
    Series force[MODEL_ROOM(MODEL_NC)];   /* lambda */
    Series y[MODEL_ROOM(MODEL_NY)];
    InertiaSeries W[MODEL_ROOM(MODEL_NV)][MODEL_ROOM(MODEL_NC)];
    InertiaSeries G[MODEL_ROOM(MODEL_NC)][MODEL_ROOM(MODEL_NC)];
    InertiaSeries M[MODEL_ROOM(MODEL_NM)]; /* the mass matrix where it is factored, and its factors */
    Real factor[MODEL_ROOM(MODEL_NM)];
    Series w[MODEL_ROOM(MODEL_NW)];
    Series unit[MODEL_CONES ? MODEL_ROOM(MODEL_NC) : 1]; /* of the sides of a cone: the direction of its slip */
    unsigned char rising[MODEL_ROOM(MODEL_NC)];          /* the slip of a cone begins here: 1 at zero, 2 near it */
} Jets;

/* the bound of the force in stick of contact c on a side, as a magnitude: +1 of positive forces, -1 of negative ones */
static inline const Real *KIND(stick_bound)(const Jets *j, int c, int side)
{
    return MODEL_DIRECTED && side < 0 ? j->capacity_minus[c] : j->capacity[c];
}

/* the same bound on both sides */
static inline void KIND(stick_mirror)(Jets *j, int c, int k)
{
    if (MODEL_DIRECTED) j->capacity_minus[c][k] = j->capacity[c][k];
}

/* what the matrix of held contacts weighs contact c by, and scales of its force go by: the larger bound */
static inline Real KIND(stick_scale)(const Jets *j, int c)
{
    const int minus = MODEL_DIRECTED && PART(j->capacity_minus[c][0]) > PART(j->capacity[c][0]);
    return KIND(stick_bound)(j, c, minus ? -1 : 1)[0];
}

/* no weight of its own, where the law has no capacity */
static inline void KIND(stick_unweighted)(Jets *j, int c)
{
    j->capacity[c][0] = 0.0;
    KIND(stick_mirror)(j, c, 0);
}

/* the held contacts of a step and the matrix that gives their forces (step/contact_forces.c, equation 1) */
typedef struct {
    int count;
    int contact[MODEL_ROOM(MODEL_NC)];                           /* group by group of those that G connects */
    int first[MODEL_ROOM(MODEL_NC)], last[MODEL_ROOM(MODEL_NC)]; /* of the group of each, and one beyond */
    Real drag[MODEL_ROOM(MODEL_NC)]; /* force of the slipping friction of each, per force of its own */
    Real inverse[MODEL_ROOM(MODEL_NC)][MODEL_ROOM(MODEL_NC)];
} Sticking;

/* what one order makes of the one before (step/linear_factors.c) */
typedef struct {
    Real rate[MODEL_ROOM(MODEL_NH)]; /* of harmonics */
    int still;                       /* one of them has none, and nothing to probe its column with */
    Real row[Z_ROWS][Z_COLUMNS];
    Real order[Z_ROWS][Z_COLUMNS][LINEAR_ORDER]; /* of T and R T, from order 1 */
} LinearFactors;

/* where the flow is: what series start from */
typedef struct {
    Real time;
    double time_rest; /* low part of the time, which rounding of sums took from it */
    Real p[MODEL_ROOM(MODEL_NP)];
    Real d[MODEL_ROOM(MODEL_ND)];
    Real u[MODEL_ROOM(MODEL_NU)];
    Real du[MODEL_ROOM(MODEL_NU)];                           /* rates of the inputs */
    int curved;                                              /* they change */
    Real bend[MODEL_ROOM(MODEL_NU)][MODEL_INPUT_DEGREE - 1]; /* derivatives of the inputs, from the second on */
    double cycle[MODEL_ROOM(MODEL_NS)];                      /* of each signal, whole periods since its start */
    short piece[MODEL_ROOM(MODEL_NS)];                       /* and the knot behind it */
    Real x[MODEL_ROOM(MODEL_NX)];
    signed char state[MODEL_ROOM(MODEL_NC)]; /* ContactState */
    signed char held[MODEL_ROOM(MODEL_NE)];  /* elements of arrays: 1 at the upper bound, -1 at the lower, 0 free */
    Real memory[MODEL_ROOM(MODEL_NC)];       /* speed at which a stop was last entered, 0: never; the largest
                                                           speed of impact of a rigid contact since it was last closed
                                                           */
    double settles[MODEL_ROOM(MODEL_NC)];    /* when the chatter of a rigid contact is over */
    signed char known[MODEL_ROOM(MODEL_NC)][SLOTS]; /* leading coefficients of the indicators known to be zero */
    Sticking sticking;
} Point;

/* a periodic signal: lines between its knots, whose places are in parts of the period */
typedef struct {
    Real period, start, place[MODEL_ROOM(MODEL_NK)], value[MODEL_ROOM(MODEL_NK)];
} Signal;

/* the knots of signal c; returns how many */
int model_signal(const Real *p, const Real *d, int c, Signal *s);

/* constants derived from the parameters: d has MODEL_ND entries */
void model_prepare(const Real *p, Real *d);

/* series slip */
void model_slip(const Real *p, const Real *d, Jets *j, int k);
/* series depth, of contacts that have one; called after slip */
void model_depth(const Real *p, const Real *d, Jets *j, int k);
/* series W and G, M and its factors; with MODEL_CONSTANT_INERTIA only k = 0 is ever asked for */
void model_inertia(const Real *p, const Real *d, Jets *j, int k);
/* series a (reads nothing of the contacts but the sign of those that do not stick); called after inertia */
void model_acceleration(const Real *p, const Real *d, Jets *j, int k);
/* force of contact c while it slips with sign[c], or touches; called after slip, depth and acceleration */
void model_law(const Real *p, const Real *d, Jets *j, int k, int c);
/* series release of contact c; called after slip and depth */
void model_release(const Real *p, const Real *d, Jets *j, int k, int c);
/* slip_rate and capacities of contact c; called after acceleration */
void model_stick(const Real *p, const Real *d, Jets *j, int k, int c);
/* series zrate; called after the forces */
void model_internal(const Real *p, const Real *d, Jets *j, int k);
/* outputs; called last; may read everything above except slip_rate and capacities */
void model_outputs(const Real *p, const Real *d, Jets *j, int k);

/* states after the jump of contact c, from order 0 of the series */
void model_reset(const Real *p, const Real *d, const Jets *j, int c, Real *x);

/* restitution of rigid contact c, and coefficient of the friction c of a rigid contact */
Real model_restitution(const Real *p, const Real *d, int c);
Real model_friction(const Real *p, const Real *d, int c);
