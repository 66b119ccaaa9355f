/*
 * The derivative Phi of the states by those at the start, for whoever wants it.
 *
 *     along a step:     Phi' = J(t, x(t)) Phi   by Gauss's method of order 8, which has its nodes on the dense output;
 *                       J by directional derivatives, or by central differences of the rates
 *     across an event of one indicator z that leaves the states where they are, with f- and f+ the field before and
 *     after it:         Phi <- Phi + (f+ - f-) (grad z . Phi) / (dz/dt along f-)
 *     a time event:     nothing
 *     all others (states that move, several indicators at once, a graze, a sliding motion) are counted as missed
 *
 * Sources: Hairer and Wanner II, table 5.1 (the method); M. A. Aizerman, F. R. Gantmakher, Q. J. Mech. Appl. Math. 11
 * (1958) (the event).
 */
#include "tangent.h"

#include "dense_output.h"
#include "field.h"
#include "linear.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { STAGES = 4 };
static const double GAUSS_NODE[STAGES] = {0.069431844202973712388, 0.33000947820757186760, 0.66999052179242813240,
                                          0.93056815579702628761};
static const double GAUSS_WEIGHT[STAGES] = {0.17392742256872692869, 0.32607257743127307131, 0.32607257743127307131,
                                            0.17392742256872692869};
static const double GAUSS_MATRIX[STAGES][STAGES] = {
    {0.086963711284363464343, -0.026604180084998793313, 0.012627462689404724515, -0.0035551496857956831569},
    {0.18811811749986807165, 0.16303628871563653566, -0.027880428602470895224, 0.0067355005945381555154},
    {0.16719192197418877317, 0.35395300603374396654, 0.16303628871563653566, -0.014190694931141142964},
    {0.17748257225452261184, 0.31344511474186834680, 0.35267675751627186463, 0.086963711284363464343},
};

void tangent_start(Master *m)
{
    Run *r = m->run;
    const size_t bytes = (size_t)m->n * sizeof *m->x;
    r->missed = 0;
    memcpy(r->ends, m->x, bytes);
    memcpy(r->ends + m->n, m->f, bytes);
    memset(r->tangents, 0, (size_t)m->n * bytes);
    for (int i = 0; i < m->n; i++)
        r->tangents[i * m->n + i] = 1.0;
}

/* far below the size of a state, far above the rounding of a rate: for central differences */
static double change(const Master *m, int j, double x) { return cbrt(DBL_EPSILON) * fmax(m->nominal[j], fabs(x)); }

/* the Jacobian at m->stage, n x n by rows */
static Outcome jacobian(Master *m, double t, double *made)
{
    const int n = m->n, exact = (int)m->fmu->directional;
    Outcome outcome = exact ? field_settled(m, t, m->stage) : FINE;
    memset(m->seed, 0, (size_t)n * sizeof *m->seed);
    memcpy(m->point, m->stage, (size_t)n * sizeof *m->point);
    for (int j = 0; j < n && outcome == FINE; j++) {
        double step = 0.5;
        if (exact) {
            m->seed[j] = 1.0;
            const int status = fmi_directional(m->fmu, m->seed, m->error);
            m->seed[j] = 0.0;
            memset(m->error_low, 0, (size_t)n * sizeof *m->error_low);
            outcome = status >= FMI_DISCARD ? field_fail(m, F_DIRECTIONAL, status) : FINE;
        } else {
            step = change(m, j, m->stage[j]);
            m->point[j] = m->stage[j] + step;
            outcome = field_raw(m, t, m->point, m->error);
            m->point[j] = m->stage[j] - step;
            outcome = outcome == FINE ? field_raw(m, t, m->point, m->error_low) : outcome;
            m->point[j] = m->stage[j];
        }
        for (int i = 0; i < n; i++)
            made[i * n + j] = (m->error[i] - m->error_low[i]) / (2.0 * step);
    }
    return outcome;
}

Outcome tangent_slopes(Master *m)
{
    memcpy(m->stage, m->x, (size_t)m->n * sizeof *m->x);
    return jacobian(m, m->t, m->run->slopes);
}

/* y += factor * J v */
static void add_product(int n, const double *j, const double *v, int stride, double factor, double *y)
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            y[i] += factor * j[i * n + k] * v[k * stride];
}

Outcome tangent_advance(Master *m, double theta)
{
    Run *r = m->run;
    const int n = m->n, all = STAGES * n;
    const double h = theta * m->length;
    double *jacobians = r->tangent_room, *matrix = jacobians + STAGES * n * n, *rates = matrix + all * all;
    if (m->slide.n) {
        r->missed++;
        return FINE;
    }
    for (int s = 0; s < STAGES; s++) {
        dense_value(m, theta * GAUSS_NODE[s], m->stage);
        const Outcome outcome = jacobian(m, m->t + h * GAUSS_NODE[s], jacobians + s * n * n);
        if (outcome != FINE) {
            r->missed += outcome == SHORTER;
            return outcome == SHORTER ? FINE : outcome;
        }
    }
    for (int i = 0; i < all; i++) {
        for (int j = 0; j < all; j++) {
            const double a = GAUSS_MATRIX[i / n][j / n];
            matrix[i * all + j] = (i == j) - h * a * jacobians[i / n * n * n + i % n * n + j % n];
        }
    }
    if (!linear_real_factor(matrix, linear_dense(all), r->tangent_pivots)) {
        r->missed++;
        return FINE;
    }
    for (int column = 0; column < n; column++) {
        memset(rates, 0, (size_t)all * sizeof *rates);
        for (int s = 0; s < STAGES; s++)
            add_product(n, jacobians + s * n * n, r->tangents + column, n, 1.0, rates + s * n);
        linear_real_solve(matrix, linear_dense(all), r->tangent_pivots, rates);
        for (int s = 0; s < STAGES; s++)
            for (int i = 0; i < n; i++)
                r->tangents[i * n + column] += h * GAUSS_WEIGHT[s] * rates[s * n + i];
    }
    return FINE;
}

/* the indicator along a line through the end of the step: (z(+) - z(-)) / 2 */
static Outcome half_difference(Master *m, int indicator, const double *along, double time, double *found)
{
    double z[2] = {0.0, 0.0};
    for (int side = 0; side < 2; side++) {
        const double sign = side ? 1.0 : -1.0;
        for (int i = 0; i < m->n; i++)
            m->point[i] = m->x[i] + sign * along[i];
        const Outcome outcome = field_indicators(m, m->t + sign * time, m->point, m->z1);
        if (outcome != FINE) return outcome;
        z[side] = m->z1[indicator];
    }
    *found = 0.5 * (z[1] - z[0]);
    return FINE;
}

Outcome tangent_before(Master *m, double length)
{
    Run *r = m->run;
    const int n = m->n;
    double *field = r->tangent_room, *row = field + n;
    int indicator = -1, fired = 0;
    for (int i = 0; i < m->nz; i++) {
        indicator = m->fired[i] ? i : indicator;
        fired += m->fired[i] != 0;
    }
    memset(row, 0, (size_t)n * sizeof *row);
    Outcome outcome = field_raw(m, m->t, m->x, field);
    double rate = 0.0;
    if (fired == 1 && outcome == FINE) {
        const double time = cbrt(DBL_EPSILON) * length;
        memset(m->seed, 0, (size_t)n * sizeof *m->seed);
        for (int j = 0; j < n && outcome == FINE; j++) {
            m->seed[j] = change(m, j, m->x[j]);
            double gradient = 0.0;
            outcome = half_difference(m, indicator, m->seed, 0.0, &gradient);
            gradient /= m->seed[j];
            m->seed[j] = 0.0;
            for (int k = 0; k < n; k++)
                row[k] += gradient * r->tangents[j * n + k];
        }
        for (int i = 0; i < n; i++)
            m->error[i] = time * field[i];
        outcome = outcome == FINE ? half_difference(m, indicator, m->error, time, &rate) : outcome;
        rate /= time;
        for (int k = 0; k < n; k++)
            row[k] /= rate;
    }
    if (fired > 1 || (fired == 1 && !(fabs(rate) > 0.0)) || outcome == SHORTER) {
        r->missed++;
        memset(row, 0, (size_t)n * sizeof *row);
        outcome = outcome == SHORTER ? FINE : outcome;
    }
    return outcome == FINE ? field_settled(m, m->t, m->x) : outcome;
}

void tangent_after(Master *m, int states_decide)
{
    Run *r = m->run;
    const int n = m->n;
    const double *field = r->tangent_room, *row = field + n;
    if (memcmp(m->before, m->x, (size_t)n * sizeof *m->x) != 0 || m->slide.n) {
        r->missed++;
        return;
    }
    for (int i = 0; i < n && states_decide; i++)
        for (int k = 0; k < n; k++)
            r->tangents[i * n + k] += (m->f[i] - field[i]) * row[k];
}
