/*
 * One order of the selection of contact states: a mixed complementarity problem with boxes.
 *
 *     groups:  connected components of G and of the partners, each for itself
 *     pivot:   from the states given: solve for the held forces; all that do not fit change at once,
 *                  held -> at the bound that its force exceeds,  at a bound -> held where its rate has the wrong sign;
 *              where their number has not fallen for ten rounds only the last one changes, until it does
 *     Lemke:   where that comes to no end, which symmetry excludes (lemke.c)
 *     redundant contacts (the held part of G singular): a proximal step adds a small multiple of (l - l_before)/weight
 *              to the rates; from l_before = 0 its limit is the split of the load with the least sum of
 *              l^2/capacity among those within the bounds; contacts in parallel so carry equal shares. Only the rates matter to the motion.
 *
 * Unknowns are scaled by the roots of the diagonal of G, so that no unit matters.
 *
 * Sources: Portugal, Judice and Vicente, A comparison of block pivoting and interior-point algorithms, Math. Comp. 63
 *          (1994); Murty, Note on a Bard-type scheme, Opsearch 11 (1974); Rockafellar, Monotone operators and the
 *          proximal point algorithm, SIAM J. Control Optim. 14 (1976).
 */
#include "complementarity.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "../model/inlining.h"
#include "lemke.h"

enum { PATIENCE = 10, PROXIMAL_STEPS = 60 };

/* of the largest magnitude in a group: elimination leaves its rounding in all others */
static const double ROUNDING = 1e-4;
static const double RIDGE = 1e-9;        /* of a proximal step, to the diagonal of the scaled G */
static const double WIDEST_WEIGHT = 1e4; /* between capacities of one group */

/* one group and the arrays that its search uses */
typedef struct {
    const BoxProblem *of;
    int count;
    int *member;    /* unknowns of the group */
    int *place;     /* of an unknown among the held ones, -1: not held */
    double *scale;  /* of the forces; that of the rates is its inverse */
    double *ridge;  /* 0: none */
    double *origin; /* forces that the proximal step starts from */
    double *rate, *magnitude;
    double *matrix, *right;
    signed char *state;
    double *force;
} Group;

/* whether a force of its own can hold the rate of i; a rigid contact is held even where pushing pulls it in */
static int holdable(const BoxProblem *p, int i)
{
    return isinf(p->upper[i]) || (p->G[i * p->n + i] > 0.0 && (p->mu[i] > 0.0 || p->lower[i] < p->upper[i]));
}

/* the bound that the force of i is at, without what its partner's force adds */
static double own_bound(const Group *g, int i) { return g->state[i] > 0 ? g->of->upper[i] : g->of->lower[i]; }

/* bound of the force of i on one side, with what its partner's force adds */
static double force_bound(const Group *g, int i, int side)
{
    const BoxProblem *p = g->of;
    const double own = side > 0 ? p->upper[i] : p->lower[i];
    return p->mu[i] > 0.0 ? own + side * p->mu[i] * g->force[p->partner[i]] : own;
}

/* whether its partner is held, so that its bounds depend on an unknown */
static int follows_held(const Group *g, int i) { return g->of->mu[i] > 0.0 && g->place[g->of->partner[i]] >= 0; }

/* the equations of the held ones */
static RARE int assemble_held(Group *g)
{
    const BoxProblem *p = g->of;
    int held = 0;
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        g->place[i] = g->state[i] == 0 ? held++ : -1;
    }
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        if (g->place[i] < 0) continue;
        double *row = g->matrix + (ptrdiff_t)g->place[i] * held;
        double right = -p->b[i];
        for (int e = 0; e < held; e++)
            row[e] = 0.0;
        for (int m = 0; m < g->count; m++) {
            const int e = g->member[m];
            const double effect = p->G[i * p->n + e];
            if (g->place[e] >= 0) {
                row[g->place[e]] += g->scale[i] * effect * g->scale[e];
                continue;
            }
            right -= effect * own_bound(g, e);
            if (follows_held(g, e)) {
                const int normal = p->partner[e];
                row[g->place[normal]] += g->scale[i] * g->state[e] * p->mu[e] * effect * g->scale[normal];
            } else if (p->mu[e] > 0.0) {
                right -= effect * g->state[e] * p->mu[e] * own_bound(g, p->partner[e]);
            }
        }
        row[g->place[i]] += g->ridge[i];
        g->right[g->place[i]] = g->scale[i] * right + g->ridge[i] * g->origin[i] / g->scale[i];
    }
    return held;
}

/* solve A x = b of n equations, x in place of b; 0 if A is singular */
static RARE int eliminate(double *A, double *b, int n)
{
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            pivot = fabs(A[i * n + k]) > fabs(A[pivot * n + k]) ? i : pivot;
        if (!(fabs(A[pivot * n + k]) > 64.0 * n * DBL_EPSILON)) return 0;
        for (int j = k; j < n && pivot != k; j++) {
            const double swap = A[k * n + j];
            A[k * n + j] = A[pivot * n + j];
            A[pivot * n + j] = swap;
        }
        const double swap = b[k];
        b[k] = b[pivot];
        b[pivot] = swap;
        for (int i = k + 1; i < n; i++) {
            const double f = A[i * n + k] / A[k * n + k];
            for (int j = k + 1; j < n && f != 0.0; j++)
                A[i * n + j] -= f * A[k * n + j];
            b[i] -= f * b[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++)
            b[i] -= A[i * n + j] * b[j];
        b[i] /= A[i * n + i];
    }
    return 1;
}

/* forces and rates in the present states; 0 if the held ones are redundant */
static int answer_to_states(Group *g)
{
    const BoxProblem *p = g->of;
    double largest = 0.0;
    if (!eliminate(g->matrix, g->right, assemble_held(g))) return 0;
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        g->force[i] = g->place[i] >= 0 ? g->scale[i] * g->right[g->place[i]] : own_bound(g, i);
    }
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        if (g->place[i] < 0 && p->mu[i] > 0.0) g->force[i] = force_bound(g, i, g->state[i]);
    }
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        g->rate[i] = p->b[i];
        g->magnitude[i] = p->size[i];
        for (int m = 0; m < g->count; m++) {
            const double term = p->G[i * p->n + g->member[m]] * g->force[g->member[m]];
            g->rate[i] += term;
            g->magnitude[i] += fabs(term);
        }
        g->rate[i] += g->ridge[i] * (g->force[i] - g->origin[i]) / (g->scale[i] * g->scale[i]);
        largest = fmax(largest, g->scale[i] * g->magnitude[i]);
    }
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        g->magnitude[i] = fmax(g->magnitude[i], ROUNDING * largest / g->scale[i]);
    }
    return 1;
}

/* the state that i has to change to, its own if it fits */
static signed char state_wanted(const Group *g, int i)
{
    const BoxProblem *p = g->of;
    if (p->fixed && p->fixed[i]) return g->state[i];
    const double zero = p->tolerance * g->magnitude[i];
    const int side = g->rate[i] > zero ? -1 : g->rate[i] < -zero ? 1 : 0;
    const int idle = p->mu[i] > 0.0 && g->state[p->partner[i]] == -1 && p->lower[p->partner[i]] == 0.0;
    if (idle || !holdable(p, i))
        return (signed char)(side == 0 && g->state[i] != 0 ? g->state[i] : side == 0 ? -1 : side);
    if (g->state[i] != 0) return (signed char)(side == -g->state[i] ? 0 : g->state[i]);
    const double below = force_bound(g, i, -1);
    const double above = force_bound(g, i, 1);
    const double slack = zero * g->scale[i] * g->scale[i];
    return (signed char)(g->force[i] > above + slack ? 1 : g->force[i] < below - slack ? -1 : 0);
}

/* change states until all fit; 1 if they do, 0 if not, -1 if held ones are redundant */
static CALLED int change_states(Group *g, int rounds)
{
    int least = g->count + 1;
    int patience = PATIENCE;
    for (int round = 0; round < rounds; round++) {
        int misfits = 0;
        int last = -1;
        if (!answer_to_states(g)) return -1;
        for (int k = 0; k < g->count; k++) {
            if (state_wanted(g, g->member[k]) != g->state[g->member[k]]) {
                misfits++;
                last = g->member[k];
            }
        }
        if (misfits == 0) return 1;
        patience = misfits < least ? PATIENCE : patience - 1;
        least = misfits < least ? misfits : least;
        /* rates and bounds that the others are judged by are those of this round */
        for (int k = 0; k < g->count && patience > 0; k++)
            g->matrix[k] = state_wanted(g, g->member[k]);
        for (int k = 0; k < g->count && patience > 0; k++)
            g->state[g->member[k]] = (signed char)g->matrix[k];
        if (patience <= 0) g->state[last] = state_wanted(g, last);
    }
    return 0;
}

/* what the ridge still adds to the rates, in parts of what counts as zero */
static double added_by_ridge(const Group *g)
{
    double most = 0.0;
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        const double added = g->ridge[i] * (g->force[i] - g->origin[i]) / (g->scale[i] * g->scale[i]);
        const double part = added == 0.0 ? 0.0 : fabs(added) / (0.1 * g->of->tolerance * g->magnitude[i]);
        most = part <= most ? most : part; /* not a number is no rest */
    }
    return most;
}

/* the heavier the less a contact can carry */
static RARE void set_ridge(Group *g)
{
    const BoxProblem *p = g->of;
    double strongest = 0.0;
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        const double capacity = fmax(fabs(p->lower[i]), fabs(p->upper[i])) / g->scale[i];
        strongest = isfinite(capacity) && capacity > strongest ? capacity : strongest;
    }
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        const double capacity = fmax(fabs(p->lower[i]), fabs(p->upper[i])) / g->scale[i];
        /* never 0/0, which compilers try before they look: its flag would reach a caller who watches for it */
        const double quotient = strongest / fmax(capacity, DBL_MIN);
        const double ratio = isfinite(capacity) && capacity > 0.0 ? quotient : 1.0;
        g->ridge[i] = RIDGE * fmin(ratio, WIDEST_WEIGHT);
        g->origin[i] = 0.0;
    }
}

/* the group with redundant contacts */
static RARE int solve_redundant(Group *g, int rounds)
{
    /* forces that jam grow on and on, and so does what they are measured by */
    const double SHRINKS = 0.5;
    double before = INFINITY;
    set_ridge(g);
    for (int step = 0; step < PROXIMAL_STEPS; step++) {
        if (change_states(g, rounds) != 1) return 0;
        const double added = added_by_ridge(g);
        if (added <= 1.0 && added <= SHRINKS * before) return 1;
        before = added;
        for (int k = 0; k < g->count; k++)
            g->origin[g->member[k]] = g->force[g->member[k]];
    }
    return 0;
}

static int solve_group(Group *g, double *lemke_room)
{
    const BoxProblem *p = g->of;
    for (int k = 0; k < g->count; k++) {
        const int i = g->member[k];
        const double own = fabs(p->G[i * p->n + i]);
        g->scale[i] = own > 0.0 ? 1.0 / sqrt(own) : 1.0;
        g->ridge[i] = 0.0;
        g->origin[i] = 0.0;
        g->force[i] = 0.0;
        g->state[i] = (signed char)(g->state[i] == 0 && !holdable(p, i) ? -1 : g->state[i]);
    }
    const int rounds = lemke_room ? 30 + 2 * g->count : 100 + 20 * g->count;
    int found = change_states(g, rounds);
    if (found < 0) found = solve_redundant(g, rounds);
    if (found == 1 || lemke_room == NULL) return found;
    if (!lemke_solve(p, g->member, g->count, g->scale, g->state, lemke_room)) return 0;
    for (int k = 0; k < g->count; k++)
        g->ridge[g->member[k]] = 0.0;
    /* rounding may have spoilt what was eliminated so often: the last word is the equations' */
    found = change_states(g, rounds);
    return found < 0 ? solve_redundant(g, rounds) : found;
}

/* the connected component of a seed into member; seen is marked */
static RARE int gather_group(const BoxProblem *p, int seed, int *member, signed char *seen)
{
    int count = 1;
    member[0] = seed;
    seen[seed] = 1;
    for (int k = 0; k < count; k++) {
        const int i = member[k];
        for (int e = 0; e < p->n; e++) {
            const int joined = p->G[i * p->n + e] != 0.0 || p->G[e * p->n + i] != 0.0
                               || (p->mu[i] > 0.0 && p->partner[i] == e) || (p->mu[e] > 0.0 && p->partner[e] == i);
            if (joined && !seen[e]) {
                seen[e] = 1;
                member[count++] = e;
            }
        }
    }
    return count;
}

int complementarity_solve(const BoxProblem *problem, signed char *state, double *force, double *room,
                          double *lemke_room)
{
    const ptrdiff_t n = problem->n;
    double *part = room + n * n;
    int *integers = (int *)(part + 6 * n);
    signed char *seen = (signed char *)(integers + 2 * n);
    Group g = {.of = problem,
               .member = integers,
               .place = integers + n,
               .scale = part,
               .ridge = part + n,
               .origin = part + 2 * n,
               .rate = part + 3 * n,
               .magnitude = part + 4 * n,
               .matrix = room,
               .right = part + 5 * n,
               .state = state,
               .force = force};
    for (int i = 0; i < n; i++)
        seen[i] = 0;
    for (int seed = 0; seed < n; seed++) {
        if (!seen[seed]) {
            g.count = gather_group(problem, seed, g.member, seen);
            if (!solve_group(&g, lemke_room)) return 0;
        }
    }
    return 1;
}
