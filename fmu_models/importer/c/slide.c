/*
 * Sliding of a foreign FMU along the surface z = 0 of an indicator, by Filippov's convex mean
 * (A. F. Filippov, Differential Equations with Discontinuous Righthand Sides (1988), section 4).
 *
 *     modes:    the FMU chooses its mode by the side it is on: x is put a little above, then a little below the
 *               surface, each time with an update of its discrete states; its field at x itself is then f+ or f-, the
 *               rate of z along it w+ or w-
 *     mean:     w+ < 0 < w-: both lead to the surface; x' = a f+ + (1 - a) f-, a = w- / (w- - w+), for which z stays
 *     begin:    the least distance from the surface at which the two modes show so; none: the FMU does not let both
 *               sides be evaluated, or its states jump there, and the run stops
 *     project:  after each step x goes back to the surface along the gradient of z
 *     leave:    -w+ falls to zero: upwards; w- falls to zero: downwards. Both are event indicators of the sliding
 *               motion
 */
#include "slide.h"

#include "field.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* gradient of the indicator and the way off its surface; 0 if it depends on no state */
static Outcome find_normal(Master *m, int *found)
{
    Slide *s = &m->slide;
    const size_t bytes = (size_t)m->n * sizeof *m->x;
    double squares = 0.0;
    memcpy(s->point, m->x, bytes);
    for (int j = 0; j < m->n; j++) {
        const double step = cbrt(DBL_EPSILON) * fmax(m->nominal[j], fabs(m->x[j]));
        double z[2] = {0.0, 0.0};
        for (int sign = 0; sign < 2; sign++) {
            s->point[j] = m->x[j] + (sign ? step : -step);
            const Outcome outcome = field_indicators(m, m->t, s->point, s->z);
            if (outcome != FINE) {
                return outcome;
            }
            z[sign] = s->z[s->indicator];
        }
        s->point[j] = m->x[j];
        s->gradient[j] = (z[1] - z[0]) / (2.0 * step) * m->nominal[j];
        squares += s->gradient[j] * s->gradient[j];
    }
    for (int j = 0; j < m->n; j++) {
        s->normal[j] = squares > 0.0 ? m->nominal[j] * s->gradient[j] / squares : 0.0;
        m->run->report_gradient[j] = s->gradient[j];
    }
    *found = squares > 0.0 && isfinite(squares);
    return FINE;
}

/* the point near x that is the offset off the surface: trial points of a step are not on it */
static Outcome place_beside(Master *m, double t, const double *x, double side)
{
    Slide *s = &m->slide;
    double lift = side * s->offset;
    for (int round = 0; round < 4; round++) {
        for (int i = 0; i < m->n; i++) {
            s->point[i] = x[i] + lift * s->normal[i];
        }
        const Outcome outcome = field_indicators(m, t, s->point, s->z);
        const double z = s->z[s->indicator];
        if (outcome != FINE || fabs(z - side * s->offset) <= 0.5 * s->offset) {
            return outcome;
        }
        lift += side * s->offset - z;
    }
    return FINE;
}

/* let the FMU choose its mode for one side; agreed 0 if it moves the states there */
static Outcome take_side(Master *m, double t, const double *x, double side, int *agreed)
{
    Slide *s = &m->slide;
    Update update = {1, 0, 0, 0, INFINITY};
    const Outcome outcome = place_beside(m, t, x, side);
    if (outcome != FINE) {
        return outcome;
    }
    int status = fmi_plain(m->fmu, F_ENTER_EVENT);
    for (int round = 0; status < FMI_DISCARD && update.again && !update.terminate; round++) {
        if (round > master_tolerances.event_iterations) {
            return field_report(m, RUN_EVENT_ITERATION, t, s->indicator, round);
        }
        status = fmi_update(m->fmu, &update);
    }
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, t, F_UPDATE, status);
    }
    m->next_event = update.next_time;
    m->terminate |= update.terminate;
    status = fmi_plain(m->fmu, F_ENTER_CONTINUOUS);
    status = status >= FMI_DISCARD ? status : fmi_get_states(m->fmu, s->check);
    if (status >= FMI_DISCARD) {
        return field_report(m, RUN_FMI_ERROR, t, F_ENTER_CONTINUOUS, status);
    }
    *agreed = !update.terminate;
    for (int i = 0; i < m->n; i++) {
        *agreed &= fabs(s->check[i] - s->point[i]) <= 1e-12 * m->nominal[i];
    }
    s->side = side;
    return FINE;
}

/* rate of the indicator along a field of the FMU's present mode: a one-sided difference of second order, for time must
   not go back */
static Outcome rate_along(Master *m, double t, const double *x, const double *dx, double *rate)
{
    Slide *s = &m->slide;
    double speed = 0.0;
    double z[3];
    for (int i = 0; i < m->n; i++) {
        speed = fmax(speed, fabs(dx[i]) / fmax(m->nominal[i], fabs(x[i])));
    }
    const double step = 1e-5 * fmin(1.0 / fmax(speed, DBL_MIN), m->run->stop - m->run->start);
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < m->n; i++) {
            s->check[i] = x[i] + k * step * dx[i];
        }
        const Outcome outcome = field_indicators(m, t + k * step, s->check, s->z);
        if (outcome != FINE) {
            return outcome;
        }
        z[k] = s->z[s->indicator];
    }
    *rate = (-3.0 * z[0] + 4.0 * z[1] - z[2]) / (2.0 * step);
    return FINE;
}

/* fields and rates on both sides, beginning with the side the FMU is on */
static Outcome both_sides(Master *m, double t, const double *x, int *agreed)
{
    Slide *s = &m->slide;
    const double first = s->side;
    *agreed = 1;
    for (int k = 0; k < 2; k++) {
        const double side = k == 0 ? first : -first;
        double *f = side > 0.0 ? s->above : s->below;
        int agrees = 0;
        Outcome outcome = take_side(m, t, x, side, &agrees);
        outcome = outcome == FINE ? field_raw(m, t, x, f) : outcome;
        outcome = outcome == FINE ? rate_along(m, t, x, f, side > 0.0 ? &s->rate_above : &s->rate_below) : outcome;
        if (outcome != FINE) {
            return outcome;
        }
        *agreed &= agrees;
    }
    s->share = s->rate_below / (s->rate_below - s->rate_above);
    return FINE;
}

Outcome slide_field(Master *m, double t, const double *x, double *dx)
{
    Slide *s = &m->slide;
    int agreed;
    const Outcome outcome = both_sides(m, t, x, &agreed);
    if (outcome != FINE) {
        return outcome;
    }
    if (!agreed || !(s->rate_below > s->rate_above)) {
        return SHORTER;
    }
    for (int i = 0; i < m->n; i++) {
        dx[i] = s->share * s->above[i] + (1.0 - s->share) * s->below[i];
    }
    return FINE;
}

Outcome slide_conditions(Master *m, double t, const double *x, double *z)
{
    Slide *s = &m->slide;
    int agreed;
    Outcome outcome = both_sides(m, t, x, &agreed);
    outcome = outcome == FINE ? field_indicators(m, t, x, z) : outcome;
    z[s->indicator] = -s->rate_above;
    z[m->nz] = s->rate_below;
    return outcome;
}

Outcome slide_project(Master *m)
{
    Slide *s = &m->slide;
    int found = 0;
    Outcome outcome = find_normal(m, &found);
    for (int round = 0; round < 2 && outcome == FINE && found; round++) {
        outcome = field_indicators(m, m->t, m->x, s->z);
        for (int i = 0; i < m->n; i++) {
            m->x[i] -= s->z[s->indicator] * s->normal[i];
        }
    }
    return outcome;
}

static int attracts(const Slide *s) { return s->rate_above < 0.0 && s->rate_below > 0.0; }

/* both sides attract, and are the same again when asked the other way round: the mode is that of the side and of
   nothing else */
static Outcome both_attract(Master *m, int *sure)
{
    Slide *s = &m->slide;
    int agreed;
    Outcome outcome = both_sides(m, m->t, m->x, &agreed);
    *sure = outcome == FINE && agreed && attracts(s);
    if (!*sure) {
        return outcome;
    }
    const double above = s->rate_above, below = s->rate_below;
    outcome = both_sides(m, m->t, m->x, &agreed);
    *sure = outcome == FINE && agreed && fabs(above - s->rate_above) <= 1e-3 * fabs(above)
            && fabs(below - s->rate_below) <= 1e-3 * fabs(below);
    return outcome;
}

Outcome slide_begin(Master *m, int indicator)
{
    Slide *s = &m->slide;
    int found = 0, sure = 0;
    if (s->active) {
        m->run->report_other = s->indicator;
        s->indicator = indicator;
        if (find_normal(m, &found) == STOP) {
            return STOP;
        }
        return field_report(m, RUN_CHATTERING_OF_TWO, m->t, indicator, 0.0);
    }
    s->indicator = indicator;
    s->side = m->side[indicator];
    Outcome outcome = find_normal(m, &found);
    double size = 0.0;
    for (int j = 0; j < m->n; j++) {
        size = fmax(size, fabs(s->gradient[j]));
    }
    /* from the rounding of the states to what would be seen as a wrong result */
    for (double part = 1e-14; outcome == FINE && found && part < 1e-5; part *= 10.0) {
        s->offset = part * size;
        outcome = both_attract(m, &sure);
        if (sure) {
            s->active = 1;
            m->run->slides++;
            m->fresh = 1;
            m->previous_ready = m->jacobian_ready = 0;
            return slide_project(m);
        }
    }
    return outcome == STOP ? STOP : field_report(m, RUN_CHATTERING, m->t, indicator, 0.0);
}

Outcome slide_leave(Master *m, double side)
{
    Slide *s = &m->slide;
    int agreed;
    s->active = 0;
    m->previous_ready = m->jacobian_ready = 0;
    m->fresh = 1;
    const Outcome outcome = take_side(m, m->t, m->x, side, &agreed);
    if (outcome == FINE) {
        memcpy(m->x, s->point, (size_t)m->n * sizeof *m->x);
    }
    return outcome;
}

Outcome slide_resume(Master *m, int *left)
{
    Slide *s = &m->slide;
    int agreed;
    *left = 0;
    const Outcome outcome = both_sides(m, m->t, m->x, &agreed);
    if (outcome != FINE || (agreed && attracts(s))) {
        return outcome;
    }
    *left = 1;
    return slide_leave(m, s->rate_above >= 0.0 ? 1.0 : -1.0);
}

Outcome slide_values(Master *m, double t, const double *x, double *values)
{
    Slide *s = &m->slide;
    const Variables *recorded = &m->run->recorded;
    int agreed;
    Outcome outcome = both_sides(m, t, x, &agreed);
    const double share = fmin(fmax(s->share, 0.0), 1.0);
    for (int k = 0; k < 2 && outcome == FINE; k++) {
        outcome = k == 0 ? FINE : take_side(m, t, x, -s->side, &agreed);
        outcome = outcome == FINE ? field_at(m, t, x) : outcome;
        const int status = fmi_read(m->fmu, recorded, s->side > 0.0 ? values : s->values);
        outcome = outcome == FINE ? field_fail(m, F_GETTERS, status) : outcome;
    }
    for (int64_t i = 0; i < recorded->n; i++) {
        const int mixes = recorded->types[i] == T_FLOAT64 || recorded->types[i] == T_FLOAT32;
        values[i] = mixes ? share * values[i] + (1.0 - share) * s->values[i] : share >= 0.5 ? values[i] : s->values[i];
    }
    return outcome;
}
