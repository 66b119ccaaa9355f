/*
 * Explicit Runge-Kutta steps with dense output.
 *
 *     try:    stages k_s = f(t + c_s h, x + h sum a_sj k_j); x1 = x + h sum b_j k_j; f1 = f(t + h, x1), which the next
 *             step starts with error from the embedded method; of the 8(5,3) pair: E5^2 / sqrt(E5^2 + E3^2 / 100)
 *     dense:  the cubic through values and slopes at both ends, and terms from the table (for 8(5,3) with three more
 *             stages)
 *     stiff:  the last stage and f1 are at the same time but at different states: their quotient of differences is the
 *             rate of the motion, and where length times rate stays at the border of stability, stability and not
 *             accuracy limits the steps
 */
#include "explicit.h"

#include "field.h"
#include "motion.h"

#include <math.h>
#include <string.h>

/* to = x + length * sum of weights times stages */
static void combine(const Master *m, const double *x, double length, const double *weights, int stages, double *to)
{
    const int n = m->n;
    memcpy(to, x, (size_t)n * sizeof *to);
    for (int j = 0; j < stages; j++) {
        const double weight = length * weights[j];
        if (weight != 0.0) {
            const double *k = m->k + j * n;
            for (int i = 0; i < n; i++)
                to[i] += weight * k[i];
        }
    }
}

static double embedded_error(Master *m, double length)
{
    const Tableau *w = m->tableau;
    memset(m->seed, 0, (size_t)m->n * sizeof *m->seed);
    combine(m, m->seed, length, w->e, w->stages + 1, m->error);
    const double high = field_norm(m, m->error, m->x, m->x1);
    if (!w->e_low) return high;
    combine(m, m->seed, length, w->e_low, w->stages + 1, m->error_low);
    const double low = field_norm(m, m->error_low, m->x, m->x1);
    return high > 0.0 ? high * high / sqrt(high * high + 0.01 * low * low) : 0.0;
}

Outcome explicit_try(Master *m, double length, double *error)
{
    const Tableau *w = m->tableau;
    const size_t bytes = (size_t)m->n * sizeof *m->x;
    const double *row = w->a;
    memcpy(m->k, m->f, bytes);
    for (int s = 1; s < w->stages; s++) {
        combine(m, m->x, length, row, s, m->stage);
        const Outcome outcome = motion_rates(m, m->t + w->c[s] * length, m->stage, m->k + s * m->n);
        if (outcome != FINE) return outcome;
        row += s;
    }
    combine(m, m->x, length, w->b, w->stages, m->x1);
    const Outcome outcome = motion_rates(m, m->t + length, m->x1, m->f1);
    if (outcome != FINE) return outcome;
    memcpy(m->k + w->stages * m->n, m->f1, bytes);
    *error = embedded_error(m, length);
    return FINE;
}

int explicit_is_stiff(Master *m)
{
    const double *last = m->k + (m->tableau->stages - 1) * m->n;
    double numerator = 0.0, denominator = 0.0;
    for (int i = 0; i < m->n; i++) {
        const double slope = (m->f1[i] - last[i]) / m->nominal[i];
        const double distance = (m->x1[i] - m->stage[i]) / m->nominal[i];
        numerator += slope * slope;
        denominator += distance * distance;
    }
    if (denominator > 0.0 && m->length * sqrt(numerator / denominator) > m->tableau->stability) {
        m->stiff_misses = 0;
        return ++m->stiff_hits >= 15;
    }
    if (++m->stiff_misses == 6) m->stiff_hits = 0;
    return 0;
}

Outcome explicit_dense(Master *m)
{
    const Tableau *w = m->tableau;
    const int n = m->n;
    const int width = w->stages + 1 + w->dense_stages;
    for (int s = 0; s < w->dense_stages; s++) {
        combine(m, m->x, m->length, w->dense_a + s * width, w->stages + 1 + s, m->error);
        const Outcome outcome =
            motion_rates(m, m->t + w->dense_c[s] * m->length, m->error, m->k + (w->stages + 1 + s) * n);
        if (outcome != FINE) return outcome;
    }
    double *r = m->dense;
    for (int i = 0; i < n; i++) {
        const double difference = m->x1[i] - m->x[i];
        r[i] = m->x[i];
        r[n + i] = difference;
        r[2 * n + i] = m->length * m->f[i] - difference;
        r[3 * n + i] = 2.0 * difference - m->length * (m->f1[i] + m->f[i]);
    }
    memset(m->seed, 0, (size_t)n * sizeof *m->seed);
    for (int j = 0; j < w->dense_rows; j++)
        combine(m, m->seed, m->length, w->d + j * width, width, r + (4 + j) * n);
    m->dense_terms = 4 + w->dense_rows;
    return FINE;
}
