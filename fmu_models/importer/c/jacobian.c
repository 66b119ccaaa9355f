/*
 *     pattern:  all entries of a small FMU; else what the FMU declares; where it says nothing, or declares less than its
 *               rates show, the entries that a search column by column finds
 *     check:    at the first Jacobian after an event, J v against the rates at x + v for two random v; where they differ
 *               there is a search, and what it finds is added
 *     entries:  columns of one colour at once, by directional derivatives or by differences of the rates
 */
#include "jacobian.h"

#include "field.h"
#include "motion.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMALL = 20, DIRECTIONS = 2 };
enum { MOST_STORED = 1 << 25 }; /* numbers of a factored matrix: .8 GB for the real and the complex one */

/* an entry counts as missed beyond this share of its row, and beyond the rounding of the rates by this factor */
static const double MISSED = 1e-3, ROUNDING = 1e3;
static const double SEARCH_SHIFT = 1e-3, CHECK_SHIFT = 1e-6; /* of states in a search and in a check, relative */

static double size_of(const Master *m, int i) { return m->nominal[i] + fabs(m->x[i]); }

/* of either sign, of size 1/2 to 1; the same ones in every run */
static double random_factor(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    const double part = 0.5 + (double)(*state >> 33) / 4294967296.0;
    return *state >> 32 & 1 ? part : -part;
}

static void free_numbers(Master *m)
{
    sparse_free(&m->real_factors);
    sparse_free(&m->complex_factors);
    free(m->jacobian);
    free(m->real_lu);
    free(m->complex_lu);
    m->jacobian = m->real_lu = NULL;
    m->complex_lu = NULL;
}

void jacobian_free(Master *m)
{
    free_numbers(m);
    pattern_free(&m->pattern);
}

static Outcome set_pattern(Master *m, PatternKind kind, const int64_t *start, const int *rows)
{
    const Pattern *p = &m->pattern;
    free_numbers(m);
    int fits = pattern_set(&m->pattern, m->n, start, rows);
    const int64_t stored = fits && !p->elimination ? (int64_t)m->n * p->band.width : 0;
    fits = fits && stored <= MOST_STORED;
    m->jacobian = fits ? malloc(((size_t)p->start[m->n] + 1) * sizeof *m->jacobian) : NULL;
    m->real_lu = fits ? malloc(((size_t)stored + 1) * sizeof *m->real_lu) : NULL;
    m->complex_lu = fits ? malloc(((size_t)stored + 1) * sizeof *m->complex_lu) : NULL;
    fits = m->jacobian && m->real_lu && m->complex_lu;
    if (fits && p->elimination) {
        fits = sparse_new(&m->real_factors, m->n, p->elimination, sizeof(double))
               && sparse_new(&m->complex_factors, m->n, p->elimination, sizeof(double complex));
    }
    if (!fits) {
        jacobian_free(m);
        return field_report(m, RUN_TOO_LARGE, m->t, m->n, (double)stored);
    }
    m->pattern_kind = kind;
    return FINE;
}

/* rates with all states shifted from where the run is, and state j (if there is one) by the step */
static Outcome shifted_rates(Master *m, double shift, int j, double step, double *rates)
{
    uint64_t state = 1;
    for (int i = 0; i < m->n; i++)
        m->point[i] = m->x[i] + shift * random_factor(&state) * size_of(m, i);
    if (j >= 0) m->point[j] += step * size_of(m, j);
    return motion_rates(m, m->t, m->point, rates);
}

/* entries known so far, and those where a step of one state is seen in the rates; where these are refused, all of its
   column count. Nearby, not where the run is: there a slope may be zero by accident */
static Outcome search_pattern(Master *m)
{
    const int n = m->n;
    const Pattern *p = &m->pattern;
    /* no farther from the surfaces of a sliding motion than a Jacobian looks */
    const double step = m->slide.n ? sqrt(DBL_EPSILON) : SEARCH_SHIFT;
    double *base = m->error_low, shift = m->slide.n ? 0.0 : SEARCH_SHIFT;
    int64_t room = 8 * (int64_t)n, used = 0, missed = 0;
    int64_t *start = calloc((size_t)n + 1, sizeof *start);
    int *rows = malloc((size_t)room * sizeof *rows);
    Outcome outcome = shifted_rates(m, shift, -1, step, base);
    if (outcome == SHORTER) outcome = shifted_rates(m, shift = 0.0, -1, step, base);
    for (int j = 0; j < n && outcome == FINE && start && rows; j++) {
        outcome = shifted_rates(m, shift, j, step, m->error);
        const int refused = outcome == SHORTER;
        outcome = refused ? FINE : outcome;
        int64_t known = p->start ? p->start[j] : 0;
        const int64_t end = p->start ? p->start[j + 1] : 0;
        if (used + n > room) {
            room = 2 * room + n;
            int *longer = realloc(rows, (size_t)room * sizeof *rows);
            if (!longer) free(rows);
            rows = longer;
        }
        for (int i = 0; i < n && rows; i++) {
            const int is_known = known < end && p->row[known] == i;
            known += is_known;
            if (!is_known && !refused && m->error[i] == base[i]) continue;
            missed += !is_known;
            rows[used++] = i;
        }
        start[j + 1] = used;
        if (outcome == FINE && used > MOST_STORED) outcome = field_report(m, RUN_TOO_LARGE, m->t, n, (double)used);
    }
    if (outcome == FINE && !(start && rows)) outcome = field_report(m, RUN_TOO_LARGE, m->t, n, (double)used);
    if (outcome == FINE && (missed || !p->start)) {
        if (m->pattern_kind == PATTERN_DECLARED && !m->slide.n) m->undeclared = missed;
        outcome = set_pattern(m, PATTERN_FOUND, start, rows);
    }
    free(start);
    free(rows);
    return outcome;
}

static Outcome first_pattern(Master *m)
{
    const FmuInstance *fmu = m->fmu;
    if (m->n < SMALL) return set_pattern(m, PATTERN_FULL, NULL, NULL);
    if (fmu->dependency_start) return set_pattern(m, PATTERN_DECLARED, fmu->dependency_start, fmu->dependency_rows);
    m->check_pattern = 0;
    return search_pattern(m);
}

/* the columns of one colour; their steps are in m->seed */
static Outcome evaluate_columns(Master *m, int colour, int exact)
{
    const Pattern *p = &m->pattern;
    Outcome outcome = FINE;
    memset(m->seed, 0, (size_t)m->n * sizeof *m->seed);
    memcpy(m->point, m->x, (size_t)m->n * sizeof *m->x);
    for (int j = 0; j < m->n; j++) {
        if (p->colour[j] != colour) continue;
        const double size = fmax(1e-5 * m->nominal[j], fabs(m->x[j]));
        const double step = sqrt(DBL_EPSILON * size * m->nominal[j]);
        m->point[j] += m->f[j] < 0.0 ? -step : step;
        m->seed[j] = exact ? 1.0 : m->point[j] - m->x[j];
    }
    if (exact) {
        const int status = fmi_directional(m->fmu, m->seed, m->error);
        outcome = status >= FMI_DISCARD ? field_fail(m, F_DIRECTIONAL, status) : FINE;
    } else {
        outcome = motion_rates(m, m->t, m->point, m->error);
    }
    for (int j = 0; j < m->n && outcome == FINE; j++)
        for (int64_t k = p->start[j]; k < p->start[j + 1] && p->colour[j] == colour; k++)
            m->jacobian[k] = exact ? m->error[p->row[k]] : (m->error[p->row[k]] - m->f[p->row[k]]) / m->seed[j];
    return outcome;
}

static Outcome evaluate(Master *m)
{
    const int exact = m->fmu->directional && !m->slide.n;
    Outcome outcome = exact ? field_settled(m, m->t, m->x) : FINE;
    for (int colour = 0; colour < m->pattern.colours && outcome == FINE; colour++)
        outcome = evaluate_columns(m, colour, exact);
    return outcome;
}

/* whether J v is what the rates show; where they are refused, nothing is known */
static Outcome check_pattern(Master *m, int *agrees)
{
    const Pattern *p = &m->pattern;
    double *product = m->error_low, *most = m->seed;
    uint64_t state = 2;
    for (int direction = 0; direction < DIRECTIONS && *agrees; direction++) {
        memset(product, 0, (size_t)m->n * sizeof *product);
        for (int i = 0; i < m->n; i++)
            most[i] = fabs(m->f[i]);
        for (int j = 0; j < m->n; j++) {
            m->point[j] = m->x[j] + CHECK_SHIFT * random_factor(&state) * size_of(m, j);
            const double way = m->point[j] - m->x[j];
            for (int64_t k = p->start[j]; k < p->start[j + 1]; k++) {
                product[p->row[k]] += m->jacobian[k] * way;
                most[p->row[k]] += fabs(m->jacobian[k]) * size_of(m, j);
            }
        }
        const Outcome outcome = motion_rates(m, m->t, m->point, m->error);
        if (outcome != FINE) return outcome == SHORTER ? FINE : outcome;
        for (int i = 0; i < m->n; i++) {
            const double tolerance = (MISSED * CHECK_SHIFT + ROUNDING * DBL_EPSILON) * most[i];
            *agrees = *agrees && fabs(m->error[i] - m->f[i] - product[i]) <= tolerance;
        }
    }
    return FINE;
}

Outcome jacobian_make(Master *m)
{
    m->run->jacobians++;
    int agrees = 1;
    Outcome outcome = m->pattern.start ? FINE : first_pattern(m);
    outcome = outcome == FINE ? evaluate(m) : outcome;
    if (outcome == FINE && m->check_pattern && m->pattern.start[m->n] < (int64_t)m->n * m->n)
        outcome = check_pattern(m, &agrees);
    if (outcome == FINE && !agrees) {
        outcome = search_pattern(m);
        outcome = outcome == FINE ? evaluate(m) : outcome;
    }
    if (outcome != FINE) return outcome;
    m->run->pattern = m->pattern_kind;
    m->run->colours = m->pattern.colours;
    m->run->undeclared = m->undeclared;
    m->check_pattern = m->lu_ready = 0;
    m->jacobian_ready = m->jacobian_fresh = 1;
    return FINE;
}

double jacobian_rate(const Master *m)
{
    const Pattern *p = &m->pattern;
    double most = 0.0;
    memset(m->seed, 0, (size_t)m->n * sizeof *m->seed);
    for (int j = 0; j < m->n; j++)
        for (int64_t k = p->start[j]; k < p->start[j + 1]; k++)
            m->seed[p->row[k]] += fabs(m->jacobian[k]) * m->nominal[j] / m->nominal[p->row[k]];
    for (int i = 0; i < m->n; i++)
        most = fmax(most, m->seed[i]);
    return most;
}
