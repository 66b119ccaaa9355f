/*
 * The forces that hold contacts at rest, as a matrix: groups of contacts that G connects are solved each for themselves.
 *
 * Where several held contacts constrain the same motion (two discs of one speed) G_ss is singular and equation (1) of
 * contact_forces.c has many solutions; the one with the smallest sum of lambda^2/capacity is taken. For contacts in
 * parallel it loads all to the same share of their capacity, so that they let go together, at the sum of the capacities.
 */
#include "contact_factor.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

/* pivoted Cholesky S = L L^T of a symmetric positive semidefinite matrix; returns the rank */
static int KIND(cholesky)(Real S[NC][NC], int n, Real L[NC][NC])
{
    Real diagonal[NC];
    int used[NC] = {0};
    double largest = 0.0;
    for (int i = 0; i < n; i++) {
        diagonal[i] = S[i][i];
        largest = fmax(largest, PART(S[i][i]));
    }
    for (int r = 0; r < n; r++) {
        int pivot = -1;
        for (int i = 0; i < n; i++)
            if (!used[i] && (pivot < 0 || PART(diagonal[i]) > PART(diagonal[pivot]))) pivot = i;
        if (!(PART(diagonal[pivot]) > 64.0 * n * DBL_EPSILON * largest)) return r;
        used[pivot] = 1;
        const Real root = sqrt(diagonal[pivot]);
        for (int i = 0; i < n; i++) {
            Real s = S[i][pivot];
            for (int k = 0; k < r; k++)
                s -= L[i][k] * L[pivot][k];
            L[i][r] = i == pivot ? root : (used[i] ? 0.0 : s / root);
            diagonal[i] -= L[i][r] * L[i][r];
        }
    }
    return n;
}

/* take multiples of row k of A and B from the rows below, so that column k is zero there */
static void KIND(factor_eliminate)(Real A[NC][NC], int n, int k, Real B[NC][NC], int columns)
{
    for (int i = k + 1; i < n; i++) {
        if (A[i][k] == 0.0) continue;
        const Real f = A[i][k] / A[k][k];
        for (int m = k; m < n; m++)
            A[i][m] -= f * A[k][m];
        for (int e = 0; e < columns; e++)
            B[i][e] -= f * B[k][e];
    }
}

/* solve A X = B for an upper triangle A, the columns of X in place of those of B */
static void KIND(factor_substitute)(Real A[NC][NC], int n, Real B[NC][NC], int columns)
{
    for (int i = n - 1; i >= 0; i--) {
        for (int m = i + 1; m < n; m++)
            for (int e = 0; A[i][m] != 0.0 && e < columns; e++)
                B[i][e] -= A[i][m] * B[m][e];
        for (int e = 0; e < columns; e++)
            B[i][e] /= A[i][i];
    }
}

/* solve A X = B for a symmetric positive definite A of n rows, the columns of X in place of those of B */
static void KIND(solve_definite)(Real A[NC][NC], int n, Real B[NC][NC], int columns)
{
    for (int k = 0; k < n; k++)
        KIND(factor_eliminate)(A, n, k, B, columns);
    KIND(factor_substitute)(A, n, B, columns);
}

/* P = S where that is symmetric; with drag, and of switches, it is not, and P = S S^T */
static void KIND(make_symmetric)(Real S[NC][NC], int n, int symmetric, Real P[NC][NC])
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            P[i][k] = symmetric ? S[i][k] : 0.0;
            for (int e = 0; !symmetric && e < n; e++)
                P[i][k] += S[i][e] * S[k][e];
        }
    }
}

/* D P^+ D, the least-norm solution operator of (1) for P = D G D */
static RARE void KIND(solve_redundant_forces)(Real P[NC][NC], int n, const Real *D, Real columns[NC][NC])
{
    Real L[NC][NC];
    Real A[NC][NC];
    Real Y[NC][NC];
    const int rank = KIND(cholesky)(P, n, L);
    for (int k = 0; k < rank; k++)
        for (int e = 0; e < n; e++)
            Y[k][e] = L[e][k] * D[e];
    /* P^+ = L (L^T L)^-2 L^T */
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < rank; i++) {
            for (int j = 0; j < rank; j++) {
                A[i][j] = 0.0;
                for (int c = 0; c < n; c++)
                    A[i][j] += L[c][i] * L[c][j];
            }
        }
        KIND(solve_definite)(A, rank, Y, n);
    }
    for (int c = 0; c < n; c++) {
        for (int e = 0; e < n; e++) {
            columns[c][e] = 0.0;
            for (int k = 0; k < rank; k++)
                columns[c][e] += D[c] * L[c][k] * Y[k][e];
        }
    }
}

/* D S^+ D; with drag S^+ = S^T (S S^T)^+ */
static RARE void KIND(solve_least_norm)(Real S[NC][NC], int n, int symmetric, const Real *D, Real columns[NC][NC])
{
    Real P[NC][NC];
    Real X[NC][NC];
    KIND(make_symmetric)(S, n, symmetric, P);
    KIND(solve_redundant_forces)(P, n, D, X);
    for (int i = 0; i < n; i++) {
        for (int e = 0; e < n; e++) {
            columns[i][e] = symmetric ? X[i][e] : 0.0;
            for (int k = 0; !symmetric && k < n; k++)
                columns[i][e] += D[i] * S[k][i] * X[k][e] / D[k];
        }
    }
}

/* D S^-1 D where S is regular, symmetric or not, by elimination with pivoting; 0 if S is
   singular */
static int KIND(solve_regular)(Real A[NC][NC], int n, const Real *D, Real columns[NC][NC])
{
    double largest = 0.0;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            largest = fmax(largest, fabs(PART(A[i][k])));
            columns[i][k] = i == k ? D[i] : 0.0;
        }
    }
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            pivot = fabs(PART(A[i][k])) > fabs(PART(A[pivot][k])) ? i : pivot;
        if (!(fabs(PART(A[pivot][k])) > 64.0 * n * DBL_EPSILON * largest)) return 0;
        for (int i = 0; i < n; i++) {
            const Real swap = A[k][i];
            A[k][i] = A[pivot][i];
            A[pivot][i] = swap;
            const Real other = columns[k][i];
            columns[k][i] = columns[pivot][i];
            columns[pivot][i] = other;
        }
        KIND(factor_eliminate)(A, n, k, columns, n);
    }
    KIND(factor_substitute)(A, n, columns, n);
    for (int i = 0; i < n; i++)
        for (int e = 0; e < n; e++)
            columns[i][e] *= D[i];
    return 1;
}

Real contact_drag(const Point *at, const signed char *state, int c)
{
    if (MODEL_IMPACTS == 0 || state == NULL || !model_contact_impulsive[c] || model_contact_partner[c] < 0) return 0.0;
    const int friction = model_contact_partner[c];
    const int sign = state[friction] == CONTACT_SLIP_PLUS ? 1 : state[friction] == CONTACT_SLIP_MINUS ? -1 : 0;
    return sign == 0 ? 0.0 : -sign * model_friction(at->p, at->d, friction);
}

/* order 0 of G for row c and member i with its drag */
static Real KIND(effect)(const Jets *j, const Sticking *s, int c, int i)
{
    const int e = s->contact[i];
    const int friction = model_contact_partner[e];
    Real effect = j->G[c][e][0];
    if (MODEL_IMPACTS > 0 && friction >= 0 && s->drag[i] != 0.0) effect += s->drag[i] * j->G[c][friction][0];
    return effect;
}

/* S = D G D of the members from the first on, with the drag of each */
static void KIND(scale_effects)(const Jets *j, const Sticking *s, int first, int n, const Real *D, Real S[NC][NC])
{
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            S[i][k] = D[i] * KIND(effect)(j, s, s->contact[first + i], first + k) * D[k];
}

/* the equations of one group: members first to last - 1 */
static void KIND(factor_group)(const Jets *j, Sticking *s, int first, int last)
{
    const int n = last - first;
    if (n == 1) {
        const Real own = KIND(effect)(j, s, s->contact[first], first);
        /* among others, one that no force can move carries none */
        s->inverse[first][first] = own == 0.0 && s->count > 1 ? 0.0 : 1.0 / own;
        return;
    }
    Real S[NC][NC];
    Real D[NC];
    Real columns[NC][NC];
    const double ROUNDING = 1e-12; /* of levers and masses; switches share no such symmetry */
    int symmetric = 1;
    for (int i = 0; i < n; i++) {
        symmetric &= s->drag[first + i] == 0.0;
        /* the friction of a rigid contact has a capacity only once the forces are known */
        const int c = s->contact[first + i];
        const double capacity = model_contact_partner[c] < 0 ? PART(stick_scale(j, c)) : 0.0;
        D[i] = capacity > 0.0 ? sqrt(capacity) : 1.0;
    }
    KIND(scale_effects)(j, s, first, n, D, S);
    if (!KIND(solve_regular)(S, n, D, columns)) {
        KIND(scale_effects)(j, s, first, n, D, S);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < i; k++)
                symmetric &= fabs(PART(S[i][k] - S[k][i])) <= ROUNDING * (PART(S[i][i]) + PART(S[k][k]));
        KIND(solve_least_norm)(S, n, symmetric, D, columns);
    }
    for (int i = 0; i < n; i++)
        for (int e = 0; e < n; e++)
            s->inverse[first + i][first + e] = columns[i][e];
}

/* the first contact of the group that c belongs to, of a forest in which every contact names an earlier one or itself */
static int KIND(group_of)(int *earlier, int c)
{
    while (earlier[c] != c) {
        earlier[c] = earlier[earlier[c]];
        c = earlier[c];
    }
    return c;
}

/* members that G connects, also by their slipping friction: earlier names a contact of the same group */
static void KIND(join_members)(const signed char *member, const Real *drag, int *earlier)
{
    for (int c = 0; c < MODEL_NC; c++)
        earlier[c] = c;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int n = model_joined_first[c]; member[c] && n < model_joined_first[c + 1]; n++) {
            int e = model_joined[n];
            if (MODEL_IMPACTS > 0 && !member[e] && model_contact_partner[e] >= 0
                && drag[(int)model_contact_partner[e]] != 0.0) {
                e = model_contact_partner[e];
            }
            if (member[e]) {
                const int one = KIND(group_of)(earlier, c);
                const int other = KIND(group_of)(earlier, e);
                earlier[one > other ? one : other] = one > other ? other : one;
            }
        }
    }
}

void contact_factor(const Point *at, const Jets *j, const signed char *member, const signed char *state, Sticking *s)
{
    int earlier[NC];
    int after[NC]; /* the next contact of the same group, -1: none */
    int latest[NC];
    Real drag[NC];
    for (int c = 0; c < MODEL_NC; c++)
        drag[c] = member[c] ? contact_drag(at, state, c) : 0.0;
    KIND(join_members)(member, drag, earlier);
    for (int c = 0; c < MODEL_NC; c++) {
        const int seed = KIND(group_of)(earlier, c);
        after[c] = -1;
        if (c != seed) after[latest[seed]] = c;
        latest[seed] = c;
    }
    s->count = 0;
    for (int c = 0; c < MODEL_NC; c++)
        s->count += member[c] != 0;
    int filled = 0;
    for (int seed = 0; seed < MODEL_NC; seed++) {
        if (!member[seed] || earlier[seed] != seed) continue;
        const int first = filled;
        for (int c = seed; c >= 0; c = after[c]) {
            s->drag[filled] = drag[c];
            s->contact[filled++] = c;
        }
        for (int i = first; i < filled; i++) {
            s->first[i] = first;
            s->last[i] = filled;
        }
        KIND(factor_group)(j, s, first, filled);
    }
}
