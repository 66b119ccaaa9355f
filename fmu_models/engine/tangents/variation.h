/*
 * Variations: the series of a step differentiated along directions, two at a time, side by side. Everything that the
 * model computes is linear in them once the series of the motion are there, which all directions share.
 */
#pragma once

#include "pair.h"

enum { LINEAR_CHANGES = MODEL_LINEAR ? Z_ROWS * Z_COLUMNS : 1 };

/* of the factors of a mode (LinearMode) */
typedef struct {
    int known;
    signed char state[NC];
    short first[Z_ROWS + 1]; /* entry, of each row */
    unsigned char column[LINEAR_CHANGES];
    Pair rate[MODEL_ROOM(MODEL_NH)];
    Pair factor[LINEAR_CHANGES][LINEAR_ORDER];
} LinearChange;

/* derivatives of what Jets and Point have under the same names */
typedef struct {
    int moved;     /* a parameter has a derivative */
    int order;     /* to which the series hold; 0: they do not */
    int pushed;    /* some contact is not away */
    double ending; /* the series run in this less the root of the time that is left, if it is not 0 */
    Pair p[MODEL_ROOM(MODEL_NP)];
    Pair d[MODEL_ROOM(MODEL_ND)];
    Pair memory[MODEL_ROOM(MODEL_NC)];
    Pair friction[MODEL_ROOM(MODEL_NC)]; /* coefficients of the friction of rigid contacts */
    PairSeries t;
    PairSeries u[MODEL_ROOM(MODEL_NU)];
    PairSeries du[MODEL_ROOM(MODEL_NU)];
    PairSeries x[MODEL_ROOM(MODEL_NX)];
    PairSeries a[MODEL_ROOM(MODEL_NV)];
    PairSeries zrate[MODEL_ROOM(MODEL_NZ - MODEL_NE)];
    PairSeries pile[MODEL_ROOM(MODEL_NC)];
    Pair moving[MODEL_ROOM(MODEL_NC)];
    PairSeries slip[MODEL_ROOM(MODEL_NC)];
    PairSeries slip_rate[MODEL_ROOM(MODEL_NC)];
    PairSeries capacity[MODEL_ROOM(MODEL_NC)];
    PairSeries capacity_minus[MODEL_DIRECTED ? MODEL_ROOM(MODEL_NC) : 1];
    PairSeries depth[MODEL_ROOM(MODEL_NC)];
    PairSeries release[MODEL_ROOM(MODEL_NC)];
    PairSeries force[MODEL_ROOM(MODEL_NC)];
    InertiaPairs W[MODEL_ROOM(MODEL_NV)][MODEL_ROOM(MODEL_NC)];
    InertiaPairs G[MODEL_ROOM(MODEL_NC)][MODEL_ROOM(MODEL_NC)];
    InertiaPairs M[MODEL_ROOM(MODEL_NM)];
    PairSeries w[MODEL_ROOM(MODEL_NW)];
    PairSeries square[MODEL_ROOM(MODEL_NR)]; /* of reciprocals of the motion, the same in every direction */
    Pair here[MODEL_ROOM(MODEL_NX)];         /* of the states, at the time evaluated at */
    int bends;                               /* inverse has derivatives */
    Pair inverse[MODEL_ROOM(MODEL_NC)][MODEL_ROOM(MODEL_NC)]; /* of Sticking */
    LinearChange change[LINEAR_MODES];                        /* where a parameter has a derivative */
} Variation;

/* who knows the derivatives of the matrix of the held contacts (Sticking) at the start of a step */
typedef void (*HeldVariation)(void *of, const Run *r, Variation *l);

/* all series to an order, from the first orders of t, u and x, from memory and parameters, on top of those of the
   motion, which must hold to that order */
void variation_series(const Run *r, Variation *l, int order, HeldVariation held, void *of);
/* the order up to which the series of the states are numbers: just before a force that is a root of the depth lets go,
   high orders grow beyond all, and the step is so short that they do not matter */
int variation_order(const Jets *j, const Variation *l, int order);
/* the series of the motion over the step in use in s0 less the root of the time that is left, in r->scratch, where
   variations with `ending` find them, and of its rates, to the order before; returns s0 */
double variation_ending(Run *r, int order, double (*rate)[MODEL_TERMS + 1]);
/* the variable of the series at a time since the start of the step */
double variation_variable(const Run *r, const Variation *l, double length);
