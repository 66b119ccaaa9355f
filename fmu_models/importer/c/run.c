/*
 * A whole run of an FMU by Model Exchange, in one call or in several (the allowance bounds the steps of a call).
 *
 *     start:   begin.c
 *     advance, until the stop time or until the FMU terminates:
 *         end = the earliest of stop time, time event, knot of an input; no step goes beyond it, and the last one ends
 *         on it exactly
 *
 *         step: tried, shortened until its error is within the tolerance
 *
 *         the first event of an indicator on the step cuts it off (events.c)
 *
 *         recorded values at output times before the end of the step, from the dense output
 *
 *         the FMU is put at the end of the step; completedIntegratorStep
 *
 *         a state on the section ends the run there, after an event that comes with it
 *
 *         an event of whatever kind: handling.c; states, sides, next time event anew
 *
 *         recorded values at output times that fall on the end of the step: those after the event
 */
#include "../../engine/model/traps.h"
#include "begin.h"
#include "cosimulation.h"
#include "dense_output.h"
#include "events.h"
#include "field.h"
#include "handling.h"
#include "method.h"
#include "recording.h"
#include "scheduled.h"
#include "slide.h"
#include "step.h"
#include "stiff.h"
#include "tangent.h"
#include "ticking.h"
#include "zeno.h"

#include <float.h>
#include <math.h>
#include <string.h>

static double knot_after(const Master *m)
{
    const Run *r = m->run;
    return m->nu && m->knot + 1 < r->n_knots ? r->knot_times[m->knot + 1] : INFINITY;
}

/* whether a state that has come to this side of the section ends the run */
static int ends_at(const Master *m, int side)
{
    const Run *r = m->run;
    return r->section_state && (r->section_direction == 0 || r->section_direction == side);
}

/* the FMU and the run are put at the end of the step */
static Outcome arrive(Master *m, double t1, double theta)
{
    Run *r = m->run;
    const int section = m->nz, changes = theta > 0.0 && m->slots > section && m->fired[section];
    const int side = changes ? -m->side[section] : m->side[section];
    Causes causes = {.state = theta > 0.0 && memchr(m->fired, 1, (size_t)section)};
    m->crossed = changes && ends_at(m, side);
    m->fresh |= changes;
    if (theta > 0.0) {
        dense_value(m, theta, m->stage);
        memcpy(m->x, m->stage, (size_t)m->n * sizeof *m->x);
    } else {
        memcpy(m->x, m->x1, (size_t)m->n * sizeof *m->x);
        memcpy(m->f, m->f1, (size_t)m->n * sizeof *m->x);
    }
    m->t = t1;
    /* not at an event of an indicator: it might be moved back before its zero, and the FMU would not see it */
    Outcome outcome = m->slide.n && !causes.state ? slide_project(m) : FINE;
    if (outcome == FINE && !field_is_settled(m, m->t, m->x)) outcome = field_settled(m, m->t, m->x);
    if (outcome != FINE)
        return outcome == STOP ? STOP : field_report(m, RUN_FMI_ERROR, m->t, F_SET_STATES, FMI_DISCARD);
    if (m->fmu->completes) {
        const int status = fmi_completed(m->fmu, &causes.step, &m->terminate);
        if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_COMPLETED, status);
        if (m->terminate) return recording_reached(m);
    }
    causes.time = m->t >= m->next_event;
    if (m->t >= knot_after(m)) {
        causes.knot = 1;
        causes.jump = (int)r->knot_jumps[m->knot + 1];
        begin_knot(m, m->knot + 1);
        outcome = causes.jump ? FINE : field_inputs(m, m->t);
    }
    const int event = causes.state || causes.time || causes.step || causes.jump;
    if (outcome == FINE && causes.state && r->tangents) outcome = tangent_before(m, m->length);
    if (outcome == FINE && event) outcome = handling_event(m, &causes);
    if (outcome == FINE && m->fresh && !m->terminate) {
        outcome = begin_piece(m);
        step_careful(m);
        if (outcome == FINE && event && r->tangents) tangent_after(m, causes.state);
        /* an event may take the state across */
        m->crossed |= event && m->side[section] != side && ends_at(m, m->side[section]);
    } else if (outcome == FINE && m->slots && !m->terminate) {
        memcpy(m->z, m->samples, (size_t)m->slots * sizeof *m->z);
    }
    return outcome == FINE ? recording_reached(m) : outcome;
}

/* a step, the first event on it, and whether the other method is to make the next one */
static Outcome make_resolved(Master *m, double limit, double *error, double *theta, int *change)
{
    Outcome outcome;
    int refused;
    do {
        outcome = step_make(m, limit, error);
        if (outcome != FINE) return outcome;
        m->step_error = *error;
        *change = step_choose(m);
        outcome = events_locate(m, limit, theta);
        /* beyond an event there may be no indicators: nearer to it, down to the rounding of time */
        refused = outcome == SHORTER;
        if (refused && !(m->length > 4.0 * DBL_EPSILON * fmax(fabs(m->t), m->run->stop - m->run->start)))
            return field_report(m, RUN_FMI_ERROR, m->asked, m->refused, FMI_DISCARD);
        if (m->unresolved || refused) {
            m->h = m->resolved = 0.0625 * m->length;
            m->previous_ready = 0;
            m->run->steps--;
            m->run->rejected++;
        }
    } while (refused || (outcome == FINE && m->unresolved));
    m->resolved *= 2.0;
    return outcome;
}

static Outcome advance(Master *m)
{
    Run *r = m->run;
    const double end = fmin(r->stop, fmin(m->next_event, knot_after(m)));
    double theta = -1.0, error = 0.0;
    if (end - m->t <= 4.0 * DBL_EPSILON * fabs(m->t)) {
        /* nothing to integrate: an event at once, or the rounding of its time */
        memcpy(m->x1, m->x, (size_t)m->n * sizeof *m->x);
        memcpy(m->f1, m->f, (size_t)m->n * sizeof *m->x);
        memcpy(m->samples, m->z, (size_t)m->slots * sizeof *m->z);
        return arrive(m, fmax(end, m->t), -1.0);
    }
    const double limit = end - m->t;
    m->h = fmin(m->h, fmin(zeno_longest_step(m), m->resolved));
    const double proposed = m->h;
    int change = 0;
    Outcome outcome = make_resolved(m, limit, &error, &theta, &change);
    if (outcome != FINE) return outcome;
    const double length = m->length;
    const double growth = step_growth(m, error);
    const double longer = length * (stiff_keeps(m, growth) ? 1.0 : growth);
    if (!m->stiff) m->last_error = fmax(error, 1e-4);
    /* a step cut short by its end says little about the next */
    m->h = length < proposed && length >= 0.5 * limit ? fmax(longer, m->h) : longer;
    const double t1 = theta > 0.0 ? fmin(m->t + theta * m->length, end) : length >= limit ? end : m->t + length;
    outcome = recording_within(m, t1);
    if (outcome != FINE) return outcome;
    if (m->stiff && theta < 0.0) {
        outcome = method_dense(m);
        m->previous_ready = 1;
        m->last_length = length;
        m->last_error = error;
        m->jacobian_fresh = 0;
        m->jacobian_ready = m->jacobian_ready && !m->newton_poor;
    }
    if (r->tangents) {
        outcome = outcome == FINE ? method_dense(m) : outcome;
        outcome = outcome == FINE ? tangent_advance(m, theta > 0.0 ? theta : 1.0) : outcome;
    }
    /* only now: the polynomial of the step is that of the method which made it */
    if (change) step_change_method(m);
    return outcome == FINE ? arrive(m, t1, theta) : outcome;
}

/* the rest of the run at the limit of a Zeno sequence: as it is there, if nothing else moves or comes */
static RunStatus hold(Master *m)
{
    Run *r = m->run;
    const int indicator = (int)r->report_index;
    r->report_other = -1;
    if (m->inputs_vary || fmin(m->next_event, knot_after(m)) < r->stop || begin_piece(m) != FINE) return RUN_ZENO;
    for (int i = 0; i < m->n; i++) {
        const double way = fabs(m->f[i]) * (r->stop - m->t);
        if (m->before[i] == m->x[i] && way > master_tolerances.zeno_still * fmax(fabs(m->x[i]), m->nominal[i])) {
            r->report_other = i;
            return RUN_ZENO;
        }
    }
    handling_log(m, EVENT_REST, indicator, m->z[indicator], m->z[indicator]);
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times)
        recording_at(m, r->times[r->next_time], m->x, &outcome);
    fmi_plain(m->fmu, F_TERMINATE);
    return outcome == FINE ? RUN_DONE : m->ended;
}

EXPORT int32_t master_run(Master *m, Run *r)
{
    TRAPS_REST;
    m->run = r;
    m->looks = 0;
    if (m->fmu->log) m->fmu->log->master = m;
    const int begins = !r->begun;
    Outcome outcome = begins ? begin_run(m) : FINE;
    if (r->method == METHOD_CO_SIMULATION)
        return outcome == FINE ? (int32_t)cosimulation_run(m, begins) : (int32_t)m->ended;
    if (r->method == METHOD_SCHEDULED) return outcome == FINE ? (int32_t)scheduled_run(m) : (int32_t)m->ended;
    for (int64_t left = r->allowance; outcome == FINE && !m->terminate && !m->crossed && m->t < r->stop; left--) {
        /* room in the buffer for all indicators and what comes with them at one instant */
        const int full = r->event_capacity > 0 && r->n_events + m->nz + 8 > r->event_capacity;
        if (left == 0 || full || ticking_full(m)) return RUN_MORE;
        outcome = advance(m);
    }
    if (outcome != FINE && m->ended == RUN_ZENO && r->on_zeno == ZENO_HOLD) return (int32_t)hold(m);
    if (outcome != FINE) return m->ended ? (int32_t)m->ended : (int32_t)RUN_FMI_ERROR;
    if (m->terminate) {
        r->report_time = m->t;
        memcpy(m->before, m->x, (size_t)m->n * sizeof *m->x);
        handling_log(m, EVENT_END, -1, 0.0, 0.0);
    }
    fmi_plain(m->fmu, F_TERMINATE);
    r->report_time = m->t;
    if (r->ends) {
        memcpy(r->ends + 2 * m->n, m->x, (size_t)m->n * sizeof *m->x);
        memcpy(r->ends + 3 * m->n, m->f, (size_t)m->n * sizeof *m->x);
    }
    if (r->indicators) memcpy(r->indicators, m->z, (size_t)m->nz * sizeof *m->z);
    return m->terminate ? RUN_TERMINATED : m->crossed ? RUN_CROSSED : RUN_DONE;
}
