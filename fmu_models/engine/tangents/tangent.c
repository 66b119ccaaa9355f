/*
 * Derivatives of a motion along directions in start state, parameters and inputs, carried through steps and events.
 *
 * A tangent is a second copy of the point, in numbers a + i eps b: a is the motion itself, b its derivative. The run
 * decides (length, events, states of contacts), in steps no longer than the tangents allow; each tangent follows:
 *
 *     variations of the series of the step (variation.c), to the full order: they need not end where the series of the
 *     motion does (at rest)
 *     end of the step:   at a fixed time t      since = t - time
 *                        at an event            since with indicator(since) = 0 (event_shift.c)
 *     point = series(since); time = time + since
 *     the event's jump, speed of entry and projection, as the run made them (tangent_event.c)
 *
 * Its time has an imaginary part after an event: the event comes later or earlier for a neighbour. So what saltation
 * matrices say of transitions is derived, for every kind of contact, by moving along the series by a complex time.
 * Undefined where an indicator falls without speed (grazing, corners): a neighbour may have another sequence of events.
 * To rounding that is where its slope is below the tolerance `graze`. Where several indicators fall at one instant, at
 * times that depend on the direction in different ways, the derivative holds on one side only: a corner, which is told.
 *
 * Sources: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7
 *          (saltation);
 * Squire and Trapp, SIAM Review 40 (1998) (derivatives by complex arithmetic).
 */
#include "tangent.h"

#include "../events/contact_placement.h"
#include "../events/run.h"
#include "../events/transition.h"
#include "../step/roots.h"
#include "../step/taylor.h"
#include "event_shift.h"

#include "tangent_event.h"
#include "tangent_step.h"

/* of the times of knots at one instant: by so much of themselves their derivatives may differ by rounding */
static const double SAME_KNOT = 1e-6;

static int pairs(int n) { return (n + PAIR - 1) / PAIR; }

size_t tangents_room(int n)
{
    return sizeof(Tangents) + (size_t)n * sizeof(Tangent) + sizeof(Pair) + (size_t)pairs(n) * sizeof(Variation);
}

Tangents *tangents_start(void *room, const Run *r, int n)
{
    Tangents *tangents = memset(room, 0, sizeof(Tangents) + (size_t)n * sizeof(Tangent));
    tangents->count = n;
    for (int k = 0; k < n; k += PAIR) {
        Variation *l = memset(variation_of(tangents, k), 0, offsetof(Variation, change));
        for (int i = 0; i < LINEAR_MODES; i++)
            l->change[i].known = 0;
    }
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < MODEL_NP; i++)
            tangents->list[k].at.p[i] = r->at.p[i];
        tangent_rejoin(r, &tangents->list[k]);
    }
    return tangents;
}

/* derivatives of what does not change on the way: parameters, and what depends on them alone */
static void keep_constants(Tangents *tangents, int k)
{
    const Tangent *t = &tangents->list[k];
    Variation *l = variation_of(tangents, k);
    const int lane = k % PAIR;
    for (int i = 0; i < MODEL_NP; i++) {
        l->p[i][lane] = cimag(t->at.p[i]) / EPS;
        l->moved |= l->p[i][lane] != 0.0;
    }
    for (int i = 0; i < MODEL_ND; i++)
        l->d[i][lane] = cimag(t->at.d[i]) / EPS;
    for (int c = 0; c < MODEL_NC; c++) {
        l->friction[c][lane] = cimag(model_friction(t->at.p, t->at.d, c)) / EPS;
        for (int i = 0; i < MODEL_NV; i++)
            l->W[i][c][0][lane] = cimag(t->jets.W[i][c][0]) / EPS;
        for (int e = 0; e < MODEL_NC; e++)
            l->G[c][e][0][lane] = cimag(t->jets.G[c][e][0]) / EPS;
    }
    for (int i = 0; i < MODEL_NM; i++)
        l->M[i][0][lane] = cimag(t->jets.M[i][0]) / EPS;
}

void tangents_along(Tangents *tangents, int k, Along what, int index)
{
    Tangent *t = &tangents->list[k];
    Point *at = &t->at;
    Real *start = what == ALONG_STATE ? at->x : what == ALONG_INPUT ? at->u : what == ALONG_MEMORY ? at->memory : at->p;
    start[index] += EPS * _Complex_I;
    model_prepare(at->p, at->d);
    model_inertia(at->p, at->d, &t->jets, 0);
    keep_constants(tangents, k);
    for (int i = 0; i < MODEL_NP; i++) {
        const double size = creal(at->p[i]) != 0.0 ? fabs(creal(at->p[i])) : 1.0;
        t->relative = fmax(t->relative, fabs(cimag(at->p[i])) / size);
    }
}

int tangents_corners(const Tangents *tangents)
{
    int corners = 0;
    for (int k = 0; k < tangents->count; k++)
        corners += tangents->list[k].corner;
    return corners;
}

double tangents_event(const Tangents *tangents, int k)
{
    const Tangent *t = &tangents->list[k];
    return t->untimed ? NAN : cimag(t->at.time) / EPS;
}

double tangents_event_speed(const Tangents *tangents, int k, double *derivative)
{
    const Tangent *t = &tangents->list[k];
    *derivative = t->untimed ? NAN : t->speed_change;
    return t->untimed ? NAN : t->speed;
}

/* derivatives up to here are exact: EPS times it is small enough for its square to vanish */
static const double LARGEST = 1e80;

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

RunStatus tangents_expand(Run *r, Tangents *tangents, double end, double *until)
{
    double rest;
    if (!r->segment_valid) {
        end = fmin(end, r->tick);
        if (run_check_pace(r) == RUN_ERROR || taylor_step(r, run_step_limit(r, end), 0) == RUN_ERROR) return RUN_ERROR;
        if (tangents_fit_step(r, tangents) == RUN_ERROR) return RUN_ERROR;
    }
    *until = fmin(fmin(end, r->tick), run_segment_end(r, &rest));
    return RUN_OK;
}

/* where a step ends: states of the motion and their slopes by s, the variable of its series, and the derivatives there
   of the series of two tangents at a time, and of when its event comes */
typedef struct {
    double s, x[MODEL_ROOM(MODEL_NX)], slope[MODEL_ROOM(MODEL_NX)];
    Pair along[MODEL_ROOM(MODEL_NX)];
    Shift shift;
} Arrived;

static void arrive(const Run *r, Tangents *tangents, double length, int at_event, Arrived *a)
{
    int shifted = at_event;
    for (int k = 0; k < tangents->count; k++)
        shifted |= cimag(tangents->list[k].at.time) != 0.0;
    a->s = r->segment_rooted ? sqrt(length) : length;
    for (int i = 0; i < MODEL_NX; i++) {
        a->x[i] = polynomial_value(r->jets.x[i], r->segment_order, a->s);
        a->slope[i] = shifted ? tangents_slope(r, tangents, i, length) : 0.0;
    }
}

/* tangent k and the one after it; 0 where that has no derivative */
static int arrive_pair(const Run *r, Tangents *tangents, int k, double length, int at_event, Arrived *a)
{
    const Variation *l = variation_of(tangents, k);
    const double s = variation_variable(r, l, length);
    for (int i = 0; i < MODEL_NX; i++)
        a->along[i] = pair_value(l->x[i], l->order, s);
    a->shift = (Shift){.untimed = 1};
    if (!at_event) return 1;
    if (r->segment_rests < 0) return event_shift(r, l, a->s, s, &a->shift);
    a->shift = (Shift){.speed = NAN, .speed_change = {NAN, NAN}};
    for (int n = 0; n < PAIR && k + n < tangents->count; n++)
        a->shift.later[n] = cimag(tangents->list[k + n].rest) / EPS;
    return 1;
}

/* to the end of the step */
static void follow(const Run *r, Tangent *t, int lane, const Arrived *a, double length, int at_event)
{
    const Shift *shift = &a->shift;
    const double rate = r->segment_rooted ? 2.0 * a->s : 1.0; /* of time by s */
    const double started = cimag(t->at.time) / EPS;
    const double later = !shift->untimed ? shift->later[lane] : started == 0.0 ? 0.0 : -started / rate;
    const Real since = length + EPS * rate * later * _Complex_I;
    t->untimed = at_event && shift->untimed;
    t->corner |= shift->corner[lane];
    t->speed = shift->speed;
    t->speed_change = shift->speed_change[lane];
    for (int i = 0; i < MODEL_NX; i++)
        t->at.x[i] = a->x[i] + EPS * (a->along[i][lane] + a->slope[i] * later) * _Complex_I;
    inputs_move(&t->at, since);
    t->at.time += since;
}

void tangents_choose(const Run *r, Tangents *tangents)
{
    for (int k = 0; k < tangents->count; k++) {
        Tangent *t = &tangents->list[k];
        for (int i = 0; i < MODEL_NU; i++) {
            t->at.u[i] = r->at.u[i] + cimag(t->at.u[i]) * _Complex_I;
            t->at.du[i] = r->at.du[i];
            for (int n = 2; n <= MODEL_INPUT_DEGREE; n++)
                t->at.bend[i][n - 2] = r->at.bend[i][n - 2];
        }
        t->at.curved = r->at.curved;
        tangent_load_signals(r, t);
        tangent_repeat_event(r, t);
    }
}

/* a tangent to where its time is another by so little */
static void move_by(Tangent *t, Real since)
{
    if (cimag(since) == 0.0) return;
    flow_load(&t->at, &t->jets, 0);
    flow_field(&t->at, &t->jets, 0, 0);
    flow_extend(&t->jets, 1, 0);
    KIND(elements_spread)(&t->jets, 1);
    for (int i = 0; i < MODEL_NX; i++)
        t->at.x[i] += t->jets.x[i][1] * since;
    inputs_move(&t->at, since);
    t->at.time += since;
}

void tangents_hold(Tangents *tangents)
{
    for (int k = 0; k < tangents->count; k++)
        move_by(&tangents->list[k], since_start(&tangents->list[k], 0.0));
}

/* a tangent to the knot that the run has come to, which its parameters move */
static void shift_to_tick(const Run *r, Tangent *t)
{
    int met = 0;
    for (int i = 0; i < MODEL_NS; i++) {
        const Real due = signals_knot(&t->at, i, r->at.cycle[i], r->at.piece[i] + 1);
        if (creal(due) - r->at.time > 4.0 * DBL_EPSILON * fabs(r->at.time)) continue;
        const Real since = (cimag(due) - cimag(t->at.time)) * _Complex_I;
        if (!met)
            move_by(t, since);
        else
            t->corner |= fabs(cimag(since)) > SAME_KNOT * fabs(cimag(due));
        met = 1;
    }
    t->untimed = !met;
    t->speed = t->speed_change = NAN;
}

/* signals over their knots, for the run and each tangent at its own time */
static RunStatus pass_tick(Run *r, Tangents *tangents, EventSink sink, void *context)
{
    for (int k = 0; k < tangents->count; k++)
        shift_to_tick(r, &tangents->list[k]);
    if (transition_tick(r, sink, context) == RUN_ERROR) return RUN_ERROR;
    for (int k = 0; k < tangents->count; k++) {
        tangent_load_signals(r, &tangents->list[k]);
        tangent_repeat_event(r, &tangents->list[k]);
    }
    return RUN_OK;
}

void tangents_place(const Run *r, Tangents *tangents, int k, const double *direction)
{
    Point *at = &tangents->list[k].at;
    tangent_rejoin(r, &tangents->list[k]);
    for (int i = 0; i < MODEL_NX; i++)
        at->x[i] = r->at.x[i] + EPS * direction[i] * _Complex_I;
    for (int c = 0; c < MODEL_NC; c++)
        at->memory[c] = r->at.memory[c] + EPS * direction[MODEL_NX + c] * _Complex_I;
    at->time = r->at.time + EPS * direction[MODEL_NX + MODEL_NC] * _Complex_I;
    tangent_load_signals(r, &tangents->list[k]);
}

void tangents_read(const Tangents *tangents, int k, double *direction)
{
    const Point *at = &tangents->list[k].at;
    for (int i = 0; i < MODEL_NX; i++)
        direction[i] = cimag(at->x[i]) / EPS;
    for (int c = 0; c < MODEL_NC; c++)
        direction[MODEL_NX + c] = cimag(at->memory[c]) / EPS;
    direction[MODEL_NX + MODEL_NC] = cimag(at->time) / EPS;
}

void tangents_begin_held(Run *r, Tangents *tangents)
{
    signed char held[NC];
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++)
        held[c] = (signed char)(contact_is_held(r->at.state, c) && placement_has_lever(r, c));
    for (int k = 0; k < tangents->count; k++) {
        tangent_project(r, &tangents->list[k], held);
        tangent_rejoin(r, &tangents->list[k]);
    }
}

/* the first contact with a falling indicator */
static const char *falling_contact(const Run *r)
{
    int c = 0;
    while (c < MODEL_NC - 1 && !r->falling[c][SLOT_NORMAL] && !r->falling[c][SLOT_TANGENTIAL])
        c++;
    return model_contact_names[c];
}

RunStatus tangents_move(Run *r, Tangents *tangents, double end, EventSink sink, void *context)
{
    double rest;
    end = fmin(end, r->tick);
    const int inside = run_segment_end(r, &rest) > end;
    const int at_event = !inside && r->segment_event;
    const double length = inside ? (end - r->segment_start) - r->jets.time_rest : r->segment_length;
    Arrived arrived;
    arrive(r, tangents, length, at_event, &arrived);
    for (int k = 0; k < tangents->count; k++) {
        if (k % PAIR == 0 && !arrive_pair(r, tangents, k, length, at_event, &arrived)) {
            return run_fail(
                r,
                "the motion has no derivative at t = %.17g: it touches the bound of contact '%s' there without "
                "crossing it, and neighbours may or may not. Start elsewhere, or change a parameter a little",
                r->segment_start + length, falling_contact(r));
        }
        follow(r, &tangents->list[k], k % PAIR, &arrived, length, at_event);
    }
    if (inside) {
        run_move_inside(r, end, length);
        run_touched(r);
    } else {
        if (run_segment_end(r, &rest) > r->at.time) r->stalled = 0;
        run_finish_segment(r);
        memset(r->at.known, 0, sizeof r->at.known);
        if (!at_event && run_keep_without_slip(r) == RUN_ERROR) return RUN_ERROR;
        r->segment_event = 0;
        if (at_event && transition_resolve(r, sink, context) == RUN_ERROR) return RUN_ERROR;
    }
    for (int k = 0; k < tangents->count; k++) {
        if (at_event)
            tangent_repeat_event(r, &tangents->list[k]);
        else
            tangent_rejoin(r, &tangents->list[k]);
        if (overflows(&tangents->list[k])) {
            return run_fail(r,
                            "the derivatives of the motion grow beyond %g at t = %.17g: ask for a shorter time, and go "
                            "on from its end",
                            LARGEST, r->at.time);
        }
    }
    if (r->tick <= r->at.time && pass_tick(r, tangents, sink, context) == RUN_ERROR) return RUN_ERROR;
    return run_check_finite(r, "state", r->at.x, MODEL_NX);
}

#include "../model/scalar_real.h"
