/*
 * Lemke's algorithm with lexicographic rules, for one group of contacts.
 *
 *     l = lower - mu l_N + alpha,     beta = upper - lower + 2 mu l_N - alpha,     y = y_plus - y_minus
 *     alpha >= 0, y_plus >= 0, one of them zero;     beta >= 0, y_minus >= 0, one of them zero
 *
 * Without an upper bound there are no beta and y_minus. The tableau holds  basic = constant + coefficients nonbasic.
 *
 * Sources: Cottle, Pang and Stone, The linear complementarity problem (1992), section 4.4 and 4.9; Stewart and Trinkle,
 *          Int. J. Numer. Meth. Eng. 39 (1996), for the form with friction.
 */
#include "lemke.h"

#include <math.h>
#include <stddef.h>

#include "../model/inlining.h"

typedef struct {
    int rows;
    int width;     /* rows + 2: the nonbasic ones, then the constant */
    double *table; /* (rows, width) */
    int *basic;    /* of each row: k for w_k, rows + k for z_k, 2 rows for the artificial one */
    int *other;    /* of each column the same */
} Tableau;

static const double LEAST_PIVOT = 1e-11;

static double *tableau_entry(const Tableau *t, int row, int column)
{
    return t->table + (ptrdiff_t)row * t->width + column;
}

/* rows of the second kind: those with an upper bound; -1 for others */
static int upper_row(const BoxProblem *p, const int *member, int count, int k)
{
    int row = count;
    for (int e = 0; e < k; e++)
        row += isfinite(p->upper[member[e]]) != 0;
    return isfinite(p->upper[member[k]]) ? row : -1;
}

static int place_of(const int *member, int count, int unknown)
{
    int k = 0;
    while (k < count && member[k] != unknown)
        k++;
    return k;
}

/* the first tableau; the rows of the second kind count on from count */
static RARE void fill_tableau(const BoxProblem *p, const int *member, int count, const double *scale, Tableau *t)
{
    const int last = t->rows + 1;
    for (int row = 0; row < t->rows; row++)
        for (int column = 0; column < t->width; column++)
            *tableau_entry(t, row, column) = column == t->rows ? 1.0 : 0.0;
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        double constant = p->b[i];
        for (int m = 0; m < count; m++) {
            const int e = member[m];
            const double effect = scale[i] * p->G[i * p->n + e];
            constant += p->G[i * p->n + e] * p->lower[e];
            *tableau_entry(t, k, m) += effect * scale[e];
            if (p->mu[e] > 0.0) {
                const int normal = p->partner[e];
                constant -= p->G[i * p->n + e] * p->mu[e] * p->lower[normal];
                *tableau_entry(t, k, place_of(member, count, normal)) -= effect * p->mu[e] * scale[normal];
            }
        }
        *tableau_entry(t, k, last) = scale[i] * constant;
        const int upper = upper_row(p, member, count, k);
        if (upper < 0) continue;
        *tableau_entry(t, k, upper) = 1.0;
        *tableau_entry(t, upper, k) = -1.0;
        *tableau_entry(t, upper, last) = (p->upper[i] - p->lower[i]) / scale[i];
        if (p->mu[i] > 0.0) {
            const int normal = p->partner[i];
            *tableau_entry(t, upper, place_of(member, count, normal)) += 2.0 * p->mu[i] * scale[normal] / scale[i];
            *tableau_entry(t, upper, last) += 2.0 * p->mu[i] * p->lower[normal] / scale[i];
        }
    }
    for (int row = 0; row < t->rows; row++) {
        t->basic[row] = row;
        t->other[row] = t->rows + row;
    }
    t->other[t->rows] = 2 * t->rows;
}

/* how the constant of a row answers to a shift of w_k */
static double answer_to_shift(const Tableau *t, int row, const int *column_of_w, int k)
{
    return (t->basic[row] == k ? 1.0 : 0.0) - (column_of_w[k] >= 0 ? *tableau_entry(t, row, column_of_w[k]) : 0.0);
}

/* whether the ratio of row one is lexicographically below that of row two */
static int ratio_is_below(const Tableau *t, int one, int two, int column, const int *column_of_w)
{
    const double d1 = -*tableau_entry(t, one, column);
    const double d2 = -*tableau_entry(t, two, column);
    double difference = *tableau_entry(t, one, t->rows + 1) / d1 - *tableau_entry(t, two, t->rows + 1) / d2;
    const double size = fabs(*tableau_entry(t, one, t->rows + 1) / d1) + fabs(*tableau_entry(t, two, t->rows + 1) / d2);
    for (int k = 0; fabs(difference) <= 1e-13 * size + 1e-300 && k < t->rows; k++)
        difference = answer_to_shift(t, one, column_of_w, k) / d1 - answer_to_shift(t, two, column_of_w, k) / d2;
    return difference < 0.0;
}

/* the row that leaves when the column enters, -1 if none is in its way; the artificial one if it may */
static int leaving_row(const Tableau *t, int column, int *column_of_w)
{
    int best = -1;
    for (int k = 0; k < t->rows; k++)
        column_of_w[k] = -1;
    for (int k = 0; k <= t->rows; k++)
        if (t->other[k] < t->rows) column_of_w[t->other[k]] = k;
    for (int row = 0; row < t->rows; row++) {
        if (*tableau_entry(t, row, column) < -LEAST_PIVOT
            && (best < 0 || ratio_is_below(t, row, best, column, column_of_w))) {
            best = row;
        }
    }
    return best;
}

static void exchange_names(Tableau *t, int row, int column)
{
    const double pivot = *tableau_entry(t, row, column);
    for (int k = 0; k < t->width; k++)
        *tableau_entry(t, row, k) /= -pivot;
    *tableau_entry(t, row, column) = 1.0 / pivot;
    for (int other = 0; other < t->rows; other++) {
        const double factor = *tableau_entry(t, other, column);
        if (other == row || factor == 0.0) continue;
        for (int k = 0; k < t->width; k++)
            if (k != column) *tableau_entry(t, other, k) += factor * *tableau_entry(t, row, k);
        *tableau_entry(t, other, column) = factor * *tableau_entry(t, row, column);
    }
    const int name = t->basic[row];
    t->basic[row] = t->other[column];
    t->other[column] = name;
}

/* 1 if the artificial variable has left */
static RARE int run_pivots(Tableau *t, int *column_of_w)
{
    const int artificial = 2 * t->rows;
    int row = 0;
    for (int k = 1; k < t->rows; k++)
        row = *tableau_entry(t, k, t->rows + 1) < *tableau_entry(t, row, t->rows + 1) ? k : row;
    if (*tableau_entry(t, row, t->rows + 1) >= 0.0) return 1;
    int column = t->rows;
    for (int step = 0; step < 50 * t->rows + 50; step++) {
        const int leaves = t->basic[row];
        exchange_names(t, row, column);
        if (leaves == artificial) return 1;
        const int enters = leaves < t->rows ? leaves + t->rows : leaves - t->rows;
        for (column = 0; t->other[column] != enters; column++) {
        }
        row = leaving_row(t, column, column_of_w);
        if (row < 0) return 0;
    }
    return 0;
}

RARE int lemke_solve(const BoxProblem *problem, const int *member, int count, const double *scale, signed char *state,
                     double *room)
{
    int rows = count;
    for (int k = 0; k < count; k++) {
        if (!isfinite(problem->lower[member[k]])) return 0;
        rows += isfinite(problem->upper[member[k]]) != 0;
    }
    Tableau t = {.rows = rows, .width = rows + 2, .table = room};
    t.basic = (int *)(room + (ptrdiff_t)rows * t.width);
    t.other = t.basic + rows;
    fill_tableau(problem, member, count, scale, &t);
    if (!run_pivots(&t, t.other + rows + 1)) return 0;
    for (int k = 0; k < count; k++)
        state[member[k]] = 0;
    for (int column = 0; column <= rows; column++) {
        const int z = t.other[column] - rows;
        if (z >= 0 && z < count) state[member[z]] = -1; /* alpha is zero */
    }
    for (int column = 0; column <= rows; column++) {
        const int w = t.other[column];
        for (int k = 0; w >= count && w < rows && k < count; k++)
            if (upper_row(problem, member, count, k) == w && state[member[k]] == 0)
                state[member[k]] = 1; /* beta is zero */
    }
    return 1;
}
