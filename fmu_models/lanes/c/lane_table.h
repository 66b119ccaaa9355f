/*
 * The numbers of one motion's flow: per mode of the contacts its linear field and guards; for the modes in which a motion
 * is most of the time ("home") the exact step of a grid over the period.
 *
 *     z = (states, cos and sin of each harmonic);  x' = A z + a  on one mode, guards  R z + r >= 0
 *     home:  x(t + h) = exp(A h) x(t) + forced[k],  no guard falls if min(g0, g1) > h^2/8 max|g''|, nor if the cubic
 *            through values and rates at both ends stays above h^4/384 max|g''''|
 *
 * In a mode with a stop that touches, the origin of the states is moved onto its wall ("shift"): the force of a stiff
 * stop would otherwise be the difference of two large numbers.
 */
#pragma once

#include <math.h>
#include <stdlib.h>
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
    LANES_NHG = MODEL_ROOM(LANES_HOME_GUARDS),
    /* steps of the grid, at most, and of how many points there are numbers: those of what nothing forces are all alike */
    LANES_GRID = LANES_HARMONICS > 0 ? 128 : 4096,
    LANES_POINTS = LANES_HARMONICS > 0 ? LANES_GRID + 1 : 1
};

/* which numbers those of point k of the grid are */
static inline int lane_point(int k) { return LANES_HARMONICS > 0 ? k : 0; }

/* rate times length of a step, over which a series of LANES_ORDER terms leaves rounding */
#define LANES_REACH 0.42

/* of the fastest impact: the engine completes a chatter from here on (Tolerances.chatter) */
#define LANES_CHATTER 1e-8
/* of the terms of a gap: nearer is at the wall; with room for the rounding of both */
#define LANES_AT_WALL 1e-12
/* of the terms of its rate: a switch that is crossed more slowly may slide along it to rounding */
#define LANES_ALONG 1e-9

/* what a guard watches: depth, gap or the force of a closed contact; release, slip, function or the margin of stick on
   its plus side; on its other side */
enum { GUARD_NORMAL = 0, GUARD_TANGENTIAL = 1, GUARD_MARGIN = 2 };

/* the rows of a mode in full: flow, and guards */
typedef struct {
    double flow[MODEL_NX][LANES_Z + 1], guard[LANES_NG][LANES_Z + 1];
} Full;

typedef struct {
    signed char state[NC];
    int usable;      /* its held contacts have forces, which the motion says */
    int home;        /* which home step is its own; -1: none */
    int on_grid;     /* its flow is that of a home mode */
    int with[NC][3]; /* modes with other states of one contact, as digits have them (lane_modes.c) */
    int plain;       /* an impact of a smooth wall changes nothing but velocities */
    int held_count;  /* contacts that forces hold */
    int walled;      /* its origin lies on the wall of a stop */
    double rate, longest;
    double shift[MODEL_NX];
    double flow[LANES_NF], constant[MODEL_NX];
    double guard[LANES_NR], guard_constant[LANES_NG];
    /* what a guard is beyond its terms of third order is at most h^4 (tail |x| + tail_constant), over a sub-step of h */
    double tail[LANES_NG][MODEL_NX], tail_constant[LANES_NG];
    /* away from home: states and harmonics after the longest sub-step */
    double stride[MODEL_NX][LANES_Z + 1], turn[2 * LANES_NH];
    /* those contacts, and what a slip speed of one, or its depth in a wall, adds to the states so that it has
       none */
    int held[NC];
    double no_slip[NC][MODEL_NX], on_wall[NC][MODEL_NX];
    Full full;
} LaneMode;

typedef struct {
    double step[LANES_STEP], forced[LANES_POINTS][MODEL_NX];
    double guard[LANES_NHOME], guard_constant[LANES_POINTS][LANES_NHG];
    double bound[LANES_NBOUND], bound_constant[LANES_NHG];
    /* a third of a step of the rates of guards, and what these are beyond their terms of third order */
    double slope[LANES_NBOUND], slope_constant[LANES_POINTS][LANES_NHG];
    double tail[LANES_NBOUND], tail_constant[LANES_NHG];
} HomeStep;

typedef struct {
    int usable;
    double p[MODEL_ROOM(MODEL_NP)], u[MODEL_ROOM(MODEL_NU)], period;
    int steps; /* of the grid */
    double h;
    double wave[LANES_NH], phase[LANES_NH], phasor[LANES_POINTS][2 * LANES_NH];
    /* of rigid contacts: y of their impulse by row, and what a unit of it does */
    double approach[NC][LANES_Z + 1], push[NC][MODEL_NX], restitution[NC];
    double depth[NC][LANES_Z + 1];
    double W[MODEL_NX][NC], G[NC][NC], mu[NC];
    signed char unique[NC];        /* what one contact alone decides has one solution (lane_transition.c) */
    double entry_release[NC][2];   /* of stops: factor of the rate, and the rest, in the force that lets go */
    signed char made[LANES_MODES]; /* modes that are, the others when a motion comes to them */
    LaneMode mode[LANES_MODES];
    HomeStep home[LANES_HOMES];
} LaneTable;

/* whether a force holds contact c: it sticks, slides or is closed */
static inline int lane_holds(const signed char *state, int c)
{
    return lanes_impulsive[c] ? state[c] == CONTACT_TOUCHING : state[c] == CONTACT_STICK;
}
