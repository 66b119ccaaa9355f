/*
 * Derivatives of a motion along directions in start state and parameters, carried through steps and events.
 *
 * A tangent is a second copy of the point, in numbers a + i eps b: a is the motion itself, b its derivative. The run
 * decides (length, events, states of contacts), in steps no longer than the tangents allow; each tangent repeats the
 * arithmetic of the step:
 *
 *     series of the step from its own point, to the full order: it need not end where that of the motion does (at rest)
 *     end of the step:   at a fixed time t      since = t - time
 *                        at an event            since with indicator(since) = 0, one Newton step from the run's value
 *     point = series(since); time = time + since
 *     the event's jump, speed of entry and projection, as the run made them
 *
 * Its time has an imaginary part after an event: the event comes later or earlier for a neighbour. So what saltation
 * matrices say of transitions is derived, for every kind of contact, by evaluating the same series at a complex time.
 * Undefined where an indicator falls without speed (grazing, corners): a neighbour may have another sequence of events.
 *
 * Sources: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7 (saltation);
 * Squire and Trapp, SIAM Review 40 (1998) (derivatives by complex arithmetic).
 */
#include <stdlib.h>

#include "tangent.h"

#include "kind_tangent.h"

#include "model_kind.h"
#include "flow.h"
#include "jets.h"
#include "model_kind.c"
#include "contact.c"
#include "flow.c"

struct Tangents {
    Point at;
    Jets jets;
    int expanded; /* jets holds the series in time from the point */
};

/* so small that its square vanishes, so large that nothing underflows */
#define EPS 1e-100

static Real with_tangent(double value, double derivative)
{
    return value + EPS * derivative * _Complex_I;
}

/* the tangent's own derivative on the run's value: both have moved by the same arithmetic, up to rounding */
static void rejoin(const Run *r, Tangents *t)
{
    for (int i = 0; i < MODEL_NX; i++) {
        t->at.x[i] = r->at.x[i] + cimag(t->at.x[i]) * _Complex_I;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        t->at.memory[c] = r->at.memory[c] + cimag(t->at.memory[c]) * _Complex_I;
    }
    t->at.time = r->at.time + cimag(t->at.time) * _Complex_I;
    t->at.time_rest = r->at.time_rest;
    memcpy(t->at.state, r->at.state, sizeof t->at.state);
    memcpy(t->at.settles, r->at.settles, sizeof t->at.settles);
    memcpy(t->at.known, r->at.known, sizeof t->at.known);
}

static void start(const Run *r, Tangents *t, const double *dx, const double *dp)
{
    for (int i = 0; i < MODEL_NX; i++) {
        t->at.x[i] = with_tangent(r->at.x[i], dx ? dx[i] : 0.0);
    }
    for (int i = 0; i < MODEL_NP; i++) {
        t->at.p[i] = with_tangent(r->at.p[i], dp ? dp[i] : 0.0);
    }
    for (int i = 0; i < MODEL_NU; i++) {
        t->at.u[i] = r->at.u[i];
        t->at.du[i] = r->at.du[i];
    }
    rejoin(r, t);
    model_prepare(t->at.p, t->at.d);
    model_inertia(t->at.p, t->at.d, &t->jets, 0);
}

Tangents *tangent_new(const Run *r, int n, const double *states, const double *parameters)
{
    Tangents *tangents = calloc((size_t)n + 1, sizeof *tangents);
    for (int i = 0; tangents && i < n; i++) {
        start(r, &tangents[i], states ? states + i * MODEL_NX : NULL, parameters ? parameters + i * MODEL_NP : NULL);
    }
    return tangents;
}

void tangent_free(Tangents *tangents)
{
    free(tangents);
}

void tangent_results(const Tangents *tangents, int n, double *derivatives)
{
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < MODEL_NX; i++) {
            derivatives[k * MODEL_NX + i] = cimag(tangents[k].at.x[i]) / EPS;
        }
    }
}

static Real value_at(const Real *c, int n, Real s, Real *slope)
{
    Real value = c[n];
    Real derivative = 0.0;
    for (int k = n - 1; k >= 0; k--) {
        derivative = derivative * s + value;
        value = value * s + c[k];
    }
    if (slope) {
        *slope = derivative;
    }
    return value;
}

/* the falling indicator of the step, up to its sign, and the order to which it is known */
static int falling_series(const Run *r, const Jets *j, double s, Real *series)
{
    const int order = taylor_order(r);
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            if (!r->falling[c][slot]) {
                continue;
            }
            if (r->at.state[c] == CONTACT_CHATTERING && slot == SLOT_NORMAL) {
                continue; /* its end changes nothing but the name of its state */
            }
            const int closed = model_contact_is_impact[c] && r->at.state[c] != CONTACT_AWAY;
            const int margin = slot == SLOT_TANGENTIAL && r->at.state[c] == CONTACT_STICK;
            const Real *source = closed ? j->force[c] : slot == SLOT_NORMAL ? j->depth[c] : model_contact_is_stop[c] ? j->release[c] : j->slip[c];
            const double side = margin && creal(value_at(j->force[c], order - 1, s, NULL)) < 0.0 ? -1.0 : 1.0;
            for (int k = 0; k <= order - (margin || closed); k++) {
                series[k] = margin ? j->capacity[c][k] - side * j->force[c][k] : source[k];
            }
            return order - (margin || closed);
        }
    }
    return -1;
}

/* the length over which the derivatives of the states keep the tolerance */
static double shortest_length(const Run *r, Tangents *tangents, int n)
{
    const int order = taylor_order(r);
    double shortest = INFINITY;
    for (int k = 0; k < n; k++) {
        flow_series(&tangents[k].at, &tangents[k].jets, order);
        tangents[k].expanded = 1;
        for (int i = 0; i < MODEL_NX; i++) {
            double derivative[POLYNOMIAL_TERMS];
            for (int m = 0; m <= order; m++) {
                derivative[m] = cimag(tangents[k].jets.x[i][m]) / EPS;
            }
            const double length = taylor_series_length(derivative, order, r->tolerances.step);
            shortest = length > 0.0 ? fmin(shortest, length) : shortest; /* a step in the root of time has no series here */
        }
    }
    return shortest;
}

static int follow(const Run *r, Tangents *t, double length, int at_event)
{
    Jets *j = &t->jets;
    const int full = taylor_order(r);
    if (r->segment_rooted) {
        flow_rooted_series(&t->at, j, full);
    } else if (!t->expanded) {
        flow_series(&t->at, j, full);
    }
    t->expanded = 0;
    Real since = length - cimag(t->at.time) * _Complex_I;
    Real s = r->segment_rooted ? sqrt(since) : since;
    if (at_event) {
        Real series[POLYNOMIAL_TERMS];
        Real slope;
        const double here = r->segment_rooted ? sqrt(length) : length;
        const int order = falling_series(r, j, here, series);
        if (order >= 0) {
            const Real value = value_at(series, order, here, &slope);
            s = here - cimag(value) / creal(slope) * _Complex_I;
            since = r->segment_rooted ? s * s : s;
        }
    }
    for (int i = 0; i < MODEL_NX; i++) {
        t->at.x[i] = value_at(j->x[i], full, s, NULL);
    }
    for (int i = 0; i < MODEL_NU; i++) {
        t->at.u[i] += t->at.du[i] * since;
    }
    t->at.time += since;
    return isfinite(cimag(s));
}

/* the impact with the impulses that the run has found to fit */
static void repeat_impact(const Run *r, Tangents *t)
{
    Jets *j = &t->jets;
    Real impulse[NC] = {0.0};
    Real given[NC];
    Real target[NC];
    if (!MODEL_CONSTANT_INERTIA) {
        model_inertia(t->at.p, t->at.d, j, 0);
    }
    for (int number = 0; number < r->impact_phases; number++) {
        contact_targets(&t->at, j, number, impulse, given, target);
        contact_impulse(&t->at, j, &r->impact[number], given, target, impulse);
        contact_apply(&t->at, j, impulse);
    }
}

static void repeat_event(const Run *r, Tangents *t)
{
    Jets *j = &t->jets;
    int any = 0;
    flow_load(&t->at, j, 0);
    model_slip(t->at.p, t->at.d, j, 0);
    for (int c = 0; c < MODEL_NC; c++) {
        if (r->entered[c]) {
            t->at.memory[c] = creal(j->slip[c][0]) < 0.0 ? -j->slip[c][0] : j->slip[c][0];
        }
        if (r->jumped[c]) {
            model_reset(t->at.p, t->at.d, j, c, t->at.x);
        }
        any |= r->projected[c];
    }
    repeat_impact(r, t);
    memcpy(t->at.state, r->at.state, sizeof t->at.state);
    if (any) {
        flow_load(&t->at, j, 0);
        flow_field(&t->at, j, 0, 0);
        for (int c = 0; c < MODEL_NC; c++) {
            if (r->at.state[c] != CONTACT_STICK) {
                j->capacity[c][0] = 0.0;
            }
        }
        contact_project(&t->at, j, r->projected);
    }
}

RunStatus tangent_advance(Run *r, double end, Tangents *tangents, int n)
{
    double rest;
    while (r->at.time < end || (r->segment_valid && r->segment_event && segment_end(r, &rest) <= end)) {
        if (!r->segment_valid
            && taylor_step(r, fmin(step_limit(r, end), shortest_length(r, tangents, n))) == RUN_ERROR) {
            return RUN_ERROR;
        }
        const int inside = segment_end(r, &rest) > end;
        const int at_event = !inside && r->segment_event;
        const double length = inside ? (end - r->segment_start) - r->jets.time_rest : r->segment_length;
        for (int i = 0; i < n; i++) {
            if (!follow(r, &tangents[i], length, at_event)) {
                return run_fail(r, "the motion has no derivative at t = %.17g: it touches the bound of a contact there without "
                                   "crossing it, and neighbours may or may not", r->segment_start + length);
            }
        }
        if (inside) {
            evaluate_segment(r, end, length);
            r->at.time_rest = 0.0;
            run_touched(r);
        } else {
            if (r->segment_length > 0.0) {
                r->stalled = 0;
            }
            finish_segment(r);
            memset(r->at.known, 0, sizeof r->at.known);
            if (at_event && events_resolve(r, NULL, NULL) == RUN_ERROR) {
                return RUN_ERROR;
            }
            r->segment_event = 0;
        }
        for (int i = 0; i < n; i++) {
            if (at_event) {
                repeat_event(r, &tangents[i]);
            }
            rejoin(r, &tangents[i]);
        }
    }
    return RUN_OK;
}

#include "kind_real.h"
