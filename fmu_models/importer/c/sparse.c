/*
 * Column by column (J. R. Gilbert, T. Peierls, SIAM J. Sci. Stat. Comput. 9 (1988)): the entries that a column of the
 * factors can have are reached from those of the matrix along the columns of the lower triangle, and solved for in that
 * order. The diagonal is the pivot unless it is small in its column.
 */
#include "sparse.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SMALL_PIVOT = 0.1;

void sparse_free(Factors *f)
{
    Triangle *both[] = {&f->lower, &f->upper};
    for (int k = 0; k < 2; k++) {
        free(both[k]->start);
        free(both[k]->row);
        free(both[k]->value);
    }
    free(f->step);
    free(f->next);
    free(f->column);
    *f = (Factors){0};
}

int sparse_new(Factors *f, int n, const int *order, size_t number)
{
    *f = (Factors){.n = n, .order = order};
    f->lower.start = calloc((size_t)n + 1, sizeof *f->lower.start);
    f->upper.start = calloc((size_t)n + 1, sizeof *f->upper.start);
    f->step = calloc(3 * (size_t)n + 1, sizeof *f->step);
    f->next = calloc((size_t)n + 1, sizeof *f->next);
    f->column = calloc((size_t)n + 1, number);
    if (!f->lower.start || !f->upper.start || !f->step || !f->next || !f->column) return 0;
    f->path = f->step + n;
    f->mark = f->path + n;
    return 1;
}

/* room for one more column */
static int grow(Triangle *t, int64_t used, int n, size_t number)
{
    if (used + n <= t->room) return 1;
    const int64_t room = 2 * t->room + 4 * (int64_t)n;
    int *row = realloc(t->row, (size_t)room * sizeof *row);
    t->row = row ? row : t->row;
    void *value = realloc(t->value, (size_t)room * number);
    t->value = value ? value : t->value;
    t->room = row && value ? room : t->room;
    return row && value;
}

/* what is reached from a row is put on the path before it, from top downwards; the stack grows from the other end */
static int reach(Factors *f, int row, int top, int mark)
{
    int depth = 0;
    if (f->mark[row] == mark) return top;
    f->mark[row] = mark;
    f->path[0] = row;
    f->next[0] = f->step[row] < 0 ? 0 : f->lower.start[f->step[row]];
    while (depth >= 0) {
        const int own = f->step[f->path[depth]];
        const int64_t end = own < 0 ? 0 : f->lower.start[own + 1];
        int deeper = -1;
        while (f->next[depth] < end && deeper < 0) {
            const int other = f->lower.row[f->next[depth]++];
            deeper = f->mark[other] != mark ? other : -1;
        }
        if (deeper < 0) {
            f->path[--top] = f->path[depth--];
            continue;
        }
        f->mark[deeper] = mark;
        f->path[++depth] = deeper;
        f->next[depth] = f->step[deeper] < 0 ? 0 : f->lower.start[f->step[deeper]];
    }
    return top;
}

static double real_magnitude(double a) { return fabs(a); }
static double complex_magnitude(double complex a) { return fabs(creal(a)) + fabs(cimag(a)); }

#define SPARSE(kind, Number)                                                                                           \
    int sparse_##kind##_factor(Factors *f, const Pattern *p, const double *jacobian, Number shift)                     \
    {                                                                                                                  \
        const int n = f->n;                                                                                            \
        Number *x = f->column;                                                                                         \
        int64_t below = 0, above = 0;                                                                                  \
        memset(x, 0, (size_t)n * sizeof *x);                                                                           \
        for (int i = 0; i < n; i++)                                                                                    \
            f->step[i] = f->mark[i] = -1;                                                                              \
        for (int k = 0; k < n; k++) {                                                                                  \
            const int column = f->order[k];                                                                            \
            if (!grow(&f->lower, below, n, sizeof *x) || !grow(&f->upper, above, n, sizeof *x)) return 0;              \
            Number *l = f->lower.value, *u = f->upper.value;                                                           \
            f->lower.start[k] = below;                                                                                 \
            f->upper.start[k] = above;                                                                                 \
            int top = reach(f, column, n, k);                                                                          \
            for (int64_t e = p->start[column]; e < p->start[column + 1]; e++) {                                        \
                top = reach(f, p->row[e], top, k);                                                                     \
                x[p->row[e]] = -jacobian[e];                                                                           \
            }                                                                                                          \
            x[column] += shift;                                                                                        \
            for (int q = top; q < n; q++) {                                                                            \
                const int i = f->path[q], step = f->step[i];                                                           \
                if (step < 0) continue;                                                                                \
                for (int64_t e = f->lower.start[step]; e < f->lower.start[step + 1]; e++)                              \
                    x[f->lower.row[e]] -= l[e] * x[i];                                                                 \
                f->upper.row[above] = step;                                                                            \
                u[above++] = x[i];                                                                                     \
                x[i] = 0.0;                                                                                            \
            }                                                                                                          \
            int best = -1;                                                                                             \
            for (int q = top; q < n; q++) {                                                                            \
                const int i = f->path[q];                                                                              \
                if (f->step[i] < 0 && (best < 0 || kind##_magnitude(x[i]) > kind##_magnitude(x[best]))) best = i;      \
            }                                                                                                          \
            if (best < 0 || !(kind##_magnitude(x[best]) > 0.0)) return 0;                                              \
            if (f->step[column] < 0 && kind##_magnitude(x[column]) >= SMALL_PIVOT * kind##_magnitude(x[best]))         \
                best = column;                                                                                         \
            const Number pivot = x[best];                                                                              \
            f->step[best] = k;                                                                                         \
            f->upper.row[above] = k;                                                                                   \
            u[above++] = pivot;                                                                                        \
            x[best] = 0.0;                                                                                             \
            for (int q = top; q < n; q++) {                                                                            \
                const int i = f->path[q];                                                                              \
                if (f->step[i] >= 0) continue;                                                                         \
                f->lower.row[below] = i;                                                                               \
                l[below++] = x[i] / pivot;                                                                             \
                x[i] = 0.0;                                                                                            \
            }                                                                                                          \
            f->lower.start[k + 1] = below;                                                                             \
        }                                                                                                              \
        f->upper.start[n] = above;                                                                                     \
        for (int64_t e = 0; e < below; e++)                                                                            \
            f->lower.row[e] = f->step[f->lower.row[e]];                                                                \
        return 1;                                                                                                      \
    }                                                                                                                  \
                                                                                                                       \
    void sparse_##kind##_solve(const Factors *f, Number *b)                                                            \
    {                                                                                                                  \
        const int n = f->n;                                                                                            \
        const Number *l = f->lower.value, *u = f->upper.value;                                                         \
        Number *x = f->column;                                                                                         \
        for (int i = 0; i < n; i++)                                                                                    \
            x[f->step[i]] = b[i];                                                                                      \
        for (int k = 0; k < n; k++)                                                                                    \
            for (int64_t e = f->lower.start[k]; e < f->lower.start[k + 1]; e++)                                        \
                x[f->lower.row[e]] -= l[e] * x[k];                                                                     \
        for (int k = n - 1; k >= 0; k--) {                                                                             \
            const int64_t diagonal = f->upper.start[k + 1] - 1;                                                        \
            x[k] /= u[diagonal];                                                                                       \
            for (int64_t e = f->upper.start[k]; e < diagonal; e++)                                                     \
                x[f->upper.row[e]] -= u[e] * x[k];                                                                     \
        }                                                                                                              \
        for (int k = 0; k < n; k++)                                                                                    \
            b[f->order[k]] = x[k];                                                                                     \
    }

SPARSE(real, double)
SPARSE(complex, double complex)
