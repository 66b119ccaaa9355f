/*
 * Radau IIA of order 5: stiffly accurate, L-stable, three stages (Hairer & Wanner, Solving Ordinary Differential
 * Equations II (1996), section IV.8).
 *
 *     Z = h A f(t + c h, x + Z), by simplified Newton in W = T^-1 Z, where A^-1 is block diagonal: one real and one
 *     complex system of size n per iteration, factored once per Jacobian and length
 *     error: (gamma/h I - J)^-1 (f + e Z / h); where it fails once more with f(x + error), which is right in the stiff
 *            limit
 *     dense: the cubic through x and the three stages, the polynomial of collocation itself
 */
#include "stiff.h"

#include "dense_output.h"
#include "field.h"
#include "jacobian.h"
#include "linear.h"
#include "motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { NEWTON_ITERATIONS = 7 };

static const double T[3][3] = {
    {9.1232394870892942792e-02, -0.14125529502095420843, -3.0029194105147424492e-02},
    {0.24171793270710701896, 0.20412935229379993199, 0.38294211275726193779},
    {0.96604818261509293619, 1.0, 0.0},
};
static const double TI[3][3] = {
    {4.3255798900631553510, 0.33919925181580986954, 0.54177053993587487119},
    {-4.1787185915519047273, -0.32768282076106238708, 0.47662355450055045196},
    {-0.50287263494578687595, 2.5719269498556054292, -0.59603920482822492497},
};

static const double GAMMA = 3.6378342527444957, ALPHA = 2.6810828736277523, BETA = 3.0504301992474110;
static const double ROOT6 = 2.4494897427831781;

static int factor_both(Master *m, double length)
{
    const Pattern *p = &m->pattern;
    const double real_shift = GAMMA / length;
    const double complex shift = ALPHA / length + BETA / length * I;
    m->lu_length = length;
    if (p->elimination) {
        m->lu_ready = sparse_real_factor(&m->real_factors, p, m->jacobian, real_shift)
                      && sparse_complex_factor(&m->complex_factors, p, m->jacobian, shift);
        return m->lu_ready;
    }
    const size_t entries = (size_t)m->n * (size_t)p->band.width;
    memset(m->real_lu, 0, entries * sizeof *m->real_lu);
    memset(m->complex_lu, 0, entries * sizeof *m->complex_lu);
    for (int j = 0; j < m->n; j++) {
        for (int64_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const int64_t at = linear_row(&p->band, p->place[p->row[k]]) + p->place[j];
            m->real_lu[at] = -m->jacobian[k];
            m->complex_lu[at] = -m->jacobian[k];
        }
    }
    for (int i = 0; i < m->n; i++) {
        const int64_t at = linear_row(&p->band, i) + i;
        m->real_lu[at] += real_shift;
        m->complex_lu[at] += shift;
    }
    m->lu_ready = linear_real_factor(m->real_lu, p->band, m->real_pivot)
                  && linear_complex_factor(m->complex_lu, p->band, m->complex_pivot);
    return m->lu_ready;
}

static void solve_real(Master *m, double *b)
{
    if (m->pattern.elimination)
        sparse_real_solve(&m->real_factors, b);
    else
        linear_real_solve(m->real_lu, m->pattern.band, m->real_pivot, b);
}

static void solve_complex(Master *m, double complex *b)
{
    if (m->pattern.elimination)
        sparse_complex_solve(&m->complex_factors, b);
    else
        linear_complex_solve(m->complex_lu, m->pattern.band, m->complex_pivot, b);
}

static double collocation(int stage)
{
    return stage == 0 ? (4.0 - ROOT6) / 10.0 : stage == 1 ? (4.0 + ROOT6) / 10.0 : 1.0;
}

/* Z from the polynomial of the step before, and W */
static void predict(Master *m, double length)
{
    const int n = m->n;
    for (int s = 0; s < 3; s++) {
        double *z = m->stages_z + s * n;
        if (!m->previous_ready) {
            memset(z, 0, (size_t)n * sizeof *z);
            continue;
        }
        dense_value(m, 1.0 + collocation(s) * length / m->last_length, z);
        for (int i = 0; i < n; i++)
            z[i] -= m->x[i];
    }
    for (int s = 0; s < 3; s++) {
        for (int i = 0; i < n; i++) {
            m->stages_w[s * n + i] = TI[s][0] * m->stages_z[i] + TI[s][1] * m->stages_z[n + i]
                                     + TI[s][2] * m->stages_z[2 * n + i];
        }
    }
}

/* one iteration: W and Z move; size is that of the change of W */
static Outcome iterate(Master *m, double length, double *size)
{
    const int n = m->n;
    double *g = m->stages_f;
    for (int s = 0; s < 3; s++) {
        for (int i = 0; i < n; i++)
            m->stage[i] = m->x[i] + m->stages_z[s * n + i];
        const Outcome outcome = motion_rates(m, m->t + collocation(s) * length, m->stage, g + s * n);
        if (outcome != FINE) return outcome;
    }
    /* the right-hand sides: real in seed, complex in the last rows of stages_f as pairs */
    double *pairs = g + 3 * n;
    const double *w = m->stages_w;
    const int *place = m->pattern.place;
    for (int i = 0; i < n; i++) {
        const double f0 = g[i], f1 = g[n + i], f2 = g[2 * n + i];
        const int at = place[i];
        m->seed[at] = TI[0][0] * f0 + TI[0][1] * f1 + TI[0][2] * f2 - GAMMA / length * w[i];
        pairs[2 * at] = TI[1][0] * f0 + TI[1][1] * f1 + TI[1][2] * f2
                        - (ALPHA * w[n + i] - BETA * w[2 * n + i]) / length;
        pairs[2 * at + 1] = TI[2][0] * f0 + TI[2][1] * f1 + TI[2][2] * f2
                            - (BETA * w[n + i] + ALPHA * w[2 * n + i]) / length;
    }
    solve_real(m, m->seed);
    solve_complex(m, (double complex *)pairs);
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        const double part[3] = {m->seed[place[i]], pairs[2 * place[i]], pairs[2 * place[i] + 1]};
        const double scale = (m->nominal[i] + fabs(m->x[i])) * m->run->tolerance;
        for (int s = 0; s < 3; s++) {
            m->stages_w[s * n + i] += part[s];
            sum += part[s] * part[s] / (scale * scale);
        }
    }
    for (int s = 0; s < 3; s++)
        for (int i = 0; i < n; i++)
            m->stages_z[s * n + i] = T[s][0] * w[i] + T[s][1] * w[n + i] + T[s][2] * w[2 * n + i];
    *size = sqrt(sum / (3.0 * (n > 0 ? n : 1)));
    return FINE;
}

/* simplified Newton; SHORTER if it does not converge */
static Outcome solve_stages(Master *m, double length, int *iterations)
{
    const double tolerance = fmax(10.0 * DBL_EPSILON / m->run->tolerance, fmin(0.03, sqrt(m->run->tolerance)));
    double before = 0.0;
    predict(m, length);
    m->newton_rate = 1.0;
    for (int k = 0; k < NEWTON_ITERATIONS; k++) {
        double size;
        const Outcome outcome = iterate(m, length, &size);
        if (outcome != FINE) return outcome;
        *iterations = k + 1;
        if (size == 0.0) {
            m->newton_rate = 0.0;
            return FINE;
        }
        if (k > 0) {
            m->newton_rate = size / before;
            const double rest = m->newton_rate / (1.0 - m->newton_rate) * size;
            if (!(m->newton_rate < 1.0)
                || pow(m->newton_rate, NEWTON_ITERATIONS - 1 - k) * rest / fmax(m->newton_rate, 1e-10)
                       > 1e3 * tolerance) {
                return SHORTER;
            }
            if (rest < tolerance) return FINE;
        }
        before = size;
    }
    return SHORTER;
}

static void filtered_error(Master *m, const double *f, double length)
{
    const int n = m->n;
    const double *z = m->stages_z;
    for (int i = 0; i < n; i++) {
        const double sum = (-13.0 - 7.0 * ROOT6) * z[i] + (-13.0 + 7.0 * ROOT6) * z[n + i] - z[2 * n + i];
        m->seed[m->pattern.place[i]] = f[i] + sum / (3.0 * length);
    }
    solve_real(m, m->seed);
    for (int i = 0; i < n; i++)
        m->error[i] = m->seed[m->pattern.place[i]];
}

Outcome stiff_try(Master *m, double length, double *error)
{
    const int n = m->n;
    int iterations = 0;
    Outcome outcome = FINE;
    if (!m->jacobian_ready && (outcome = jacobian_make(m)) != FINE) return outcome;
    if ((!m->lu_ready || m->lu_length != length) && !factor_both(m, length)) return SHORTER;
    outcome = solve_stages(m, length, &iterations);
    if (outcome == SHORTER && !m->jacobian_fresh) {
        outcome = jacobian_make(m);
        outcome = outcome != FINE ? outcome : factor_both(m, length) ? solve_stages(m, length, &iterations) : SHORTER;
    }
    if (outcome != FINE) return outcome;
    for (int i = 0; i < n; i++)
        m->x1[i] = m->x[i] + m->stages_z[2 * n + i];
    filtered_error(m, m->f, length);
    *error = field_norm(m, m->error, m->x, m->x1);
    if (*error > 1.0) {
        for (int i = 0; i < n; i++)
            m->stage[i] = m->x[i] + m->error[i];
        if ((outcome = motion_rates(m, m->t, m->stage, m->error_low)) != FINE) return outcome;
        filtered_error(m, m->error_low, length);
        *error = field_norm(m, m->error, m->x, m->x1);
    }
    m->newton_poor = iterations > 2 && m->newton_rate > 1e-3;
    return motion_rates(m, m->t + length, m->x1, m->f1);
}

int stiff_keeps(const Master *m, double growth)
{
    const double most = m->pattern.band.lower < PATTERN_NARROW ? 1.2 : 2.0;
    return m->stiff && m->pattern_kind > PATTERN_FULL && !m->newton_poor && growth >= 1.0 && growth < most;
}

Outcome stiff_dense(Master *m)
{
    const int n = m->n;
    double *r = m->dense;
    for (int i = 0; i < n; i++) {
        const double end = m->stages_z[2 * n + i];
        double middle[2];
        for (int s = 0; s < 2; s++) {
            const double c = collocation(s);
            middle[s] = (m->stages_z[s * n + i] - c * end) / (c * (1.0 - c));
        }
        const double slope = (middle[1] - middle[0]) / (collocation(1) - collocation(0));
        r[i] = m->x[i];
        r[n + i] = end;
        r[2 * n + i] = middle[0] - slope * collocation(0);
        r[3 * n + i] = slope;
    }
    m->dense_terms = 4;
    return FINE;
}
