/*
 * The numbers of one motion's flow: per mode of the contacts its linear field and guards; for the modes in which a motion
 * is most of the time ("home") the exact step of a grid over the period.
 *
 *     z = (states, cos and sin of each harmonic);  x' = A z + a  on one mode, guards  R z + r >= 0
 *     home:  x(t + h) = exp(A h) x(t) + forced[k],  no guard falls if min(g0, g1) > h^2/8 max|g''|
 *
 * In a mode with a stop that touches, the origin of the states is moved onto its wall ("shift"): the force of a stiff
 * stop would otherwise be the difference of two large numbers.
 */
#ifndef STICKSLIP_LANE_TABLE_H
#define STICKSLIP_LANE_TABLE_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "../../engine/ensemble/lane_stepper.h"
#include "../../engine/model_lanes.h"

enum {
    LANES_NH = MODEL_ROOM(LANES_HARMONICS),
    LANES_Z = MODEL_NX + 2 * LANES_HARMONICS,
    LANES_NF = MODEL_ROOM(LANES_FLOW),
    LANES_NG = MODEL_ROOM(LANES_GUARDS),
    LANES_NR = MODEL_ROOM(LANES_GUARD_ENTRIES),
    LANES_NHOME = MODEL_ROOM(LANES_HOME_ENTRIES),
    LANES_NBOUND = MODEL_ROOM(LANES_BOUND_ENTRIES),
    /* steps of the grid, at most */
    LANES_GRID = 128,
    LANES_POWERS = 8 /* of two, up to that */
};

enum { KIND_STOP = 0, KIND_IMPACT = 1, KIND_SWITCH = 2 };

typedef struct {
    signed char state[NC];
    int home;    /* which home step is its own; -1: none */
    int on_grid; /* its flow is that of a home mode */
    int crossed[NC]; /* the mode on the other side of a switch */
    double rate, longest;
    double shift[MODEL_NX];
    double flow[LANES_NF], constant[MODEL_NX];
    double guard[LANES_NR], guard_constant[LANES_NG];
    /* what a guard is beyond its terms of third order is at most h^4 (tail |x| + tail_constant), over a sub-step of h */
    double tail[LANES_NG][MODEL_NX], tail_constant[LANES_NG];
    /* away from home: states and harmonics after the longest sub-step */
    double stride[MODEL_NX][LANES_Z + 1], turn[2 * LANES_NH];
} LaneMode;

typedef struct {
    double step[LANES_STEP], forced[LANES_GRID][MODEL_NX];
    double power[LANES_POWERS][LANES_STEP]; /* 1, 2, 4, ... steps, without what is forced */
    double guard[LANES_NHOME], guard_constant[LANES_GRID + 1][NC];
    double bound[LANES_NBOUND], bound_constant[NC];
} HomeStep;

typedef struct {
    int usable;
    double p[MODEL_ROOM(MODEL_NP)], u[MODEL_ROOM(MODEL_NU)], origin, period;
    int steps; /* of the grid */
    double h;
    double wave[LANES_NH], phasor[LANES_GRID + 1][2 * LANES_NH];
    /* of rigid contacts: y of their impulse by row, and what a unit of it does */
    double approach[NC][LANES_Z + 1], push[NC][MODEL_NX], restitution[NC];
    double depth[NC][LANES_Z + 1];
    double entry_release[NC][2]; /* of stops: factor of the rate, and the rest, in the force that lets go */
    LaneMode mode[LANES_MODES];
    HomeStep home[LANES_HOMES];
} LaneTable;

/* fill it; 0 where these values are none for lanes */
int table_make(LaneTable *t, const double *p, const double *u, double origin, double period);
/* the mode of contact states; -1 if lanes have none for it */
int table_mode(const signed char *state);

#endif
