/*
 * Sliding of a foreign FMU along the surface z = 0 of an indicator, or of several at once, by the convex mean of the
 * fields on all sides (surfaces.c; A. F. Filippov, Differential Equations with Discontinuous Righthand Sides (1988),
 * section 4).
 *
 *     begin:    the least distance from the surfaces at which the modes show that all sides lead to them; none: the FMU
 *               does not let the sides be evaluated, or its states jump there, and the run stops
 *     project:  after each step x goes back to the surfaces along the gradients
 *     leave:    4 a (1 - a) falls to zero, with a the share of the upper side of a surface: an event indicator of the
 *               sliding motion in the place of z
 */
#include "slide.h"

#include "field.h"
#include "surfaces.h"

#include <math.h>
#include <string.h>

Outcome slide_field(Master *m, double t, const double *x, double *dx)
{
    Slide *s = &m->slide;
    int solved;
    const Outcome outcome = surfaces_mean(m, t, x, &solved);
    if (outcome != FINE) return outcome;
    if (!solved || !surfaces_attract(s)) return SHORTER;
    memset(dx, 0, (size_t)m->n * sizeof *dx);
    for (int sides = 0; sides < 1 << s->n; sides++) {
        const double weight = surfaces_weight(s, sides);
        for (int i = 0; i < m->n; i++)
            dx[i] += weight * s->fields[sides * m->n + i];
    }
    return FINE;
}

Outcome slide_conditions(Master *m, double t, const double *x, double *z)
{
    Slide *s = &m->slide;
    int solved;
    Outcome outcome = surfaces_mean(m, t, x, &solved);
    outcome = outcome == FINE ? field_indicators(m, t, x, z) : outcome;
    for (int i = 0; i < s->n; i++)
        z[s->indicator[i]] = 4.0 * s->share[i] * (1.0 - s->share[i]);
    return outcome;
}

Outcome slide_project(Master *m)
{
    Slide *s = &m->slide;
    int found = 0;
    Outcome outcome = surfaces_normals(m, &found);
    for (int round = 0; round < 2 && outcome == FINE && found; round++) {
        outcome = field_indicators(m, m->t, m->x, s->z);
        for (int i = 0; i < s->n; i++)
            for (int j = 0; j < m->n; j++)
                m->x[j] -= s->z[s->indicator[i]] * s->normal[i * m->n + j];
    }
    return outcome;
}

/* all sides lead to the surfaces, and are the same again when asked in another order: the mode is that of the sides and
   of nothing else */
static Outcome all_attract(Master *m, int *sure)
{
    Slide *s = &m->slide;
    double rates[SIDES][SURFACES];
    int solved;
    Outcome outcome = surfaces_mean(m, m->t, m->x, &solved);
    *sure = outcome == FINE && solved && surfaces_attract(s) && surfaces_inside(s);
    if (!*sure) return outcome;
    memcpy(rates, s->rates, sizeof rates);
    outcome = surfaces_mean(m, m->t, m->x, &solved);
    *sure = outcome == FINE && solved && surfaces_inside(s);
    for (int k = 0; k < s->n << s->n; k++) {
        const double one = rates[k / s->n][k % s->n], other = s->rates[k / s->n][k % s->n];
        *sure &= fabs(one - other) <= 1e-3 * fabs(one);
    }
    return outcome;
}

/* with the surfaces entered in slide, at the least distance at which it can be done */
static Outcome try_all(Master *m, int *sure)
{
    Slide *s = &m->slide;
    int found = 1;
    Outcome outcome = FINE;
    *sure = 0;
    /* from the rounding of the states to what would be seen as a wrong result */
    for (s->part = 1e-14; outcome == FINE && found && s->part < 1e-5 && !*sure; s->part *= *sure ? 1.0 : 10.0) {
        outcome = surfaces_normals(m, &found);
        outcome = outcome == FINE && found ? all_attract(m, sure) : outcome;
    }
    return outcome;
}

static void take_out(Slide *s, int k)
{
    for (int i = k; i < s->n - 1; i++)
        s->indicator[i] = s->indicator[i + 1];
    s->n--;
    s->sides = (s->sides & ((1 << k) - 1)) | (s->sides >> (k + 1) << k);
}

Outcome slide_begin(Master *m, int indicator)
{
    Slide *s = &m->slide;
    const int before = s->n;
    int sure = 0;
    m->run->report_other = before ? s->indicator[0] : -1;
    if (before == SURFACES) {
        memset(m->run->report_gradient, 0, (size_t)m->n * sizeof *m->x);
        return field_report(m, RUN_CHATTERING_OF_MANY, m->t, indicator, SURFACES);
    }
    s->sides = (before ? s->sides : 0) | (m->side[indicator] > 0) << before;
    s->indicator[s->n++] = indicator;
    const Outcome outcome = try_all(m, &sure);
    if (outcome == STOP || !sure) {
        s->n = before;
        const RunStatus why = before ? RUN_CHATTERING_OF_TWO : RUN_CHATTERING;
        return outcome == STOP ? STOP : field_report(m, why, m->t, indicator, 0.0);
    }
    m->run->slides++;
    m->run->most_surfaces = m->run->most_surfaces > s->n ? m->run->most_surfaces : s->n;
    m->run->by_convention += s->n > 1 && !surfaces_additive(m);
    m->fresh = 1;
    m->previous_ready = m->jacobian_ready = 0;
    return slide_project(m);
}

/* the number of an indicator among the surfaces, or -1 */
static int number(const Slide *s, int indicator)
{
    for (int i = 0; i < s->n; i++)
        if (s->indicator[i] == indicator) return i;
    return -1;
}

int slide_along(const Master *m, int indicator) { return number(&m->slide, indicator) >= 0; }

static Outcome leave(Master *m, int k, int above)
{
    Slide *s = &m->slide;
    const int sides = (s->sides & ~(1 << k)) | above << k;
    int agreed;
    m->previous_ready = m->jacobian_ready = 0;
    m->fresh = 1;
    const Outcome outcome = surfaces_take(m, sides, &agreed);
    if (outcome == FINE) memcpy(m->x, s->point, (size_t)m->n * sizeof *m->x);
    take_out(s, k);
    return outcome;
}

Outcome slide_leave(Master *m, int indicator)
{
    Slide *s = &m->slide;
    const int k = number(s, indicator);
    int solved;
    const Outcome outcome = surfaces_mean(m, m->t, m->x, &solved);
    return outcome == FINE ? leave(m, k, s->share[k] > 0.5) : outcome;
}

Outcome slide_resume(Master *m, int *left)
{
    Slide *s = &m->slide;
    int found, solved, worst = 0;
    *left = -1;
    Outcome outcome = surfaces_normals(m, &found);
    outcome = outcome == FINE ? surfaces_mean(m, m->t, m->x, &solved) : outcome;
    if (outcome != FINE || (solved && surfaces_attract(s) && surfaces_inside(s))) return outcome;
    for (int i = 1; i < s->n; i++)
        worst = fabs(s->share[i] - 0.5) > fabs(s->share[worst] - 0.5) ? i : worst;
    *left = s->indicator[worst];
    /* one side leads away: of one surface that is seen by the rate there */
    const int above = s->n == 1 ? s->rates[1][0] >= 0.0 : s->share[worst] > 0.5;
    return leave(m, worst, above);
}

Outcome slide_values(Master *m, double t, const double *x, double *values)
{
    Slide *s = &m->slide;
    const Variables *recorded = &m->run->recorded;
    int solved;
    Outcome outcome = surfaces_mean(m, t, x, &solved);
    const int first = s->sides;
    double largest = -1.0;
    for (int i = 0; i < s->n; i++)
        s->share[i] = fmin(fmax(s->share[i], 0.0), 1.0);
    for (int k = 0; k < 1 << s->n && outcome == FINE; k++) {
        const int sides = first ^ k ^ k >> 1;
        const double weight = surfaces_weight(s, sides);
        const int heaviest = weight > largest;
        int agreed;
        outcome = surfaces_take(m, sides, &agreed);
        outcome = outcome == FINE ? field_values(m, t, x, s->values) : outcome;
        for (int64_t i = 0; i < recorded->n; i++) {
            const int mixes = recorded->types[i] == T_FLOAT64 || recorded->types[i] == T_FLOAT32;
            const double sum = (k ? values[i] : 0.0) + weight * s->values[i];
            values[i] = mixes ? sum : heaviest ? s->values[i] : values[i];
        }
        largest = fmax(largest, weight);
    }
    return outcome;
}
