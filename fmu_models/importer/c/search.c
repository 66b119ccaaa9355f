/*
 * Zeros of the indicators on a part of a step, by their polynomials and by the FMU itself: the part "interval" of
 * events.c.
 */
#include "search.h"

#include "../../engine/step/roots.h"
#include "dense_output.h"
#include "field.h"
#include "motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { NODES = SEARCH_NODES, DEGREE = NODES - 1 };
static const double CHECK = 0.3617; /* between two nodes, nowhere special */
/* the points of Chebyshev and Lobatto on [0, 1]: (1 - cos(pi k / 7)) / 2 */
static const double NODE[NODES] = {
    0.0,
    0.04951556604879043,
    0.1882550990706332,
    0.3887395330218428,
    0.6112604669781572,
    0.8117449009293667,
    0.9504844339512095,
    1.0,
};

void search_nodes(Master *m)
{
    /* column k: the Lagrange polynomial of node k in powers, built up factor by factor */
    for (int k = 0; k < NODES; k++) {
        double c[NODES] = {1.0};
        int degree = 0;
        for (int j = 0; j < NODES; j++) {
            if (j == k) continue;
            const double scale = 1.0 / (NODE[k] - NODE[j]);
            degree++;
            for (int i = degree; i >= 0; i--)
                c[i] = ((i > 0 ? c[i - 1] : 0.0) - (i < degree ? NODE[j] * c[i] : 0.0)) * scale;
        }
        for (int i = 0; i < NODES; i++)
            m->node_inverse[i * NODES + k] = c[i];
    }
}

int search_beyond(const Master *m, int i, double z) { return (z > 0.0) != (m->side[i] > 0); }

/* all indicators at a fraction of the step */
Outcome search_sample(Master *m, double theta, double *z)
{
    dense_value(m, theta, m->point);
    const Outcome outcome = motion_indicators(m, m->t + theta * m->length, m->point, z);
    for (int i = 0; i < m->slots && outcome == FINE; i++)
        if (!isfinite(z[i])) return field_report(m, RUN_BAD_INDICATOR, m->t + theta * m->length, i, z[i]);
    return outcome;
}

typedef struct {
    int i;
    double from, width; /* of the interval, in fractions of the step */
    double p[NODES], near_zero;
    double low, high; /* bracket, in fractions of the step */
} Search;

/* coefficients of p(s + by) */
static void shifted(const double *p, double by, double *q)
{
    memcpy(q, p, NODES * sizeof *q);
    for (int k = 0; k < DEGREE; k++)
        for (int i = DEGREE - 1; i >= k; i--)
            q[i] += by * q[i + 1];
}

/* where p, from s on, first falls below the level; 1 if it does not within the interval */
static double falls_below(const double *p, double s, double level, double sign)
{
    double q[NODES];
    shifted(p, s, q);
    q[0] -= level;
    for (int i = 0; i < NODES; i++)
        q[i] *= sign;
    const double fall = q[0] <= 0.0 ? 0.0 : first_fall(q, DEGREE, 1.0 - s);
    return fall < 0.0 ? 1.0 : fmin(1.0, s + fall);
}

/* the minimum of p from s on, as far as p falls */
static double minimum_from(const double *p, double s)
{
    double q[NODES], slope[NODES];
    shifted(p, s, q);
    for (int i = 0; i < DEGREE; i++)
        slope[i] = -(i + 1) * q[i + 1];
    if (!(slope[0] > 0.0)) return s;
    const double fall = first_fall(slope, DEGREE - 1, 1.0 - s);
    return fall < 0.0 ? 1.0 : fmin(1.0, s + fall);
}

/* v = side * z of the searched indicator at s of the interval */
static Outcome look(Master *m, const Search *search, double s, double *v, int *is_beyond)
{
    const Outcome outcome = search_sample(m, search->from + s * search->width, m->z1);
    *v = m->side[search->i] * m->z1[search->i];
    *is_beyond = search_beyond(m, search->i, m->z1[search->i]);
    return outcome;
}

/* a minimum near zero at s: closed in on by parabolas until it is seen beyond zero, or is not */
static Outcome touch(Master *m, const Search *search, double *s, int *is_beyond)
{
    double width = 1e-3;
    double best;
    Outcome outcome = look(m, search, *s, &best, is_beyond);
    for (int round = 0; round < 12 && outcome == FINE && !*is_beyond; round++) {
        const double left = fmax(0.0, *s - width), right = fmin(1.0, *s + width);
        double v_left, v_right;
        int beyond_left = 0, beyond_right = 0;
        outcome = look(m, search, left, &v_left, &beyond_left);
        if (outcome == FINE && !beyond_left) outcome = look(m, search, right, &v_right, &beyond_right);
        if (outcome != FINE || beyond_left || beyond_right) {
            *s = beyond_left ? left : right;
            *is_beyond = beyond_left || beyond_right;
            return outcome;
        }
        const double a = *s - left, b = right - *s;
        const double up_left = v_left - best, up_right = v_right - best;
        const double bend = up_left * b + up_right * a;
        if (!(bend > 0.0) || !(a > 0.0) || !(b > 0.0)) {
            /* the least value is at an end of the interval, which is a node */
            return outcome;
        }
        const double moved = *s + 0.5 * (up_left * b * b - up_right * a * a) / bend;
        double value;
        outcome = look(m, search, fmin(right, fmax(left, moved)), &value, is_beyond);
        if (value <= best) {
            *s = fmin(right, fmax(left, moved));
            best = value;
        }
        width *= 0.1;
        if (width < 1e-11) break;
    }
    return outcome;
}

/* the zones of the interval where the polynomial is near zero, one after the other */
static Outcome explore(Master *m, Search *search, Finding *finding)
{
    double s = 0.0;
    *finding = CLEAR;
    for (int zone = 0; zone < NODES && s < 1.0; zone++) {
        s = falls_below(search->p, s, search->near_zero, 1.0);
        double lowest = s < 1.0 ? minimum_from(search->p, s) : s;
        if (lowest > s) {
            int is_beyond = 0;
            const Outcome outcome = touch(m, search, &lowest, &is_beyond);
            if (outcome != FINE) return outcome;
            if (is_beyond) {
                search->low = search->from + s * search->width;
                search->high = search->from + lowest * search->width;
                *finding = BRACKET;
                return FINE;
            }
        }
        /* on to where the polynomial has left the zone */
        const double left = falls_below(search->p, lowest, search->near_zero, -1.0);
        s = left > lowest ? left : fmin(1.0, lowest + 1e-3);
    }
    return FINE;
}

/* lower bound of c on [0, end]: the least of its Bernstein coefficients */
static double lower_bound(const double *c, int degree, double end)
{
    double beta[NODES], power = 1.0, binomial = 1.0;
    for (int k = 0; k <= degree; k++) {
        beta[k] = c[k] * power / binomial;
        power *= end;
        binomial = binomial * (degree - k) / (k + 1);
    }
    for (int k = 1; k <= degree; k++)
        for (int i = degree; i >= k; i--)
            beta[i] += beta[i - 1];
    double least = beta[0];
    for (int k = 1; k <= degree; k++)
        least = fmin(least, beta[k]);
    return least;
}

/* the polynomial stays on its side up to end for certain: above what it may err by, or rising from a start near zero */
static int certainly_clear(const Search *search, double mismatch, double scale, double end)
{
    if (end == 0.0 || lower_bound(search->p, DEGREE, end) > search->near_zero) return 1;
    return mismatch <= master_tolerances.graze * scale
           && lower_bound(search->p + 1, DEGREE - 1, end) > search->near_zero;
}

/* the polynomial of indicator i through the nodes, positive on its side; its largest value there, and the larger one of
   its last two coefficients by Chebyshev's polynomials */
static double through_nodes(const Master *m, int i, double *p, double *last)
{
    double v[NODES], scale = 0.0, highest = 0.0, second = 0.0;
    for (int k = 0; k < NODES; k++) {
        v[k] = m->side[i] * m->samples[k * m->slots + i];
        scale = fmax(scale, fabs(v[k]));
        const double term = (k % 2 ? -v[k] : v[k]) * (k % DEGREE ? 1.0 : 0.5) / DEGREE;
        highest += term;
        second += 2.0 * (1.0 - 2.0 * NODE[k]) * term;
    }
    *last = fmax(fabs(highest), fabs(second));
    for (int j = 0; j < NODES; j++) {
        p[j] = 0.0;
        for (int k = 0; k < NODES; k++)
            p[j] += m->node_inverse[j * NODES + k] * v[k];
    }
    return scale;
}

Outcome search_lowest(Master *m, double from, double width, double to)
{
    double *misses = m->run->misses, *there = m->samples + NODES * m->slots;
    for (int i = 0; i < m->nz; i++) {
        double p[NODES], slope[NODES] = {0.0}, s = 0.0, last;
        through_nodes(m, i, p, &last);
        for (int k = 0; k < DEGREE; k++)
            slope[k] = (k + 1) * p[k + 1];
        for (int zone = 0; zone < NODES && s < 1.0; zone++) {
            const double falls = falls_below(slope, s, 0.0, 1.0);
            const double lowest = minimum_from(p, falls);
            const double place = from + lowest * width;
            if (lowest > falls && lowest < 1.0 && place < to) {
                /* the error of the place counts by its square */
                const Outcome outcome = search_sample(m, place, there);
                if (outcome != FINE) return outcome;
                if (m->side[i] * there[i] < misses[2 * i]) {
                    misses[2 * i] = m->side[i] * there[i];
                    misses[2 * i + 1] = m->t + place * m->length;
                }
            }
            s = fmax(falls, lowest) + 1e-3;
        }
    }
    return FINE;
}

static Outcome search_one(Master *m, Search *search, const double *check, int may_halve, Finding *finding)
{
    const int i = search->i;
    const double side = m->side[i];
    double last;
    const double scale = through_nodes(m, i, search->p, &last);
    double mismatch = fabs(polynomial_value(search->p, DEGREE, CHECK) - side * check[i]);
    if (last > master_tolerances.decay * scale) {
        /* the one point beside the nodes may agree by chance */
        mismatch = fmax(mismatch, 0.1 * last);
    }
    search->near_zero = fmax(master_tolerances.graze * scale, 8.0 * mismatch);
    *finding = CLEAR;
    if (scale == 0.0) return FINE;
    int first = 1;
    while (first < NODES && !search_beyond(m, i, m->samples[first * m->slots + i]))
        first++;
    const int clear = certainly_clear(search, mismatch, scale, first < NODES ? NODE[first - 1] : 1.0);
    /* a node on the other side is not all: between it and the one before there may be three events */
    if (mismatch > master_tolerances.trust * scale && (first < NODES || !clear)) {
        m->doubtful = i + 1;
        if (may_halve) {
            *finding = UNSURE;
            return FINE;
        }
    }
    if (!clear) {
        const Outcome outcome = explore(m, search, finding);
        if (outcome != FINE) return outcome;
    }
    if (first < NODES && (*finding != BRACKET || search->from + NODE[first] * search->width < search->high)) {
        search->low = search->from + NODE[first - 1] * search->width;
        search->high = search->from + NODE[first] * search->width;
        *finding = BRACKET;
    }
    return FINE;
}

/* close the bracket of indicator i to the resolution of time */
Outcome search_close(Master *m, int i, double *low, double *high)
{
    const double resolution = 4.0 * DBL_EPSILON;
    /* of the step: what leaves zero at once does so within the rounding of time */
    const double least = fmax(1e-30, 1e-3 * DBL_EPSILON * fabs(m->t) / m->length);
    double v_low, v_high;
    Outcome outcome = search_sample(m, *low, m->z1);
    if (outcome == FINE && search_beyond(m, i, m->z1[i])) {
        *high = *low;
        *low = 0.0;
        outcome = search_sample(m, *low, m->z1);
    }
    v_low = m->side[i] * m->z1[i];
    if (outcome == FINE) outcome = search_sample(m, *high, m->z1);
    v_high = m->side[i] * m->z1[i];
    int last = 0;
    for (int round = 0; outcome == FINE && *high - *low > fmax(resolution * *high, least) && round < 200; round++) {
        const double width = *high - *low;
        const double margin = fmax(0.5 * resolution * *high, 0.5 * least);
        double s = *low + width * v_low / (v_low - v_high);
        if (round % 4 == 3 || !(s >= *low && s <= *high)) s = *low + 0.5 * width;
        s = fmin(fmax(s, *low + margin), *high - margin);
        if (!(s > *low && s < *high)) break;
        outcome = search_sample(m, s, m->z1);
        const double v = m->side[i] * m->z1[i];
        if (search_beyond(m, i, m->z1[i])) {
            *high = s;
            v_high = v;
            v_low *= last == 1 ? 0.5 : 1.0;
            last = 1;
        } else {
            *low = s;
            v_low = v;
            v_high *= last == -1 ? 0.5 : 1.0;
            last = -1;
        }
    }
    return outcome;
}

Outcome search_interval(Master *m, double from, double width, int may_halve, Finding *finding, int *which, double *low,
                        double *high)
{
    double *check = m->samples + NODES * m->slots;
    Outcome outcome = search_sample(m, from + CHECK * width, check);
    for (int k = 1; k < NODES && outcome == FINE; k++)
        outcome = search_sample(m, from + NODE[k] * width, m->samples + k * m->slots);
    *finding = CLEAR;
    m->doubtful = 0;
    for (int i = 0; i < m->slots && outcome == FINE; i++) {
        Search search = {.i = i, .from = from, .width = width};
        Finding one;
        outcome = search_one(m, &search, check, may_halve, &one);
        if (outcome != FINE || one == CLEAR) continue;
        if (one == UNSURE) {
            *finding = UNSURE;
            return FINE;
        }
        outcome = search_close(m, i, &search.low, &search.high);
        if (*finding != BRACKET || search.high < *high) {
            *which = i;
            *low = search.low;
            *high = search.high;
        }
        *finding = BRACKET;
    }
    return outcome;
}
