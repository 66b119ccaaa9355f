/* Beginnings: of a run (reset, start values, initialization, first event iteration, length of the first step), of a piece
   between events, and of one between knots of the inputs. */
#include "begin.h"

#include "events.h"
#include "field.h"
#include "motion.h"
#include "recording.h"
#include "step.h"
#include "tangent.h"
#include "ticking.h"
#include "zeno.h"

#include <math.h>

void begin_knot(Master *m, int64_t knot)
{
    const Run *r = m->run;
    m->knot = knot;
    m->inputs_vary = 0;
    for (int i = 0; i < m->nu; i++)
        m->inputs_vary |= r->knot_rates[knot * m->nu + i] != 0.0;
}

Outcome begin_piece(Master *m)
{
    const Run *r = m->run;
    Outcome outcome = events_sides(m);
    outcome = outcome == FINE ? motion_rates(m, m->t, m->x, m->f) : outcome;
    for (int i = 0; i < m->slots && outcome == FINE; i++)
        if (!isfinite(m->z[i])) return field_report(m, RUN_BAD_INDICATOR, m->t, i, m->z[i]);
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
    m->check_pattern = 1;
    m->last_error = 0.0;
    return outcome;
}

static Outcome initialize(Master *m)
{
    Run *r = m->run;
    const FmuInstance *fmu = m->fmu;
    int status = fmu->resets ? fmi_plain(fmu, F_RESET) : FMI_OK;
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_RESET, status);
    /* which puts sizes of arrays back too */
    status = fmu->resets ? fmi_configure(fmu) : FMI_OK;
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_EXIT_CONFIGURATION, status);
    status = fmi_write(fmu, &r->starts, r->start_values);
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, status);
    status = fmi_initialize(fmu, r->start, r->stop, r->tolerance);
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_ENTER_INITIALIZATION, status);
    begin_knot(m, 0);
    if (m->nu && field_inputs(m, m->t) != FINE)
        return m->ended ? STOP : field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, FMI_DISCARD);
    if (ticking_begin(m) != FINE) return STOP;
    status = fmi_plain(fmu, F_EXIT_INITIALIZATION);
    return status >= FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->t, F_EXIT_INITIALIZATION, status) : FINE;
}

Outcome begin_run(Master *m)
{
    Run *r = m->run;
    const int integrates = r->method != METHOD_CO_SIMULATION && r->method != METHOD_SCHEDULED;
    m->nu = (int)r->inputs.n;
    m->slots = m->nz + (r->section_state != 0);
    m->t = m->asked = r->start;
    m->ended = RUN_DONE;
    m->terminate = m->crossed = 0;
    m->bad_state = -1;
    m->trial_errors = m->trial_status = 0;
    m->refused = F_GETTERS;
    m->next_event = INFINITY;
    m->stiff = r->method == METHOD_STIFF;
    m->tableau = r->method == METHOD_DOPRI5 ? &tableau_dopri5 : &tableau_dop853;
    m->stiff_hits = m->stiff_misses = m->calm_hits = 0;
    m->calm_needed = 20;
    m->jacobian_ready = m->lu_ready = m->previous_ready = 0;
    m->last_error = 0.0;
    m->slide.n = 0;
    m->length = 0.0;
    m->resolved = INFINITY;
    m->pace_steps = 0;
    m->pace_time = r->start;
    m->slide_time = -INFINITY;
    m->quick_slides = 0;
    for (int i = 0; i < 2 * m->nz && r->misses; i++)
        r->misses[i] = INFINITY;
    Outcome outcome = initialize(m);
    r->begun = 1;
    if (outcome != FINE || !integrates) return outcome;
    zeno_reset(m);
    outcome = events_update(m, 0, 0);
    if (outcome != FINE || m->terminate) return outcome;
    outcome = begin_piece(m);
    if (outcome == FINE && r->tangents) tangent_start(m);
    if (outcome == FINE && r->slopes) outcome = tangent_slopes(m);
    m->h = r->first_step;
    if (outcome == FINE && !(m->h > 0.0)) outcome = step_first(m);
    return outcome == FINE ? recording_reached(m) : outcome;
}
