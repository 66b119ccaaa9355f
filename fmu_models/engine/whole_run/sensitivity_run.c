/*
 * A whole run with its derivatives in one call, from reset to the last output time, so that
 * one instance serves any number of runs.
 *
 *     at first   reset; write start values; a tangent along each direction; initialize
 *     repeat     at a knot: set the inputs and their rates, choose contact states again
 *                one step; record at the output times within it; go to its end, or to the next knot
 *                at an event: note the changes of contact state, and the derivatives of its time
 *     until      as in whole_run.c
 *
 * What is recorded at the time of a knot or an event holds after it.
 */
#include "sensitivity_run.h"

#include <float.h>

#include "../events/model_exchange.h"
#include "../fmi/variables.h"
#include "../tangents/tangent.h"
#include "../tangents/tangent_output.h"
#include "../model/traps.h"

int64_t stickslip_sensitivity_room(int64_t n_directions) { return (int64_t)tangents_room((int)n_directions); }

static Status start_tangent(Instance *m, Tangents *tangents, int k, uint32_t reference)
{
    int index;
    switch (variables_locate(reference, &index)) {
    case STATE: tangents_along(tangents, k, ALONG_STATE, index); return STATUS_OK;
    case PARAMETER: tangents_along(tangents, k, ALONG_PARAMETER, index); return STATUS_OK;
    case INPUT: tangents_along(tangents, k, ALONG_INPUT, index); return STATUS_OK;
    case MEMORY: tangents_along(tangents, k, ALONG_MEMORY, variables_memory_contact(index)); return STATUS_OK;
    default:
        return instance_refuse(m, "%s: value reference %u is neither a state nor a parameter nor an input nor a memory",
                               __func__, (unsigned)reference);
    }
}

static void start_mixture(const Run *r, Tangents *tangents, int k, const double *seed)
{
    double direction[MODEL_NX + MODEL_NC + 1] = {0.0};
    for (int i = 0; i < MODEL_NX; i++)
        direction[i] = seed[i];
    tangents_place(r, tangents, k, direction);
}

static Status start(Instance *m, SensitivityRun *s)
{
    Tangents *tangents = s->room;
    if (s->n_directions < 1 || s->n_directions > INT32_MAX)
        return instance_refuse(m, "%s: at least one direction is needed", __func__);
    if (whole_run_enter_initialization(m, __func__, &s->start)) return STATUS_ERROR;
    /* unlike an importer, who asks for a looser tolerance knows that events are told by its derivatives to no better */
    m->core.run.tolerances.step = fmax(s->start.tolerance, DBL_EPSILON);
    tangents_start(tangents, &m->core.run, (int)s->n_directions);
    for (int k = 0; k < s->n_directions; k++)
        if (start_tangent(m, tangents, k, s->directions[k])) return STATUS_ERROR;
    if (instance_exit_initialization(m, __func__)) return STATUS_ERROR;
    tangents_choose(&m->core.run, tangents);
    for (int64_t k = 0; k < s->n_seeds; k++)
        start_mixture(&m->core.run, tangents, (int)k, s->seeds + k * MODEL_NX);
    s->started = 1;
    return STATUS_OK;
}

/* an event of a knot comes when that does, whatever the direction */
static void note_event_of_knot(SensitivityRun *s, int64_t e)
{
    for (int k = 0; k < s->n_directions; k++) {
        s->event_derivatives[e * s->n_directions + k] = 0.0;
        if (s->event_speeds) s->event_speed_derivatives[e * s->n_directions + k] = NAN;
    }
    if (s->event_speeds) s->event_speeds[e] = NAN;
}

/* inputs of the knots that are due */
static Status pass_knots(Instance *m, SensitivityRun *s)
{
    WholeRun *run = &s->run;
    const Run *r = &m->core.run;
    if (run->next_knot == run->n_knots || run->knot_times[run->next_knot] > r->at.time) return STATUS_OK;
    tangents_hold(s->room);
    while (run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= r->at.time)
        if (whole_run_pass_knot(m, run)) return STATUS_ERROR;
    if (m->core.settled) return STATUS_OK;
    const int64_t before = run->n_events;
    if (whole_run_settle(m, run)) return STATUS_ERROR;
    tangents_choose(r, s->room);
    for (int64_t e = before; e < run->n_events && e < run->event_capacity; e++)
        note_event_of_knot(s, e);
    return STATUS_OK;
}

static int record_rates(Run *r, Tangents *tangents, double time, double *rates)
{
    if (time <= r->at.time) return exchange_derivatives(r, rates) == RUN_ERROR;
    tangents_rates(r, tangents, time, rates);
    return 0;
}

/* one output time */
static Status record_sensitivity(Instance *m, SensitivityRun *s)
{
    WholeRun *run = &s->run;
    Tangents *tangents = s->room;
    const int64_t row = run->next_time * run->n_values;
    int index, outputs = 0;
    for (int64_t v = 0; v < run->n_values; v++) {
        Kind kind = variables_locate(run->references[v], &index);
        if (kind != STATE && kind != OUTPUT && kind != MEMORY)
            return instance_refuse(m, "%s: value reference %u is neither a state nor an output nor a memory", __func__,
                                   (unsigned)run->references[v]);
        outputs |= kind == OUTPUT;
    }
    tangents_evaluate(&m->core.run, tangents, run->times[run->next_time], outputs);
    for (int64_t v = 0; v < run->n_values; v++) {
        Kind kind = variables_locate(run->references[v], &index);
        Of what = kind == OUTPUT ? OF_OUTPUT : kind == MEMORY ? OF_MEMORY : OF_STATE;
        if (kind == MEMORY) index = variables_memory_contact(index);
        run->values[row + v] = tangents_value(tangents, what, index);
        for (int k = 0; k < s->n_directions; k++)
            s->derivatives[(row + v) * s->n_directions + k] = tangents_derivative(tangents, k, what, index);
    }
    if (s->rates
        && record_rates(&m->core.run, tangents, run->times[run->next_time], s->rates + run->next_time * MODEL_NX))
        return STATUS_ERROR;
    run->next_time++;
    return STATUS_OK;
}

/* derivatives that belong to event e, which has just been */
static void note_event(SensitivityRun *s, int64_t e)
{
    for (int k = 0; k < s->n_directions; k++) {
        double change;
        const double speed = tangents_event_speed(s->room, k, &change);
        s->event_derivatives[e * s->n_directions + k] = tangents_event(s->room, k);
        if (s->event_speeds) {
            s->event_speeds[e] = speed;
            s->event_speed_derivatives[e * s->n_directions + k] = change;
        }
    }
}

static int go_on(Instance *m, SensitivityRun *s)
{
    WholeRun *run = &s->run;
    Run *r = &m->core.run;
    const int64_t reserve = whole_run_event_reserve(r);
    const long last_step = r->steps + (long)run->allowance;
    if (whole_run_check_event_room(m, run)) return WHOLE_RUN_ERROR;
    r->goal = run->n_times ? run->times[run->n_times - 1] : -INFINITY;
    while (run->next_time < run->n_times) {
        double until;
        if (run->n_events >= run->event_capacity - reserve || r->steps >= last_step) return WHOLE_RUN_MORE;
        if (pass_knots(m, s)) return WHOLE_RUN_ERROR;
        if (run->times[run->next_time] <= r->at.time) {
            tangents_hold(s->room);
            if (record_sensitivity(m, s)) return WHOLE_RUN_ERROR;
            continue;
        }
        double end = r->goal;
        if (run->next_knot < run->n_knots) end = fmin(end, run->knot_times[run->next_knot]);
        if (tangents_expand(r, s->room, end, &until) == RUN_ERROR) return whole_run_engine_failed(m);
        while (run->next_time < run->n_times && run->times[run->next_time] < until)
            if (record_sensitivity(m, s)) return WHOLE_RUN_ERROR;
        const int64_t before = run->n_events;
        if (s->misses.capacity > 0) near_misses_note(r, s->room, until, &s->misses);
        if (tangents_move(r, s->room, end, whole_run_note, run) == RUN_ERROR) return whole_run_engine_failed(m);
        for (int64_t e = before; e < run->n_events && e < run->event_capacity; e++)
            note_event(s, e);
    }
    return WHOLE_RUN_DONE;
}

int stickslip_sensitivity(void *instance, SensitivityRun *s)
{
    TRAPS_REST;
    Instance *m = instance;
    if (!s || !s->room || instance_enter(m, s->started ? PHASE_STEP : PHASES_ALL, __func__)) return WHOLE_RUN_ERROR;
    if (!s->started && start(m, s)) return WHOLE_RUN_ERROR;
    int status = go_on(m, s);
    s->corners = tangents_corners(s->room);
    m->core.run.goal = -INFINITY;
    whole_run_count(m, &s->run);
    return status;
}
