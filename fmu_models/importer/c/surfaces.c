/*
 * The mean of the fields on all sides of the surfaces z_1 = 0, ..., z_k = 0 along which a foreign FMU slides.
 *
 *     modes:    the FMU chooses its mode by the side it is on: the state where the step begins is put a little beside
 *               all surfaces, each time with an update of its discrete states; its field at x is then that of these
 *               sides, f_s with s one of the 2^k combinations, and w_s the rates of z along it. Not beside x itself:
 *               at a trial point beyond the zero of another indicator the update would change that mode within a step
 *     mean:     x' = sum over s of (product over i of a_i above the i-th surface, 1 - a_i below) f_s, with the shares a
 *               for which all z stay (L. Dieci & L. Lopez, J. Comput. Appl. Math. 236 (2012) 967). For one surface it is
 *               Filippov's. Where the field is a sum with one term for each surface, as of dry friction in several
 *               contacts, no other mean has these rates; where it is not, it is a convention
 *     attract:  with J = d(rates)/d(shares), -J has positive leading minors and a positive diagonal
 */
#include "surfaces.h"

#include "field.h"
#include "linear.h"
#include "zeno.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { SHARE_ITERATIONS = 30 };

/* normals from gradients: off one surface and along all others. 0 if gradients vanish or are nearly parallel */
static int find_duals(Master *m)
{
    Slide *s = &m->slide;
    const int n = m->n, k = s->n + s->near;
    double gram[SURFACES * SURFACES], size[SURFACES], unit[SURFACES];
    int pivot[SURFACES];
    for (int i = 0; i < k; i++) {
        size[i] = 0.0;
        for (int j = 0; j < n; j++)
            size[i] = fmax(size[i], fabs(s->gradient[i * n + j]));
        if (!(size[i] > 0.0 && isfinite(size[i]))) return 0;
        s->offset[i] = s->part * size[i];
    }
    for (int i = 0; i < k * k; i++) {
        const double *one = s->gradient + i / k * n, *other = s->gradient + i % k * n;
        gram[i] = 0.0;
        for (int j = 0; j < n; j++)
            gram[i] += one[j] / size[i / k] * (other[j] / size[i % k]);
    }
    int fine = linear_real_factor(gram, linear_dense(k), pivot);
    for (int i = 0; i < k && fine; i++)
        fine = fabs(gram[i * k + i]) > 1e-10;
    for (int i = 0; i < k && fine; i++) {
        memset(unit, 0, sizeof unit);
        unit[i] = 1.0;
        linear_real_solve(gram, linear_dense(k), pivot, unit);
        for (int j = 0; j < n; j++) {
            double sum = 0.0;
            for (int l = 0; l < k; l++)
                sum += unit[l] / size[l] * s->gradient[l * n + j];
            s->normal[i * n + j] = m->nominal[j] * sum / size[i];
        }
    }
    return fine;
}

/* indicators with an event just now: where they are zero to rounding, a little off a surface is on their other side */
static Outcome find_near(Master *m)
{
    Slide *s = &m->slide;
    const Outcome outcome = field_indicators(m, m->t, m->x, s->z);
    s->near = 0;
    for (int i = 0; i < m->nz && s->n + s->near < SURFACES; i++) {
        int known = 0;
        for (int k = 0; k < s->n; k++)
            known |= s->indicator[k] == i;
        if (!known && zeno_at_once(m, m->watch[i].time)) s->indicator[s->n + s->near++] = i;
    }
    for (int i = 0; i < s->n + s->near; i++)
        s->home[i] = s->z[s->indicator[i]];
    return outcome;
}

Outcome surfaces_normals(Master *m, int *found)
{
    Slide *s = &m->slide;
    const Outcome near = find_near(m);
    if (near != FINE) return near;
    memcpy(s->point, m->x, (size_t)m->n * sizeof *m->x);
    for (int j = 0; j < m->n; j++) {
        const double step = cbrt(DBL_EPSILON) * fmax(m->nominal[j], fabs(m->x[j]));
        for (int sign = 0; sign < 2; sign++) {
            s->point[j] = m->x[j] + (sign ? step : -step);
            const Outcome outcome = field_indicators(m, m->t, s->point, s->z);
            if (outcome != FINE) return outcome;
            for (int i = 0; i < s->n + s->near; i++) {
                double *slope = s->gradient + i * m->n + j;
                const double z = s->z[s->indicator[i]];
                *slope = sign ? (z - *slope) / (2.0 * step) * m->nominal[j] : z;
            }
        }
        s->point[j] = m->x[j];
    }
    /* the report of a failure is about the one that came last */
    memcpy(m->run->report_gradient, s->gradient + (s->n - 1) * m->n, (size_t)m->n * sizeof *s->gradient);
    *found = find_duals(m);
    if (!*found && s->near) {
        s->near = 0;
        *found = find_duals(m);
    }
    return FINE;
}

/* the point near x that is the offsets off the surfaces */
static Outcome place_beside(Master *m, int sides)
{
    Slide *s = &m->slide;
    double lift[SURFACES], wanted[SURFACES];
    const int all = s->n + s->near;
    for (int i = 0; i < all; i++) {
        const int above = i < s->n ? sides >> i & 1 : s->home[i] > 0.0;
        const double off = i < s->n ? s->offset[i] : fmax(s->offset[i], fabs(s->home[i]));
        wanted[i] = above ? off : -off;
        lift[i] = wanted[i] - (i < s->n ? 0.0 : s->home[i]);
    }
    for (int round = 0; round < 4; round++) {
        for (int j = 0; j < m->n; j++) {
            double sum = 0.0;
            for (int i = 0; i < all; i++)
                sum += lift[i] * s->normal[i * m->n + j];
            s->point[j] = m->x[j] + sum;
        }
        const Outcome outcome = field_indicators(m, m->t, s->point, s->z);
        if (outcome != FINE) return outcome;
        int there = 1;
        for (int i = 0; i < all; i++) {
            const double rest = wanted[i] - s->z[s->indicator[i]];
            there &= fabs(rest) <= 0.5 * s->offset[i];
            lift[i] += rest;
        }
        if (there) return FINE;
    }
    return FINE;
}

Outcome surfaces_take(Master *m, int sides, int *agreed)
{
    Slide *s = &m->slide;
    const int newest = s->n > 0 ? s->indicator[s->n - 1] : -1;
    Update update = {1, 0, 0, 0, INFINITY};
    const Outcome outcome = place_beside(m, sides);
    if (outcome != FINE) return outcome;
    int status = fmi_plain(m->fmu, F_ENTER_EVENT);
    for (int round = 0; status < FMI_DISCARD && update.again && !update.terminate; round++) {
        if (round > master_tolerances.event_iterations)
            return field_report(m, RUN_EVENT_ITERATION, m->t, newest, round);
        status = fmi_update(m->fmu, &update);
    }
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_UPDATE, status);
    m->next_event = update.next_time;
    m->terminate |= update.terminate;
    status = fmi_plain(m->fmu, F_ENTER_CONTINUOUS);
    status = status >= FMI_DISCARD ? status : fmi_get_states(m->fmu, s->check);
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_ENTER_CONTINUOUS, status);
    *agreed = !update.terminate;
    for (int i = 0; i < m->n; i++)
        *agreed &= fabs(s->check[i] - s->point[i]) <= 1e-12 * m->nominal[i];
    s->sides = sides;
    return FINE;
}

/* rates of the indicators along a field of the FMU's present mode: a one-sided difference of second order, for time
   must not go back */
static Outcome rates_along(Master *m, double t, const double *x, const double *dx, double *rates)
{
    Slide *s = &m->slide;
    double speed = 0.0;
    for (int i = 0; i < m->n; i++)
        speed = fmax(speed, fabs(dx[i]) / fmax(m->nominal[i], fabs(x[i])));
    const double step = 1e-5 * fmin(1.0 / fmax(speed, DBL_MIN), m->run->stop - m->run->start);
    static const double weights[3] = {-3.0, 4.0, -1.0};
    memset(rates, 0, (size_t)s->n * sizeof *rates);
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < m->n; i++)
            s->check[i] = x[i] + k * step * dx[i];
        const Outcome outcome = field_indicators(m, t + k * step, s->check, s->z);
        if (outcome != FINE) return outcome;
        for (int i = 0; i < s->n; i++)
            rates[i] += weights[k] * s->z[s->indicator[i]] / (2.0 * step);
    }
    return FINE;
}

/* the weight without the factor of one surface (-1: with all) */
static double weight_but(const Slide *s, int sides, int without)
{
    double weight = 1.0;
    for (int i = 0; i < s->n; i++)
        weight *= i == without ? 1.0 : sides >> i & 1 ? s->share[i] : 1.0 - s->share[i];
    return weight;
}

double surfaces_weight(const Slide *s, int sides) { return weight_but(s, sides, -1); }

/* d(rates of the mean)/d(shares), by rows */
static void slopes(const Slide *s, double *jacobian)
{
    memset(jacobian, 0, (size_t)(s->n * s->n) * sizeof *jacobian);
    for (int sides = 0; sides < 1 << s->n; sides++) {
        for (int j = 0; j < s->n; j++) {
            const double weight = weight_but(s, sides, j) * (sides >> j & 1 ? 1.0 : -1.0);
            for (int i = 0; i < s->n; i++)
                jacobian[i * s->n + j] += weight * s->rates[sides][i];
        }
    }
}

/* the shares for which no indicator moves, by Newton's method; linear where the field is a sum */
static int find_shares(Slide *s)
{
    double jacobian[SURFACES * SURFACES], rest[SURFACES];
    int pivot[SURFACES];
    for (int i = 0; i < s->n; i++)
        s->share[i] = 0.5;
    for (int round = 0; round < SHARE_ITERATIONS; round++) {
        memset(rest, 0, sizeof rest);
        for (int sides = 0; sides < 1 << s->n; sides++)
            for (int i = 0; i < s->n; i++)
                rest[i] += surfaces_weight(s, sides) * s->rates[sides][i];
        slopes(s, jacobian);
        if (!linear_real_factor(jacobian, linear_dense(s->n), pivot)) return 0;
        linear_real_solve(jacobian, linear_dense(s->n), pivot, rest);
        double moved = 0.0;
        for (int i = 0; i < s->n; i++) {
            s->share[i] -= rest[i];
            moved = fmax(moved, fabs(rest[i]) / (1.0 + fabs(s->share[i])));
        }
        if (!(moved > 1e-14)) return isfinite(moved);
    }
    return 0;
}

Outcome surfaces_mean(Master *m, double t, const double *x, int *solved)
{
    Slide *s = &m->slide;
    /* from the sides the FMU is on, one surface crossed at a time */
    const int first = s->sides;
    *solved = 1;
    for (int k = 0; k < 1 << s->n; k++) {
        const int sides = first ^ k ^ k >> 1;
        double *f = s->fields + sides * m->n;
        int agrees = 0;
        Outcome outcome = surfaces_take(m, sides, &agrees);
        outcome = outcome == FINE ? field_raw(m, t, x, f) : outcome;
        outcome = outcome == FINE ? rates_along(m, t, x, f, s->rates[sides]) : outcome;
        if (outcome != FINE) return outcome;
        *solved &= agrees;
    }
    *solved = find_shares(s) && *solved;
    return FINE;
}

int surfaces_attract(const Slide *s)
{
    double jacobian[SURFACES * SURFACES];
    const int n = s->n;
    slopes(s, jacobian);
    for (int k = 0; k < n; k++)
        if (!(jacobian[k * n + k] < 0.0)) return 0;
    for (int k = 0; k < n; k++) {
        if (!(jacobian[k * n + k] < 0.0)) return 0;
        for (int i = k + 1; i < n; i++)
            for (int j = k + 1; j < n; j++)
                jacobian[i * n + j] -= jacobian[i * n + k] / jacobian[k * n + k] * jacobian[k * n + j];
    }
    return 1;
}

int surfaces_inside(const Slide *s)
{
    int inside = 1;
    for (int i = 0; i < s->n; i++)
        inside &= s->share[i] > 0.0 && s->share[i] < 1.0;
    return inside;
}

int surfaces_additive(const Master *m)
{
    const Slide *s = &m->slide;
    const double *none = s->fields;
    for (int sides = 0; sides < 1 << s->n; sides++) {
        for (int j = 0; j < m->n; j++) {
            double sum = none[j], size = fabs(none[j]);
            for (int i = 0; i < s->n; i++) {
                const double f = s->fields[(1 << i) * m->n + j];
                sum += sides >> i & 1 ? f - none[j] : 0.0;
                size = fmax(size, fabs(f));
            }
            if (fabs(s->fields[sides * m->n + j] - sum) > 1e-6 * fmax(size, DBL_MIN)) return 0;
        }
    }
    return 1;
}
