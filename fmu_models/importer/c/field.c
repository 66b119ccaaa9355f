/*
 * The FMU at a time and a state with its inputs, and what its statuses mean for a run. The order of calls, wherever
 * something is read in continuous time:
 *
 *     time, inputs, states
 *     rates, for some FMUs compute only when they are asked for them, and say of everything else what it was before
 *     indicators, directional derivatives, completedIntegratorStep, event mode
 *     values, after time, inputs and states once more: rates count as all that is computed for some (OpenModelica)
 *
 * Derivatives of states are recorded as the rates say, whatever the getter of the variable says.
 */
#include "field.h"

#include <math.h>
#include <string.h>

Outcome field_report(Master *m, RunStatus status, double t, int64_t index, double value)
{
    m->ended = status;
    m->run->report_time = t;
    m->run->report_index = index;
    m->run->report_value = value;
    return STOP;
}

Outcome field_fail(Master *m, Function function, int status)
{
    if (status == FMI_DISCARD) m->refused = function;
    if (status == FMI_DISCARD) return SHORTER;
    return status > FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->asked, function, status) : FINE;
}

Outcome field_inputs(Master *m, double t)
{
    const Run *r = m->run;
    const int64_t row = m->knot * r->inputs.n;
    const double since = t - r->knot_times[m->knot];
    for (int i = 0; i < m->nu; i++)
        m->u[i] = r->knot_values[row + i] + since * r->knot_rates[row + i];
    return field_fail(m, F_SETTERS, fmi_write(m->fmu, &r->inputs, m->u));
}

Outcome field_at(Master *m, double t, const double *x)
{
    m->asked = t;
    int status = fmi_set_time(m->fmu, t);
    if (status >= FMI_DISCARD) return field_fail(m, F_SET_TIME, status);
    if (m->inputs_vary) {
        const Outcome outcome = field_inputs(m, t);
        if (outcome != FINE) return outcome;
    }
    status = fmi_set_states(m->fmu, x);
    return status >= FMI_DISCARD ? field_fail(m, F_SET_STATES, status) : FINE;
}

Outcome field_settled(Master *m, double t, const double *x)
{
    const Outcome outcome = field_at(m, t, x);
    if (outcome != FINE) return outcome;
    m->run->evaluations++;
    m->rates_status = fmi_derivatives(m->fmu, m->rates);
    memcpy(m->settled, x, (size_t)m->n * sizeof *x);
    /* beyond an event there may be no rates, and indicators all the same */
    return m->rates_status > FMI_ERROR ? field_fail(m, F_GET_DERIVATIVES, m->rates_status) : FINE;
}

int field_is_settled(const Master *m, double t, const double *x)
{
    return m->asked == t && m->rates_status < FMI_DISCARD && memcmp(m->settled, x, (size_t)m->n * sizeof *x) == 0;
}

Outcome field_values(Master *m, double t, const double *x, double *values)
{
    const Run *r = m->run;
    Outcome outcome = field_settled(m, t, x);
    outcome = outcome == FINE ? field_at(m, t, x) : outcome;
    outcome = outcome == FINE ? field_fail(m, F_GETTERS, fmi_read(m->fmu, &r->recorded, values)) : outcome;
    for (int64_t i = 0; i < r->recorded.n && outcome == FINE; i++) {
        if (r->recorded_rates[i] >= 0) {
            outcome = field_fail(m, F_GET_DERIVATIVES, m->rates_status);
            values[i] = m->rates[r->recorded_rates[i]];
        }
    }
    return outcome;
}

Outcome field_raw(Master *m, double t, const double *x, double *dx)
{
    const Outcome outcome = field_settled(m, t, x);
    if (outcome != FINE) return outcome;
    const int status = m->rates_status;
    memcpy(dx, m->rates, (size_t)m->n * sizeof *dx);
    if (status == FMI_ERROR) {
        /* FMUs say so where they should say discard: at a trial point where they have no value */
        m->trial_status = status;
        m->bad_state = -1;
        return SHORTER;
    }
    if (status >= FMI_DISCARD) return field_fail(m, F_GET_DERIVATIVES, status);
    for (int i = 0; i < m->n; i++) {
        if (!isfinite(dx[i])) {
            m->bad_state = i;
            return SHORTER;
        }
    }
    return FINE;
}

Outcome field_indicators(Master *m, double t, const double *x, double *z)
{
    const Outcome outcome = field_settled(m, t, x);
    if (outcome != FINE) return outcome;
    const int status = fmi_indicators(m->fmu, z);
    return status >= FMI_DISCARD ? field_fail(m, F_GET_INDICATORS, status) : FINE;
}

double field_norm(const Master *m, const double *v, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < m->n; i++) {
        const double size = fmax(fabs(x[i]), fabs(y[i]));
        const double part = v[i] / (m->nominal[i] + size);
        sum += part * part;
    }
    return sqrt(sum / (m->n > 0 ? m->n : 1)) / m->run->tolerance;
}
