/*
 * Derivatives of a motion along directions in start state, parameters and inputs, carried through steps and events.
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
 * To rounding that is where its slope is below the tolerance `graze`. Where several indicators fall at one instant, at
 * times that depend on the direction in different ways, the derivative holds on one side only: a corner, which is told.
 *
 * Sources: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7
 *          (saltation);
 * Squire and Trapp, SIAM Review 40 (1998) (derivatives by complex arithmetic).
 */
#include "tangent.h"

#include "../events/run.h"
#include "../events/transition.h"
#include "../step/roots.h"
#include "../step/taylor.h"

#include "tangent_series.h"

/* the model and the flow once more, for numbers with a tangent; jets.h first */
#include "../model/jets.h"
#include "../model/mass_matrix.h"

#include "../model_kind.c"
#include "../step/contact_factor.c"
#include "../step/contact_forces.c"
#include "../step/flow.c"

/* derivatives below here count as zero: what they lead to would lose its digits below the least number there is */
static const double SMALLEST = 1e-150;

/* a number of the run with the derivative that the tangent has */
static Real joined(double value, Real own)
{
    const double derivative = cimag(own);
    return value + (fabs(derivative) < SMALLEST * EPS ? 0.0 : derivative) * _Complex_I;
}

/* the tangent's own derivative on the run's value: both have moved by the same arithmetic, up to rounding */
static void rejoin(const Run *r, Tangent *t)
{
    for (int i = 0; i < MODEL_NX; i++) {
        t->at.x[i] = joined(r->at.x[i], t->at.x[i]);
    }
    for (int i = 0; i < MODEL_NU; i++) {
        t->at.u[i] = joined(r->at.u[i], t->at.u[i]);
        t->at.du[i] = r->at.du[i];
    }
    for (int c = 0; c < MODEL_NC; c++) {
        t->at.memory[c] = joined(r->at.memory[c], t->at.memory[c]);
    }
    t->at.time = joined(r->at.time, t->at.time);
    t->at.time_rest = r->at.time_rest;
    memcpy(t->at.state, r->at.state, sizeof t->at.state);
    memcpy(t->at.settles, r->at.settles, sizeof t->at.settles);
    memcpy(t->at.known, r->at.known, sizeof t->at.known);
    t->order = 0;
}

size_t tangents_room(int n)
{
    return sizeof(Tangents) + (size_t)n * (sizeof(Tangent) + MODEL_NX * (MODEL_TERMS + 1) * sizeof(double));
}

Tangents *tangents_start(void *room, const Run *r, int n)
{
    Tangents *tangents = memset(room, 0, tangents_room(n));
    tangents->count = n;
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < MODEL_NP; i++) {
            tangents->list[k].at.p[i] = r->at.p[i];
        }
        rejoin(r, &tangents->list[k]);
    }
    return tangents;
}

void tangents_along(Tangents *tangents, int k, Along what, int index)
{
    Point *at = &tangents->list[k].at;
    Real *start = what == ALONG_STATE ? at->x : what == ALONG_INPUT ? at->u : what == ALONG_MEMORY ? at->memory : at->p;
    start[index] += EPS * _Complex_I;
    model_prepare(at->p, at->d);
    model_inertia(at->p, at->d, &tangents->list[k].jets, 0);
}

int tangents_corners(const Tangents *tangents)
{
    int corners = 0;
    for (int k = 0; k < tangents->count; k++) {
        corners += tangents->list[k].corner;
    }
    return corners;
}

double tangents_event(const Tangents *tangents, int k)
{
    const Tangent *t = &tangents->list[k];
    return t->untimed ? NAN : cimag(t->at.time) / EPS;
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

/* derivatives up to here are exact: EPS times it is small enough for its square to vanish */
static const double LARGEST = 1e80;

/* of the times of two events at one instant: by so much of themselves their derivatives may differ by rounding */
static const double SAME_RATE = 1e-6;

/* whether a derivative is so large that it would be wrong before long */
static int overflows(const Tangent *t)
{
    double largest = fabs(cimag(t->at.time));
    for (int i = 0; i < MODEL_NX; i++) {
        const double size = fabs(cimag(t->at.x[i]));
        largest = size > largest || isnan(size) ? size : largest;
    }
    return !(largest <= LARGEST * EPS);
}

/* the first contact with a falling indicator */
static const char *falling_contact(const Run *r)
{
    int c = 0;
    while (c < MODEL_NC - 1 && !r->falling[c][SLOT_NORMAL] && !r->falling[c][SLOT_TANGENTIAL]) {
        c++;
    }
    return model_contact_names[c];
}

/* an indicator that falls at the end of the step, up to its sign, and the order to which it is known; -1 if it does not
   fall */
static int falling_series(const Run *r, const Jets *j, int c, int slot, int order, double s, Real *series)
{
    /* the end of a chatter changes nothing but the name of its state */
    if (!r->falling[c][slot] || (r->at.state[c] == CONTACT_CHATTERING && slot == SLOT_NORMAL)) {
        return -1;
    }
    const int closed = model_contact_is_impact[c] && r->at.state[c] != CONTACT_AWAY;
    const int margin = slot == SLOT_TANGENTIAL && r->at.state[c] == CONTACT_STICK;
    const Real *source = closed                     ? j->force[c]
                         : slot == SLOT_NORMAL      ? j->depth[c]
                         : model_contact_is_stop[c] ? j->release[c]
                                                    : j->slip[c];
    const double side = margin && creal(value_at(j->force[c], order - 1, s, NULL)) < 0.0 ? -1.0 : 1.0;
    for (int k = 0; k <= order - (margin || closed); k++) {
        series[k] = margin ? j->capacity[c][k] - side * j->force[c][k] : source[k];
    }
    return order - (margin || closed);
}

/* the order up to which the series of the states are numbers: just before a force that is a root of the depth lets go,
   high orders grow beyond all, and the step is so short that they do not matter */
static int finite_order(const Jets *j, int order)
{
    for (int k = 0; k <= order; k++) {
        for (int i = 0; i < MODEL_NX; i++) {
            if (!isfinite(creal(j->x[i][k])) || !isfinite(cimag(j->x[i][k]) / EPS)) {
                return k - 1;
            }
        }
    }
    return order;
}

/* of the relative size that a derivative has in its largest part: what is smaller than this in others need not be exact */
static const double NEGLIGIBLE = 1e-6;

static double state_size(const Run *r, int i) { return fabs(r->at.x[i]) + model_nominal_states[i]; }

/* the largest derivative along a direction, relative to what it is of */
static double relative_size(const Run *r, const Tangent *t)
{
    double largest = 0.0;
    for (int i = 0; i < MODEL_NX; i++) {
        largest = fmax(largest, fabs(cimag(t->at.x[i])) / state_size(r, i));
    }
    for (int c = 0; c < MODEL_NC; c++) {
        largest = r->at.memory[c] > 0.0 ? fmax(largest, fabs(cimag(t->at.memory[c])) / r->at.memory[c]) : largest;
    }
    for (int i = 0; i < MODEL_NP; i++) {
        largest = r->at.p[i] != 0.0 ? fmax(largest, fabs(cimag(t->at.p[i]) / r->at.p[i])) : largest;
    }
    return largest / EPS;
}

/* the length over which the derivatives of the states keep the tolerance */
static double shortest_length(const Run *r, Tangents *tangents)
{
    const int full = taylor_order(r);
    double shortest = INFINITY;
    for (int k = 0; k < tangents->count; k++) {
        Tangent *t = &tangents->list[k];
        flow_series(&t->at, &t->jets, full);
        const int order = t->order = finite_order(&t->jets, full);
        const double least = NEGLIGIBLE * relative_size(r, t);
        for (int i = 0; i < MODEL_NX; i++) {
            double derivative[POLYNOMIAL_TERMS];
            for (int m = 0; m <= order; m++) {
                derivative[m] = cimag(t->jets.x[i][m]) / EPS;
            }
            derivative[0] = fmax(fabs(derivative[0]), least * state_size(r, i));
            const double length = taylor_series_length(derivative, order, r->tolerances.step);
            shortest = length > 0.0 ? fmin(shortest, length) : shortest;
        }
    }
    return shortest;
}

/* whether a series falls to zero at s with a speed: not within rounding of a double root */
static int falls_with_speed(const Run *r, const Real *series, int order, double s, double slope)
{
    double size = 0.0;
    for (int k = order; k > 0; k--) {
        size = size * s + fabs(creal(series[k]));
    }
    return fabs(slope) > r->tolerances.graze * size;
}

/* by how much the event at s comes later for the tangent, by the first indicator that falls there; 0 where it has no
   derivative. Others that fall at the same instant, but not for the tangent, make it a corner */
static int shift_of_event(const Run *r, Tangent *t, double s, double *later)
{
    t->untimed = 1;
    *later = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            Real series[POLYNOMIAL_TERMS];
            Real slope;
            const int order = falling_series(r, &t->jets, c, slot, t->order, s, series);
            if (order < 0) {
                continue;
            }
            const double value = cimag(value_at(series, order, s, &slope));
            const int has_speed = falls_with_speed(r, series, order, s, creal(slope));
            const double shift = -value / creal(slope);
            if (t->untimed && !has_speed) {
                return 0;
            }
            if (t->untimed) {
                t->untimed = 0;
                *later = shift;
            } else if (!has_speed || !(fabs(shift - *later) <= SAME_RATE * (fabs(shift) + fabs(*later)))) {
                t->corner = 1;
            }
        }
    }
    return 1;
}

/* to the end of the step; 0 where that has no derivative */
static int follow(const Run *r, Tangent *t, double length, int at_event)
{
    const Jets *j = &t->jets;
    Real since = since_start(t, length);
    Real s = r->segment_rooted ? sqrt(since) : since;
    t->untimed = 0;
    if (at_event) {
        const double here = r->segment_rooted ? sqrt(length) : length;
        double later;
        if (!shift_of_event(r, t, here, &later)) {
            return 0;
        }
        if (!t->untimed) {
            s = here + later * _Complex_I;
            since = r->segment_rooted ? s * s : s;
        }
    }
    for (int i = 0; i < MODEL_NX; i++) {
        t->at.x[i] = value_at(j->x[i], t->order, s, NULL);
    }
    for (int i = 0; i < MODEL_NU; i++) {
        t->at.u[i] += t->at.du[i] * since;
    }
    t->at.time += since;
    return 1;
}

/* the impact with the impulses that the run has found to fit */
static void repeat_impact(const Run *r, Tangent *t)
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

/* what the run has done to its contacts and states at this instant */
static void repeat_event(const Run *r, Tangent *t)
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
    rejoin(r, t);
}

void tangents_choose(const Run *r, Tangents *tangents)
{
    for (int k = 0; k < tangents->count; k++) {
        Tangent *t = &tangents->list[k];
        for (int i = 0; i < MODEL_NU; i++) {
            t->at.u[i] = r->at.u[i] + cimag(t->at.u[i]) * _Complex_I;
            t->at.du[i] = r->at.du[i];
        }
        repeat_event(r, t);
    }
}

void tangents_hold(Tangents *tangents)
{
    for (int k = 0; k < tangents->count; k++) {
        Tangent *t = &tangents->list[k];
        const Real since = since_start(t, 0.0);
        if (cimag(since) == 0.0) {
            continue;
        }
        flow_load(&t->at, &t->jets, 0);
        flow_field(&t->at, &t->jets, 0, 0);
        flow_extend(&t->jets, 1, 0);
        for (int i = 0; i < MODEL_NX; i++) {
            t->at.x[i] += t->jets.x[i][1] * since;
        }
        for (int i = 0; i < MODEL_NU; i++) {
            t->at.u[i] += t->at.du[i] * since;
        }
        t->at.time = creal(t->at.time);
        t->order = 0;
    }
}

void tangents_place(const Run *r, Tangents *tangents, int k, const double *direction)
{
    Point *at = &tangents->list[k].at;
    rejoin(r, &tangents->list[k]);
    for (int i = 0; i < MODEL_NX; i++) {
        at->x[i] = r->at.x[i] + EPS * direction[i] * _Complex_I;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        at->memory[c] = r->at.memory[c] + EPS * direction[MODEL_NX + c] * _Complex_I;
    }
    at->time = r->at.time + EPS * direction[MODEL_NX + MODEL_NC] * _Complex_I;
}

void tangents_read(const Tangents *tangents, int k, double *direction)
{
    const Point *at = &tangents->list[k].at;
    for (int i = 0; i < MODEL_NX; i++) {
        direction[i] = cimag(at->x[i]) / EPS;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        direction[MODEL_NX + c] = cimag(at->memory[c]) / EPS;
    }
    direction[MODEL_NX + MODEL_NC] = cimag(at->time) / EPS;
}

RunStatus tangents_expand(Run *r, Tangents *tangents, double end, double *until)
{
    double rest;
    if (!r->segment_valid) {
        const double limit = run_step_limit(r, end);
        /* where a step runs in the root of time there is no series in time */
        const double length = taylor_starts_rooted(r) ? limit : fmin(limit, shortest_length(r, tangents));
        if (run_check_pace(r) == RUN_ERROR || taylor_step(r, length) == RUN_ERROR) {
            return RUN_ERROR;
        }
        for (int k = 0; k < tangents->count; k++) {
            Tangent *t = &tangents->list[k];
            if (r->segment_rooted) {
                t->order = taylor_order(r);
                flow_rooted_series(&t->at, &t->jets, t->order);
            }
        }
    }
    tangents->gathered = 0;
    *until = fmin(end, run_segment_end(r, &rest));
    return RUN_OK;
}

RunStatus tangents_move(Run *r, Tangents *tangents, double end, EventSink sink, void *context)
{
    double rest;
    const int inside = run_segment_end(r, &rest) > end;
    const int at_event = !inside && r->segment_event;
    const double length = inside ? (end - r->segment_start) - r->jets.time_rest : r->segment_length;
    for (int k = 0; k < tangents->count; k++) {
        if (!follow(r, &tangents->list[k], length, at_event)) {
            return run_fail(
                r,
                "the motion has no derivative at t = %.17g: it touches the bound of contact '%s' there without "
                "crossing it, and neighbours may or may not. Start elsewhere, or change a parameter a little",
                r->segment_start + length, falling_contact(r));
        }
    }
    if (inside) {
        run_move_inside(r, end, length);
        run_touched(r);
    } else {
        if (r->segment_length > 0.0) {
            r->stalled = 0;
        }
        run_finish_segment(r);
        memset(r->at.known, 0, sizeof r->at.known);
        if (!at_event && run_keep_without_slip(r) == RUN_ERROR) {
            return RUN_ERROR;
        }
        r->segment_event = 0;
        if (at_event && transition_resolve(r, sink, context) == RUN_ERROR) {
            return RUN_ERROR;
        }
    }
    for (int k = 0; k < tangents->count; k++) {
        if (at_event) {
            repeat_event(r, &tangents->list[k]);
        } else {
            rejoin(r, &tangents->list[k]);
        }
        if (overflows(&tangents->list[k])) {
            return run_fail(r,
                            "the derivatives of the motion grow beyond %g at t = %.17g: ask for a shorter time, and go "
                            "on from its end",
                            LARGEST, r->at.time);
        }
    }
    return run_check_finite(r, "state", r->at.x, MODEL_NX);
}

#include "../model/scalar_real.h"
