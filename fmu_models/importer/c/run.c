/*
 * A whole run of an FMU by Model Exchange, in one call or in several (the allowance bounds the steps of a call).
 *
 *     start:   reset, start values, initialization, first event iteration, length of the first step
 *     advance, until the stop time or until the FMU terminates:
 *         end = the earliest of stop time, time event, knot of an input; no step goes beyond it, and the last one ends
 *         on it exactly
 *         step: tried, shortened until its error is within the tolerance
 *         the first event of an indicator on the step cuts it off                                                    
 *         (events.c) recorded values at output times before the end of the step, from the dense output
 *         the FMU is put at the end of the step; completedIntegratorStep
 *         a state on the section ends the run there, after an event that comes with it
 *         an event of whatever kind: event mode, inputs after their jump, iteration; states, sides, next time event
 *         anew the indicators concerned are watched for chattering and Zeno                                            
 *            (zeno.c, slide.c) recorded values at output times that fall on the end of the step: those after the event
 */
#include "cosimulation.h"
#include "dense_output.h"
#include "events.h"
#include "field.h"
#include "method.h"
#include "motion.h"
#include "scheduled.h"
#include "slide.h"
#include "step.h"
#include "tangent.h"
#include "ticking.h"
#include "zeno.h"

#include <float.h>
#include <math.h>
#include <string.h>

static void record_at(Master *m, double t, const double *x, Outcome *outcome)
{
    Run *r = m->run;
    memcpy(r->states + r->next_time * m->n, x, (size_t)m->n * sizeof *x);
    double *values = r->values + r->next_time * r->recorded.n;
    ticking_record(m);
    r->next_time++;
    if (r->recorded.n == 0) {
        return;
    }
    if (m->slide.n) {
        *outcome = slide_values(m, t, x, values);
        return;
    }
    *outcome = field_at(m, t, x);
    if (*outcome == FINE) {
        *outcome = field_fail(m, F_GETTERS, fmi_read(m->fmu, &r->recorded, values));
    }
}

/* output times before the end of the step at t1 */
static Outcome record_within(Master *m, double t1)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times && r->times[r->next_time] < t1) {
        outcome = method_dense(m);
        if (outcome == FINE) {
            dense_value(m, (r->times[r->next_time] - m->t) / m->length, m->point);
            memcpy(m->stage, m->point, (size_t)m->n * sizeof *m->x);
            record_at(m, r->times[r->next_time], m->stage, &outcome);
        }
    }
    return outcome;
}

static Outcome record_here(Master *m)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times && r->times[r->next_time] <= m->t) {
        record_at(m, m->t, m->x, &outcome);
    }
    return outcome;
}

static void log_event(Master *m, EventKind kind, int indicator, double before, double after)
{
    Run *r = m->run;
    if (r->n_events >= r->event_capacity) {
        return;
    }
    r->events[r->n_events] = (MasterEvent){m->t, kind, indicator, before, after};
    double *states = r->event_states + 2 * r->n_events * m->n;
    memcpy(states, m->before, (size_t)m->n * sizeof *m->x);
    memcpy(states + m->n, m->x, (size_t)m->n * sizeof *m->x);
    r->n_events++;
}

static double knot_after(const Master *m)
{
    const Run *r = m->run;
    return m->nu && m->knot + 1 < r->n_knots ? r->knot_times[m->knot + 1] : INFINITY;
}

static void enter_knot(Master *m, int64_t knot)
{
    const Run *r = m->run;
    m->knot = knot;
    m->inputs_vary = 0;
    for (int i = 0; i < m->nu; i++) {
        m->inputs_vary |= r->knot_rates[knot * m->nu + i] != 0.0;
    }
}

static Outcome refresh(Master *m)
{
    const Run *r = m->run;
    Outcome outcome = events_sides(m);
    outcome = outcome == FINE ? motion_rates(m, m->t, m->x, m->f) : outcome;
    for (int i = 0; i < m->slots && outcome == FINE; i++) {
        if (!isfinite(m->z[i])) {
            return field_report(m, RUN_BAD_INDICATOR, m->t, i, m->z[i]);
        }
    }
    if (outcome == SHORTER) {
        const int status = m->trial_status > FMI_DISCARD ? m->trial_status : FMI_DISCARD;
        return m->bad_state >= 0 ? field_report(m, RUN_NOT_FINITE, m->t, m->bad_state, 0.0)
                                 : field_report(m, RUN_FMI_ERROR, m->t, F_GET_DERIVATIVES, status);
    }
    if (outcome == FINE && r->section_state && m->z[m->nz] == 0.0) {
        /* on the section: the side is the one that the motion goes to */
        m->side[m->nz] = m->f[r->section_state - 1] > 0.0 ? 1 : -1;
    }
    m->fresh = 0;
    m->jacobian_ready = m->previous_ready = 0;
    m->last_error = 0.0;
    return outcome;
}

static Outcome initialize(Master *m)
{
    Run *r = m->run;
    const FmuInstance *fmu = m->fmu;
    int status = fmu->resets ? fmi_plain(fmu, F_RESET) : FMI_OK;
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, m->t, F_RESET, status);
    }
    /* which puts sizes of arrays back too */
    status = fmu->resets ? fmi_configure(fmu) : FMI_OK;
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, m->t, F_EXIT_CONFIGURATION, status);
    }
    status = fmi_write(fmu, &r->starts, r->start_values);
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, status);
    }
    status = fmi_initialize(fmu, r->start, r->stop, r->tolerance);
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, m->t, F_ENTER_INITIALIZATION, status);
    }
    enter_knot(m, 0);
    if (m->nu && field_inputs(m, m->t) != FINE) {
        return m->ended ? STOP : field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, FMI_DISCARD);
    }
    if (ticking_begin(m) != FINE) {
        return STOP;
    }
    status = fmi_plain(fmu, F_EXIT_INITIALIZATION);
    return status >= FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->t, F_EXIT_INITIALIZATION, status) : FINE;
}

static Outcome start(Master *m)
{
    Run *r = m->run;
    const int integrates = r->method != METHOD_CO_SIMULATION && r->method != METHOD_SCHEDULED;
    m->nu = (int)r->inputs.n;
    m->slots = m->nz + (r->section_state != 0);
    m->t = r->start;
    m->ended = RUN_DONE;
    m->terminate = m->crossed = 0;
    m->bad_state = -1;
    m->trial_errors = m->trial_status = 0;
    m->next_event = INFINITY;
    m->stiff = r->method == METHOD_STIFF;
    m->tableau = r->method == METHOD_DOPRI5 ? &tableau_dopri5 : &tableau_dop853;
    m->stiff_hits = m->stiff_misses = m->calm_hits = 0;
    m->calm_needed = 20;
    m->jacobian_ready = m->lu_ready = m->previous_ready = 0;
    m->last_error = 0.0;
    m->slide.n = 0;
    m->length = 0.0;
    m->pace_steps = 0;
    m->pace_time = r->start;
    m->slide_time = -INFINITY;
    m->quick_slides = 0;
    Outcome outcome = initialize(m);
    r->begun = 1;
    if (outcome != FINE || !integrates) {
        return outcome;
    }
    zeno_reset(m);
    outcome = events_update(m, 0, 0);
    if (outcome != FINE || m->terminate) {
        return outcome;
    }
    outcome = refresh(m);
    if (outcome == FINE && r->tangents) {
        tangent_start(m);
    }
    m->h = r->first_step;
    if (outcome == FINE && !(m->h > 0.0)) {
        outcome = step_first(m);
    }
    return outcome == FINE ? record_here(m) : outcome;
}

/* the FMU chatters: slide, and log that instead of the events that showed it */
static Outcome begin_slide(Master *m, int indicator)
{
    Run *r = m->run;
    m->quick_slides = m->t - m->slide_time < master_tolerances.rate_gap * (r->stop - r->start) ? m->quick_slides + 1
                                                                                               : 0;
    m->slide_time = m->t;
    if (m->quick_slides > master_tolerances.quick_slides) {
        return field_report(m, RUN_CHATTERING, m->t, indicator, 0.0);
    }
    const Outcome outcome = slide_begin(m, indicator);
    if (outcome != FINE) {
        return outcome;
    }
    while (r->n_events > 0) {
        const MasterEvent *last = &r->events[r->n_events - 1];
        if (last->kind != EVENT_STATE || last->indicator != indicator || !zeno_at_once(m, last->time)) {
            break;
        }
        r->n_events--;
    }
    log_event(m, EVENT_SLIDE, indicator, m->z[indicator], 0.0);
    m->watch[indicator].returns = 0;
    return FINE;
}

/* what the fired indicators mean, after their event */
static Outcome watch_fired(Master *m)
{
    int moved = memcmp(m->before, m->x, (size_t)m->n * sizeof *m->x) != 0;
    for (int i = 0; i < m->nz; i++) {
        if (!m->fired[i]) {
            continue;
        }
        int slides = 0, returned = 0;
        const double before = m->z[i];
        const Outcome outcome = zeno_watch(m, i, moved, &slides, &returned);
        if (outcome != FINE) {
            return outcome;
        }
        /* an indicator that was exactly zero has only left it */
        returned |= before == 0.0 && !moved;
        if (!returned) {
            log_event(m, EVENT_STATE, i, before, m->z1[i]);
        }
        if (slides) {
            return begin_slide(m, i);
        }
    }
    return FINE;
}

typedef struct {
    int state, time, step, knot, jump;
} Causes;

static Outcome handle_event(Master *m, const Causes *causes)
{
    const int sliding = m->slide.n;
    memcpy(m->before, m->x, (size_t)m->n * sizeof *m->x);
    if (zeno_stalled(m) != FINE) {
        return STOP;
    }
    for (int i = 0; i < m->nz && m->slide.n; i++) {
        if (!m->fired[i] || !slide_along(m, i)) {
            continue;
        }
        log_event(m, EVENT_LEAVE, i, m->z[i], 0.0);
        m->fired[i] = 0;
        const Outcome outcome = slide_leave(m, i);
        if (outcome != FINE) {
            return outcome == STOP ? STOP : field_report(m, RUN_CHATTERING, m->t, i, 0.0);
        }
    }
    Outcome outcome = events_update(m, 1, causes->jump);
    if (outcome != FINE) {
        return outcome;
    }
    m->fresh = 1;
    if (causes->time) {
        log_event(m, EVENT_TIME, -1, 0.0, 0.0);
    }
    if (causes->step) {
        log_event(m, EVENT_STEP, -1, 0.0, 0.0);
    }
    if (causes->jump) {
        log_event(m, EVENT_INPUT, -1, 0.0, 0.0);
    }
    if (m->terminate) {
        return FINE;
    }
    if (causes->state) {
        outcome = fmi_indicators(m->fmu, m->z1) >= FMI_DISCARD
                      ? field_report(m, RUN_FMI_ERROR, m->t, F_GET_INDICATORS, FMI_ERROR)
                      : watch_fired(m);
    }
    for (int left = 0; outcome == FINE && m->slide.n && sliding && left >= 0;) {
        const int first = m->slide.indicator[0];
        outcome = slide_resume(m, &left);
        if (left >= 0) {
            log_event(m, EVENT_LEAVE, left, 0.0, 0.0);
        }
        outcome = outcome == SHORTER ? field_report(m, RUN_CHATTERING, m->t, first, 0.0) : outcome;
    }
    return outcome;
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
    outcome = outcome == FINE ? field_at(m, m->t, m->x) : outcome;
    if (outcome != FINE) {
        return outcome == STOP ? STOP : field_report(m, RUN_FMI_ERROR, m->t, F_SET_STATES, FMI_DISCARD);
    }
    if (m->fmu->completes) {
        const int status = fmi_completed(m->fmu, &causes.step, &m->terminate);
        if (status >= FMI_DISCARD) {
            return field_report(m, RUN_FMI_ERROR, m->t, F_COMPLETED, status);
        }
        if (m->terminate) {
            return record_here(m);
        }
    }
    causes.time = m->t >= m->next_event;
    if (m->t >= knot_after(m)) {
        causes.knot = 1;
        causes.jump = (int)r->knot_jumps[m->knot + 1];
        enter_knot(m, m->knot + 1);
        outcome = causes.jump ? FINE : field_inputs(m, m->t);
    }
    const int event = causes.state || causes.time || causes.step || causes.jump;
    if (outcome == FINE && causes.state && r->tangents) {
        outcome = tangent_before(m, m->length);
    }
    if (outcome == FINE && event) {
        outcome = handle_event(m, &causes);
    }
    if (outcome == FINE && m->fresh && !m->terminate) {
        outcome = refresh(m);
        step_careful(m);
        if (outcome == FINE && event && r->tangents) {
            tangent_after(m, causes.state);
        }
        /* an event may take the state across */
        m->crossed |= event && m->side[section] != side && ends_at(m, m->side[section]);
    } else if (outcome == FINE && m->slots && !m->terminate) {
        memcpy(m->z, m->samples, (size_t)m->slots * sizeof *m->z);
    }
    return outcome == FINE ? record_here(m) : outcome;
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
    m->h = fmin(m->h, zeno_longest_step(m));
    const double proposed = m->h;
    Outcome outcome = step_make(m, limit, &error);
    if (outcome != FINE) {
        return outcome;
    }
    const double length = m->length;
    const double longer = length * step_growth(m, error);
    if (!m->stiff) {
        m->last_error = fmax(error, 1e-4);
    }
    /* a step cut short by its end says little about the next */
    m->h = length < proposed && length >= 0.5 * limit ? fmax(longer, m->h) : longer;
    m->step_error = error;
    const int change = step_choose(m);
    outcome = events_locate(m, limit, &theta);
    const double t1 = theta > 0.0 ? fmin(m->t + theta * m->length, end) : length >= limit ? end : m->t + length;
    outcome = outcome == FINE ? record_within(m, t1) : outcome;
    if (outcome == SHORTER) {
        return field_report(m, RUN_FMI_ERROR, m->t, F_GET_INDICATORS, FMI_DISCARD);
    }
    if (outcome != FINE) {
        return outcome;
    }
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
    if (change) {
        step_change_method(m);
    }
    return outcome == FINE ? arrive(m, t1, theta) : outcome;
}

/* the rest of the run at the limit of a Zeno sequence: as it is there, if nothing else moves or comes */
static RunStatus hold(Master *m)
{
    Run *r = m->run;
    const int indicator = (int)r->report_index;
    r->report_other = -1;
    if (m->inputs_vary || fmin(m->next_event, knot_after(m)) < r->stop || refresh(m) != FINE) {
        return RUN_ZENO;
    }
    for (int i = 0; i < m->n; i++) {
        const double way = fabs(m->f[i]) * (r->stop - m->t);
        if (m->before[i] == m->x[i] && way > master_tolerances.zeno_still * fmax(fabs(m->x[i]), m->nominal[i])) {
            r->report_other = i;
            return RUN_ZENO;
        }
    }
    log_event(m, EVENT_REST, indicator, m->z[indicator], m->z[indicator]);
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times) {
        record_at(m, r->times[r->next_time], m->x, &outcome);
    }
    fmi_plain(m->fmu, F_TERMINATE);
    return outcome == FINE ? RUN_DONE : m->ended;
}

EXPORT int32_t master_run(Master *m, Run *r)
{
    m->run = r;
    m->looks = 0;
    if (m->fmu->log) {
        m->fmu->log->master = m;
    }
    Outcome outcome = r->begun ? FINE : start(m);
    if (r->method == METHOD_CO_SIMULATION) {
        return outcome == FINE ? (int32_t)cosimulation_run(m) : (int32_t)m->ended;
    }
    if (r->method == METHOD_SCHEDULED) {
        return outcome == FINE ? (int32_t)scheduled_run(m) : (int32_t)m->ended;
    }
    for (int64_t left = r->allowance; outcome == FINE && !m->terminate && !m->crossed && m->t < r->stop; left--) {
        /* room in the buffer for all indicators and what comes with them at one instant */
        const int full = r->event_capacity > 0 && r->n_events + m->nz + 8 > r->event_capacity;
        if (left == 0 || full || ticking_full(m)) {
            return RUN_MORE;
        }
        outcome = advance(m);
    }
    if (outcome != FINE && m->ended == RUN_ZENO && r->on_zeno == ZENO_HOLD) {
        return (int32_t)hold(m);
    }
    if (outcome != FINE) {
        return m->ended ? (int32_t)m->ended : (int32_t)RUN_FMI_ERROR;
    }
    if (m->terminate) {
        r->report_time = m->t;
        memcpy(m->before, m->x, (size_t)m->n * sizeof *m->x);
        log_event(m, EVENT_END, -1, 0.0, 0.0);
    }
    fmi_plain(m->fmu, F_TERMINATE);
    r->report_time = m->t;
    if (r->ends) {
        memcpy(r->ends + 2 * m->n, m->x, (size_t)m->n * sizeof *m->x);
        memcpy(r->ends + 3 * m->n, m->f, (size_t)m->n * sizeof *m->x);
    }
    return m->terminate ? RUN_TERMINATED : m->crossed ? RUN_CROSSED : RUN_DONE;
}
