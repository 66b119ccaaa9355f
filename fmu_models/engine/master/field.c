/* The right-hand side: the FMU at a time and a state with its inputs, or the mean field of a sliding motion. */
#include "solver.h"

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
    if (status == FMI_DISCARD) {
        return SHORTER;
    }
    return status > FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->t, function, status) : FINE;
}

Outcome field_inputs(Master *m, double t)
{
    const Run *r = m->run;
    const int64_t row = m->knot * r->inputs.n;
    const double since = t - r->knot_times[m->knot];
    for (int i = 0; i < m->nu; i++) {
        m->u[i] = r->knot_values[row + i] + since * r->knot_rates[row + i];
    }
    return field_fail(m, F_SETTERS, face_write(m->face, &r->inputs, m->u));
}

Outcome field_at(Master *m, double t, const double *x)
{
    int status = face_set_time(m->face, t);
    if (status >= FMI_DISCARD) {
        return field_fail(m, F_SET_TIME, status);
    }
    if (m->inputs_vary) {
        const Outcome outcome = field_inputs(m, t);
        if (outcome != FINE) {
            return outcome;
        }
    }
    status = face_set_states(m->face, x);
    return status >= FMI_DISCARD ? field_fail(m, F_SET_STATES, status) : FINE;
}

Outcome field_raw(Master *m, double t, const double *x, double *dx)
{
    Outcome outcome = field_at(m, t, x);
    if (outcome != FINE) {
        return outcome;
    }
    m->run->evaluations++;
    const int status = face_derivatives(m->face, dx);
    if (status == FMI_ERROR) {
        /* FMUs say so where they should say discard: at a trial point where they have no value */
        m->trial_status = status;
        m->bad_state = -1;
        return SHORTER;
    }
    if (status >= FMI_DISCARD) {
        return field_fail(m, F_GET_DERIVATIVES, status);
    }
    for (int i = 0; i < m->n; i++) {
        if (!isfinite(dx[i])) {
            m->bad_state = i;
            return SHORTER;
        }
    }
    return FINE;
}

Outcome field(Master *m, double t, const double *x, double *dx)
{
    return m->slide.active ? slide_field(m, t, x, dx) : field_raw(m, t, x, dx);
}

Outcome field_indicators(Master *m, double t, const double *x, double *z)
{
    if (m->slide.active) {
        return slide_conditions(m, t, x, z);
    }
    const Outcome outcome = field_at(m, t, x);
    if (outcome != FINE) {
        return outcome;
    }
    z[m->nz] = 1.0;
    const int status = face_indicators(m->face, z);
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

/* the dense output of all methods: r0 + th (r1 + (1 - th) (r2 + th (r3 + (1 - th) (...)))) */
void dense_value(const Master *m, double theta, double *x)
{
    const int n = m->n;
    const double rest = 1.0 - theta;
    const int last = m->dense_terms - 1;
    memcpy(x, m->dense + last * n, (size_t)n * sizeof *x);
    for (int k = last - 1; k >= 0; k--) {
        const double factor = k % 2 == 0 ? theta : rest;
        for (int i = 0; i < n; i++) {
            x[i] = m->dense[k * n + i] + factor * x[i];
        }
    }
}

Outcome method_try(Master *m, double length, double *error)
{
    m->dense_ready = 0;
    m->length = length;
    return m->stiff ? stiff_try(m, length, error) : explicit_try(m, length, error);
}

Outcome method_dense(Master *m)
{
    if (m->dense_ready) {
        return FINE;
    }
    m->dense_ready = 1;
    return m->stiff ? stiff_dense(m) : explicit_dense(m);
}
