/*
 * A run: advance from event to event on Taylor segments. What importers need that integrate by themselves is in
 * model_exchange.c.
 *
 *     advance(t):  until the present segment covers t: go to its end; resolve the event that waits there; next segment
 *                  then evaluate the segment at t and keep it, so that many short calls cost no more than one long one
 *     An event at t itself is resolved: segments are half-open, (start, end].
 *     no segment goes beyond the next knot of a signal; there, at t itself too: its new piece, and contacts anew
 *
 * The way of an event runs down: a step (taylor.c) ends where an indicator falls (event_location.c); the transition
 * there (transition.c) asks where contacts are (contact_placement.c) and which are held from then on
 * (mode_selection.c).
 */
#include "run.h"

#include "../step/contact_forces.h"
#include "../step/roots.h"
#include "../step/section.h"
#include "../step/taylor.h"
#include "contact_placement.h"
#include "energy_watch.h"
#include "gap_tolerance.h"
#include "transition.h"

/* a segment may reach this many times beyond the time asked for, so that short calls share it; a goal that lies farther
   ahead counts instead, so that the times at which a caller looks do not change the motion */
static const double LOOK_AHEAD = 1024.0;

RARE void run_resume(Run *r)
{
    r->stalled = 0;
    r->unseen = 0;
    r->accumulation_start = r->last_event = r->pace_start = r->at.time;
    r->pace_first_step = r->steps;
    r->pace_first_event = r->events;
    r->accumulated_events = 0;
    r->paced_events = 0;
    r->paced_at = PACED_FIRST;
    r->paced_time = r->at.time;
    r->paced_span = INFINITY;
    r->longest_pause = 0.0;
}

RARE RunStatus run_initialize(Run *r)
{
    run_parameters_changed(r);
    const char *violation = model_violation(r->at.p);
    if (violation) return run_fail(r, "%s", violation);
    if (run_check_finite(r, "start value of state", r->at.x, MODEL_NX)
        || run_check_finite(r, "input", r->at.u, MODEL_NU)
        || run_check_finite(r, "rate of input", r->at.du, MODEL_NU)) {
        return RUN_ERROR;
    }
    for (int c = 0; c < MODEL_NC; c++)
        r->at.state[c] = CONTACT_AWAY;
    memset(r->closings, 0, sizeof r->closings);
    if (MODEL_NM > 0) {
        taylor_load(r, &r->scratch);
        model_inertia(r->at.p, r->at.d, &r->scratch, 0);
        if (run_check_mass(r, &r->scratch) == RUN_ERROR) return RUN_ERROR;
    }
    run_resume(r);
    memset(r->at.settles, 0, sizeof r->at.settles);
    memset(r->leeway, 0, sizeof r->leeway);
    memset(r->largest_gap, 0, sizeof r->largest_gap);
    gap_measure_nominal(r);
    memset(r->fastest, 0, sizeof r->fastest);
    for (int c = 0; c < MODEL_NC; c++) {
        if (!cone_is_whole(c)) continue;
        taylor_load(r, &r->scratch);
        for (int i = 0; i < MODEL_NX; i++)
            r->scratch.x[i][0] = model_nominal_states[i];
        r->typical_slip[c] = model_slip_magnitude(r->at.p, r->at.d, &r->scratch, c);
    }
    r->starting = 1;
    const RunStatus status = run_reconsider(r, NULL);
    r->starting = 0;
    for (int c = 0; c < MODEL_NC; c++)
        r->young[c] = cone_is_whole(c) && r->at.state[c] != CONTACT_STICK && r->at.known[c][SLOT_TANGENTIAL] > 0;
    if (status == RUN_ERROR) return RUN_ERROR;
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_remembers[c] && r->at.state[c] != CONTACT_AWAY && !(r->at.memory[c] > 0.0)) {
            return run_fail(
                r,
                "the motion starts inside the stop '%s', whose force depends on the speed at which it was entered: "
                "give that speed as %s_memory, or start outside",
                model_contact_names[c], model_contact_names[c]);
        }
    }
    return RUN_OK;
}

RARE RunStatus run_reconsider(Run *r, int *changed)
{
    int moved = 0;
    run_touched(r);
    const RunStatus status = transition_reconsider(r, &moved);
    if (changed) *changed = moved;
    return status;
}

/* derivative n of an input, so long after the start of the present segment */
static double input_derivative(const Run *r, int i, int n, double since_start)
{
    double value = 0.0;
    for (int m = MODEL_INPUT_DEGREE; m >= n; m--) {
        double factor = 1.0;
        for (int k = 0; k < n; k++)
            factor *= m - k;
        value = value * since_start + factor * r->jets.u[i][m * time_power(r->segment_rooted)];
    }
    return value;
}

/* states and inputs inside the present segment; its end uses the located length, free of the rounding of time */
static void evaluate_segment(Run *r, double time, double since_start)
{
    const double s = r->segment_rooted ? sqrt(since_start) : since_start;
    for (int i = 0; i < MODEL_NX - MODEL_NE; i++)
        r->at.x[i] = polynomial_value(r->jets.x[i], r->segment_order, s);
    for (int c = 0; MODEL_NE > 0 && c < MODEL_NC; c++) {
        const int first = model_contact_first[c], next = contact_is_array(c) ? r->jets.next[c] : -1;
        const double way = next < 0 ? 0.0 : s * polynomial_value(&r->jets.x[next][1], r->segment_order - 1, s);
        for (int i = first; i < first + model_contact_elements[c]; i++)
            r->at.x[i] = r->jets.x[i][0] + (element_is_held(&r->jets, c, i) ? 0.0 : way);
    }
    for (int i = 0; i < MODEL_NU; i++)
        r->at.u[i] = r->jets.u[i][0] + r->jets.du[i][0] * since_start;
    for (int i = 0; r->at.curved && i < MODEL_SET_INPUTS; i++) {
        r->at.u[i] = input_derivative(r, i, 0, since_start);
        r->at.du[i] = input_derivative(r, i, 1, since_start);
        for (int n = 2; n <= MODEL_INPUT_DEGREE; n++)
            r->at.bend[i][n - 2] = input_derivative(r, i, n, since_start);
    }
    r->at.time = time;
    if (since_start > 0.0) memset(r->at.known, 0, sizeof r->at.known); /* what was zero at the start is zero no more */
}

RunStatus run_keep_without_slip(Run *r)
{
    Jets *j = &r->scratch;
    signed char held[NC];
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        held[c] = (signed char)contact_is_held(r->at.state, c);
        any |= held[c];
    }
    if (!any) return RUN_OK;
    const Velocities before = energy_velocities(r);
    taylor_load(r, j);
    taylor_field(r, j, 0);
    for (int c = 0; c < MODEL_NC; c++) {
        held[c] = (signed char)(held[c] && placement_has_lever(r, c));
        if (r->at.state[c] != CONTACT_STICK) stick_unweighted(j, c);
    }
    contact_project(&r->at, j, held, NULL);
    return energy_check_projection(r, &before);
}

/* a + b, and what rounding took from it */
static double exact_sum(double a, double b, double *rest)
{
    const double sum = a + b;
    const double bb = sum - a;
    *rest = (a - (sum - bb)) + (b - bb);
    return sum;
}

/* the time at the end of the segment, and what rounding takes from it, never more than half its last digit */
double run_segment_end(const Run *r, double *rest)
{
    double of_length;
    const double length = exact_sum(r->segment_length, r->jets.time_rest, &of_length);
    const double end = exact_sum(r->segment_start, length, rest);
    *rest += of_length;
    return end;
}

void run_finish_segment(Run *r)
{
    double rest;
    evaluate_segment(r, run_segment_end(r, &rest), r->segment_length);
    r->at.time_rest = rest;
    r->segment_valid = 0;
    if (MODEL_IMPACTS > 0) {
        signed char closed[NC];
        for (int c = 0; c < MODEL_NC; c++)
            r->largest_gap[c] = fmax(r->largest_gap[c], fabs(r->jets.depth[c][0]));
        placement_closed_on_walls(r, closed);
    }
}

void run_move_inside(Run *r, double time, double since_start)
{
    evaluate_segment(r, time, since_start);
    r->at.time_rest = 0.0;
    if (MODEL_IMPACTS > 0) {
        signed char closed[NC];
        placement_closed_on_walls(r, closed);
    }
}

double run_step_limit(const Run *r, double end)
{
    return fmin(LOOK_AHEAD * (fmax(end, r->goal) - r->at.time), fmin(r->horizon, r->tick) - r->at.time);
}

/* go to the next crossing of the section on the present segment, up to a time since its start; 0 if there is none */
static RARE CALLED int reach_crossing(Run *r, double until)
{
    const double s = section_next(r, r->segment_rooted ? sqrt(until) : until);
    if (s < 0.0) return 0;
    const double since = r->segment_rooted ? s * s : s;
    run_move_inside(r, r->segment_start + since, since);
    return 1;
}

/* whether the run will come to its end in hours; asked once per step, answered once per so many steps */
RunStatus run_check_pace(Run *r)
{
    const long steps = r->steps - r->pace_first_step;
    const double passed = r->at.time - r->pace_start;
    const double left = r->goal - r->at.time;
    if (steps < r->tolerances.pace_steps) return RUN_OK;
    const long events = r->events - r->pace_first_event;
    r->pace_start = r->at.time;
    r->pace_first_step = r->steps;
    r->pace_first_event = r->events;
    if (left <= r->tolerances.most_paces_left * passed) return RUN_OK;
    if (2 * events > steps) {
        return run_fail(
            r,
            "contacts switch %.1e times per second at t = %.10g, so that the %g s still to come would take %.0e "
            "events: ask for a shorter time, or start elsewhere",
            (double)events / passed, r->at.time, left, (double)events / passed * left);
    }
    return run_fail(
        r,
        "the motion is so fast or so stiff at t = %.10g that the %g s still to come would take %.0e steps of %.0e s: "
        "ask for a shorter time, or soften what is stiff",
        r->at.time, left, (double)steps / passed * left, passed / (double)steps);
}

/* advance up to the next knot of a signal, at most */
static CALLED RunStatus advance_on_pieces(Run *r, double t, int stop_at_event, EventSink sink, void *context)
{
    double rest;
    while (r->at.time < t || (r->segment_valid && r->segment_event && run_segment_end(r, &rest) <= t)) {
        if (!r->segment_valid) {
            if (r->pause_at && r->steps >= r->pause_at) return RUN_PAUSED;
            if (run_check_pace(r) == RUN_ERROR || taylor_step(r, run_step_limit(r, t), 1) == RUN_ERROR)
                return RUN_ERROR;
            r->section.searched = 0.0;
        }
        const double end = run_segment_end(r, &rest);
        const double since = (t - r->segment_start) - r->jets.time_rest;
        if (r->section.watched && reach_crossing(r, end > t ? since : r->segment_length)) return RUN_CROSSING;
        if (end > t) {
            run_move_inside(r, t, since);
            break;
        }
        if (end > r->at.time) r->stalled = 0;
        run_finish_segment(r);
        if (!r->segment_event) {
            memset(r->at.known, 0, sizeof r->at.known);
            if (run_keep_without_slip(r) == RUN_ERROR) return RUN_ERROR;
            continue;
        }
        r->segment_event = 0;
        if (r->look) r->look(r->look_context);
        const long events = r->events;
        if (transition_resolve(r, sink, context) == RUN_ERROR) return RUN_ERROR;
        if (stop_at_event && r->events > events) return RUN_EVENT;
    }
    return run_check_finite(r, "state", r->at.x, MODEL_NX);
}

RunStatus run_advance(Run *r, double t, int stop_at_event, EventSink sink, void *context)
{
    if (!(t >= r->at.time)) return run_fail(r, "time cannot go back from %.17g to %.17g", r->at.time, t);
    for (;;) {
        RunStatus status = advance_on_pieces(r, fmin(t, r->tick), stop_at_event, sink, context);
        const long events = r->events;
        if ((status != RUN_OK && status != RUN_EVENT) || r->at.time < r->tick) return status;
        if (r->look) r->look(r->look_context);
        if (transition_tick(r, sink, context) == RUN_ERROR) return RUN_ERROR;
        if (status == RUN_EVENT || (stop_at_event && r->events > events)) return RUN_EVENT;
        if (r->at.time >= t) return RUN_OK;
    }
}

RunStatus run_outputs(Run *r, double *y)
{
    Jets *j = &r->scratch;
    taylor_load(r, j);
    taylor_field(r, j, 0);
    model_outputs(r->at.p, r->at.d, j, 0);
    for (int i = 0; i < MODEL_NY; i++)
        y[i] = j->y[i][0];
    return RUN_OK;
}

void run_time_derivatives(Run *r, int order, TimeDerivatives *found)
{
    Jets *j = &r->scratch;
    double factorial = 1.0;
    taylor_series(r, j, order + 1, INFINITY);
    for (int k = 0; k <= order; k++) {
        model_outputs(r->at.p, r->at.d, j, k);
        factorial *= k > 0 ? k : 1;
    }
    for (int i = 0; i < MODEL_NX; i++) {
        found->states[i] = factorial * j->x[i][order];
        found->rates[i] = factorial * (order + 1) * j->x[i][order + 1];
    }
    for (int i = 0; i < MODEL_NY; i++)
        found->outputs[i] = factorial * j->y[i][order];
}
