/* Lengths of steps, and the method that makes them. */
#include "step.h"

#include "explicit.h"
#include "field.h"
#include "jacobian.h"
#include "method.h"
#include "motion.h"
#include "stiff.h"

#include <float.h>
#include <math.h>

static const double DAMPING = 0.04; /* exponent of the error of the step before */

/* Hairer, Norsett & Wanner I, section II.4: from sizes of f and of its change */
Outcome step_first(Master *m)
{
    const Run *r = m->run;
    const double tolerance = r->tolerance;
    const double size = field_norm(m, m->x, m->x, m->x) * tolerance;
    const double slope = field_norm(m, m->f, m->x, m->x) * tolerance;
    const double span = r->stop - r->start;
    m->h = size < 1e-5 || slope < 1e-5 ? 1e-6 * span : fmin(0.01 * size / slope, span);
    for (int i = 0; i < m->n; i++)
        m->stage[i] = m->x[i] + m->h * m->f[i];
    const Outcome outcome = motion_rates(m, m->t + m->h, m->stage, m->error);
    if (outcome != FINE) {
        m->h *= 1e-3;
        return outcome == STOP ? STOP : FINE;
    }
    for (int i = 0; i < m->n; i++)
        m->error[i] -= m->f[i];
    const double bend = field_norm(m, m->error, m->x, m->x) * tolerance / m->h;
    const double most = fmax(slope, bend);
    const double order = m->stiff ? 4.0 : m->tableau->order;
    const double length = most <= 1e-15 ? fmax(1e-6 * span, 1e-3 * m->h)
                                        : pow(0.01 * pow(tolerance, 0.5) / most, 1.0 / order);
    m->h = fmin(fmin(100.0 * m->h, length), span);
    return FINE;
}

/* after an event the motion may be another one: no step over more than the states' own size before the error has been
   seen */
void step_careful(Master *m)
{
    double rate = 0.0;
    for (int i = 0; i < m->n; i++)
        rate = fmax(rate, fabs(m->f[i]) / (m->nominal[i] + fabs(m->x[i])));
    m->h = rate * m->h > 1.0 ? 1.0 / rate : m->h;
}

/* the factor by which the next step may be longer than this one. The explicit methods take the error of the step before
   into account (Hairer, Norsett & Wanner I, section II.5: stabilized): where an error estimate falls by accident, a
   step that grows by it alone is far too long at the next bend, and a tighter tolerance may end in a larger error */
double step_growth(Master *m, double error)
{
    if (!m->stiff) {
        const double order = m->tableau->order, present = fmax(error, 1e-18);
        const int steady = m->last_error > 0.0 && error <= 1.0;
        const double factor = steady ? pow(present, 0.75 * DAMPING - 1.0 / order) * pow(m->last_error, DAMPING)
                                     : pow(present, -1.0 / order);
        return fmin(8.0, fmax(0.2, 0.9 * factor));
    }
    double factor = 0.8 * pow(fmax(error, 1e-12), -0.25);
    if (m->last_error > 0.0 && error <= 1.0) {
        const double trend = m->length / m->last_length * pow(m->last_error / fmax(error, 1e-12), 0.25);
        factor *= fmin(1.0, trend);
    }
    return fmin(8.0, fmax(0.2, factor));
}

/* whether two calls at one point give the same rates, as far as a step of this length can tell */
static Outcome check_rates(Master *m, double length)
{
    if (field_raw(m, m->t, m->x, m->error) != FINE || field_raw(m, m->t, m->x, m->error_low) != FINE)
        return m->ended ? STOP : FINE;
    int most = 0;
    for (int i = 0; i < m->n; i++) {
        m->error[i] = length * (m->error_low[i] - m->error[i]);
        most = fabs(m->error[i]) / m->nominal[i] > fabs(m->error[most]) / m->nominal[most] ? i : most;
    }
    return field_norm(m, m->error, m->x, m->x) > master_tolerances.noise
               ? field_report(m, RUN_RATES_DIFFER, m->t, most, fabs(m->error[most]) / length)
               : FINE;
}

/* steps so short that the run would never end: a jump that no indicator announces, or a method that does not fit; or
   rates that are no function of time and states */
static Outcome keeps_pace(Master *m)
{
    const MasterTolerances *tolerances = &master_tolerances;
    const double span = m->run->stop - m->run->start, progress = m->t - m->pace_time;
    m->pace_steps++;
    if (m->pace_steps % tolerances->noise_steps == 0 && progress < tolerances->noise_pace * span * m->pace_steps) {
        const Outcome outcome = check_rates(m, tolerances->noise_pace * span);
        if (outcome != FINE) return outcome;
    }
    if (m->pace_steps < tolerances->pace_steps) return FINE;
    m->pace_steps = 0;
    m->pace_time = m->t;
    return progress < tolerances->pace * span
               ? field_report(m, RUN_TOO_MANY_STEPS, m->t, m->stiff, progress / tolerances->pace_steps)
               : FINE;
}

Outcome step_make(Master *m, double limit, double *error)
{
    Run *r = m->run;
    const double least = 16.0 * DBL_EPSILON * fmax(fabs(m->t), 1e-290);
    for (;;) {
        double length = fmin(m->h, r->longest_step > 0.0 ? r->longest_step : INFINITY);
        if (length >= limit * (1.0 - 1e-9))
            length = limit;
        else if (length > 0.5 * limit)
            length = 0.5 * limit;
        if (keeps_pace(m) == STOP) return STOP;
        const Outcome outcome = method_try(m, length, error);
        if (outcome == STOP) return STOP;
        if (outcome == FINE && *error <= 1.0) {
            r->steps++;
            return FINE;
        }
        r->rejected++;
        m->trial_errors = m->trial_status > FMI_DISCARD ? m->trial_errors + 1 : 0;
        if (m->trial_errors > master_tolerances.trial_errors)
            return field_report(m, RUN_FMI_ERROR, m->t, F_GET_DERIVATIVES, m->trial_status);
        m->trial_status = FMI_OK;
        m->h = length * (outcome == FINE && isfinite(*error) ? fmin(0.9, step_growth(m, *error)) : 0.25);
        if (m->h < least) {
            return m->bad_state >= 0 && outcome != FINE ? field_report(m, RUN_NOT_FINITE, m->t, m->bad_state, 0.0)
                                                        : field_report(m, RUN_STEP_TOO_SMALL, m->t, -1, m->h);
        }
        m->bad_state = -1;
    }
}

int step_choose(Master *m)
{
    int change = 0;
    if (m->run->method != METHOD_AUTO) return 0;
    if (!m->stiff) {
        change = explicit_is_stiff(m);
    } else if (m->jacobian_fresh || m->calm_hits > 0) {
        m->calm_hits = m->length * jacobian_rate(m) < 1.0 ? m->calm_hits + 1 : 0;
        change = m->calm_hits >= m->calm_needed;
        m->calm_needed *= change ? 2 : 1;
    }
    return change;
}

void step_change_method(Master *m)
{
    Run *r = m->run;
    m->stiff = !m->stiff;
    m->stiff_hits = m->stiff_misses = m->calm_hits = 0;
    m->jacobian_ready = m->lu_ready = m->previous_ready = 0;
    m->last_error = 0.0;
    if (r->n_switches++ == 0) r->switch_time = m->t + m->length;
}
