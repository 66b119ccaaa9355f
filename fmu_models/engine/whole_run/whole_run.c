/*
 * A whole run in one call, after a restart, or for a program that has opened the FMU as Co-Simulation and left its
 * initialization mode. Nothing is allocated while stepping.
 *
 *     repeat   at a knot: set the inputs and their rates, choose contact states again
 *              advance to the next knot or output time, note every change of contact state
 *              at an output time, or where a state crosses the level watched: record the values asked for
 *              (after the changes at that very time); before and after a change too if both sides are asked for
 *     until    all output times are done; a buffer is or could become too full, or the allowance of steps is used up
 *
 * In the last cases it returns WHOLE_RUN_MORE; the caller empties the buffers and calls again with the same request.
 */
#include "whole_run.h"

#include "../events/run.h"
#include "../events/transition.h"
#include "../fmi/variables.h"
#include "../step/section.h"
#include "../model/traps.h"

void whole_run_note(void *context, const ContactEvent *event)
{
    WholeRun *run = context;
    if (run->n_events < run->event_capacity) run->events[run->n_events] = *event;
    run->n_events++;
}

/* inputs of the next knot; nothing to choose again where they go on as before */
RARE Status whole_run_pass_knot(Instance *m, WholeRun *run)
{
    const double *values = run->knot_values + run->next_knot * run->n_inputs;
    const double *rates = run->knot_rates + run->next_knot * run->n_inputs;
    for (int64_t i = 0; i < run->n_inputs; i++) {
        uint32_t rate = variables_rate_of(run->inputs[i]);
        if (!rate)
            return instance_refuse(m, "%s: value reference %u is not an input", __func__, (unsigned)run->inputs[i]);
        if (variables_set(m, __func__, &run->inputs[i], 1, &values[i])) return STATUS_ERROR;
        if (variables_set(m, __func__, &rate, 1, &rates[i])) return STATUS_ERROR;
    }
    run->next_knot++;
    m->core.run.horizon = run->next_knot < run->n_knots ? run->knot_times[run->next_knot] : INFINITY;
    return STATUS_OK;
}

Status whole_run_settle(Instance *m, WholeRun *run)
{
    signed char before[MODEL_ROOM(MODEL_NC)];
    Run *r = &m->core.run;
    if (m->core.settled) return STATUS_OK;
    memcpy(before, r->at.state, sizeof before);
    if (instance_settle(m, __func__, NULL)) return STATUS_ERROR;
    /* what a start is in is no change */
    if (r->at.time > m->core.start_time) transition_tell(r, before, whole_run_note, run);
    return STATUS_OK;
}

static Status record(Instance *m, const WholeRun *run, double *row)
{
    Evaluation e = {0};
    for (int64_t k = 0; k < run->n_values; k++)
        if (!variables_value(m, run->references[k], &e, &row[k]))
            return instance_refuse(m, "%s: value reference %u cannot be read at time %g", __func__,
                                   (unsigned)run->references[k], m->core.run.at.time);
    return STATUS_OK;
}

typedef struct {
    Instance *instance;
    WholeRun *run;
} Sides;

static Status record_side(Instance *m, const WholeRun *run, int after)
{
    double *row = run->sides + (2 * run->n_sides + after) * (1 + run->n_values);
    if (run->n_sides >= run->side_capacity || !run->next_time) return STATUS_OK;
    if (!after && row[0] == m->core.run.at.time) return STATUS_OK; /* the first of several at one instant */
    row[0] = m->core.run.at.time;
    return record(m, run, row + 1);
}

/* what cannot be read before an event cannot be read after it, which is told then */
static void look_before(void *context)
{
    const Sides *sides = context;
    record_side(sides->instance, sides->run, 0);
}

/* after what may have been events: if there were any since, the side is done */
static Status look_after(Instance *m, WholeRun *run, int64_t n_events)
{
    if (run->n_events == n_events) return STATUS_OK;
    if (record_side(m, run, 1)) return STATUS_ERROR;
    run->n_sides += run->n_sides < run->side_capacity && run->next_time;
    return STATUS_OK;
}

static Status watch(Instance *m, const WholeRun *run)
{
    int state;
    if (variables_locate(run->crossing_state, &state) != STATE)
        return instance_refuse(m, "%s: value reference %u is not a state", __func__, (unsigned)run->crossing_state);
    section_watch(&m->core.run, state, run->level, run->direction);
    return STATUS_OK;
}

int64_t whole_run_event_reserve(const Run *r) { return (int64_t)r->tolerances.max_iterations * MODEL_NC; }

RARE Status whole_run_check_event_room(Instance *m, const WholeRun *run)
{
    int64_t reserve = whole_run_event_reserve(&m->core.run);
    if (run->event_capacity > reserve) return STATUS_OK;
    return instance_refuse(m, "%s: room for %lld events, at least %lld needed", __func__,
                           (long long)run->event_capacity, (long long)reserve + 1);
}

int whole_run_engine_failed(Instance *m)
{
    m->core.phase = PHASE_FAILED;
    instance_refuse(m, "at time %.10g: %s", m->core.run.at.time, m->core.run.message);
    return WHOLE_RUN_ERROR;
}

static CALLED int proceed(Instance *m, WholeRun *run)
{
    Run *r = &m->core.run;
    int64_t reserve = whole_run_event_reserve(r);
    long last_step = r->steps + (long)run->allowance;
    if (whole_run_check_event_room(m, run)) return WHOLE_RUN_ERROR;
    int watches = run->crossing_capacity > 0;
    r->goal = watches || !run->n_times ? -INFINITY : run->times[run->n_times - 1]; /* a section may stop early */
    r->pause_at = last_step;
    while (run->next_time < run->n_times) {
        if (run->n_events >= run->event_capacity - reserve || r->steps >= last_step) return WHOLE_RUN_MORE;
        if (watches && run->n_crossings >= run->crossing_capacity) return WHOLE_RUN_MORE;
        if (run->side_capacity && run->n_sides >= run->side_capacity) return WHOLE_RUN_MORE;
        int64_t n_events = run->n_events;
        if (run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= r->at.time) record_side(m, run, 0);
        while (run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= r->at.time)
            if (whole_run_pass_knot(m, run)) return WHOLE_RUN_ERROR;
        if (whole_run_settle(m, run) || look_after(m, run, n_events)) return WHOLE_RUN_ERROR;
        if (watches && !r->section.watched && watch(m, run)) return WHOLE_RUN_ERROR;
        double end = run->times[run->next_time];
        int knot_first = run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= end;
        if (knot_first) end = run->knot_times[run->next_knot];
        if (r->at.time < end) {
            n_events = run->n_events;
            RunStatus status = run_advance(r, end, 1, whole_run_note, run);
            if (status == RUN_ERROR) return whole_run_engine_failed(m);
            if (status == RUN_CROSSING) {
                if (record(m, run, run->crossings + run->n_crossings * run->n_values)) return WHOLE_RUN_ERROR;
                run->n_crossings++;
                continue;
            }
            if (look_after(m, run, n_events)) return WHOLE_RUN_ERROR;
            if (status == RUN_PAUSED) return WHOLE_RUN_MORE;
            if (status == RUN_EVENT && r->at.time < end) continue;
        }
        if (knot_first) continue;
        if (record(m, run, run->values + run->next_time * run->n_values)) return WHOLE_RUN_ERROR;
        run->next_time++;
    }
    return WHOLE_RUN_DONE;
}

void whole_run_count(const Instance *m, WholeRun *run)
{
    run->steps = m->core.run.steps;
    run->n_changes = m->core.run.events;
    run->evaluations = m->core.run.evaluations;
}

int stickslip_simulate(void *instance, WholeRun *run)
{
    TRAPS_REST;
    Instance *m = instance;
    if (!run || (run->start && stickslip_restart(m, run->start))) return WHOLE_RUN_ERROR;
    run->start = NULL;
    if (instance_enter(m, PHASE_STEP, __func__)) return WHOLE_RUN_ERROR;
    /* what is watched, and how far it is to go, belong to the request: whoever abandons it leaves nothing behind */
    Run *r = &m->core.run;
    r->section = run->section;
    Sides sides = {m, run};
    r->look = run->side_capacity ? look_before : NULL;
    r->look_context = &sides;
    int status = proceed(m, run);
    run->section = r->section;
    r->section.watched = 0;
    r->goal = -INFINITY;
    r->pause_at = 0;
    r->look = NULL;
    whole_run_count(m, run);
    return status;
}
