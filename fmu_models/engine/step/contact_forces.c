/*
 * Forces of the contacts at one order of the Taylor series. Slipping contacts have a law; held ones (sticking friction,
 * closed rigid contacts) share whatever keeps their y at rest:
 *
 *     G_ss lambda_s = -(slip_rate_s + G_sl lambda_l)                                             (1)
 *
 * The friction of a closed rigid contact n that slips has lambda_t = -sign mu lambda_n: column n of G_ss is
 * G_sn - sign mu G_st then.
 *
 * Where several sticking contacts constrain the same motion (two discs of one speed) G_ss is singular and (1) has
 * many solutions; the one with the smallest sum of lambda^2/capacity is taken. For contacts in parallel it loads
 * all to the same share of their capacity, so that they let go together, at the sum of the capacities.
 */
#include "contact_forces.h"

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
        for (int i = 0; i < n; i++) {
            if (!used[i] && (pivot < 0 || PART(diagonal[i]) > PART(diagonal[pivot]))) {
                pivot = i;
            }
        }
        if (!(PART(diagonal[pivot]) > 64.0 * n * DBL_EPSILON * largest)) {
            return r;
        }
        used[pivot] = 1;
        const Real root = sqrt(diagonal[pivot]);
        for (int i = 0; i < n; i++) {
            Real s = S[i][pivot];
            for (int k = 0; k < r; k++) {
                s -= L[i][k] * L[pivot][k];
            }
            L[i][r] = i == pivot ? root : (used[i] ? 0.0 : s / root);
            diagonal[i] -= L[i][r] * L[i][r];
        }
    }
    return n;
}

/* solve A x = b for a small symmetric positive definite A, b overwritten */
static void KIND(solve_definite)(Real A[NC][NC], int n, Real *b)
{
    for (int k = 0; k < n; k++) {
        for (int i = k + 1; i < n; i++) {
            const Real f = A[i][k] / A[k][k];
            for (int j = k; j < n; j++) {
                A[i][j] -= f * A[k][j];
            }
            b[i] -= f * b[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++) {
            b[i] -= A[i][j] * b[j];
        }
        b[i] /= A[i][i];
    }
}

/* column e of D S^+ D, the least-norm solution operator of (1), from the factor of S = D G D */
static void KIND(solve_column)(Real L[NC][NC], int n, int rank, const Real *D, int e, Real *column)
{
    Real y[NC];
    for (int k = 0; k < rank; k++) {
        y[k] = L[e][k] * D[e];
    }
    /* S^+ = L (L^T L)^-2 L^T */
    for (int pass = 0; pass < 2; pass++) {
        Real A[NC][NC];
        for (int i = 0; i < rank; i++) {
            for (int j = 0; j < rank; j++) {
                A[i][j] = 0.0;
                for (int c = 0; c < n; c++) {
                    A[i][j] += L[c][i] * L[c][j];
                }
            }
        }
        KIND(solve_definite)(A, rank, y);
    }
    for (int c = 0; c < n; c++) {
        column[c] = 0.0;
        for (int k = 0; k < rank; k++) {
            column[c] += D[c] * L[c][k] * y[k];
        }
    }
}

/* all columns of D S^+ D; with drag S is not symmetric, and S^+ = S^T (S S^T)^+ */
static void KIND(solve_least_norm)(Real S[NC][NC], int n, int symmetric, const Real *D, Real columns[NC][NC])
{
    Real P[NC][NC];
    Real L[NC][NC];
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            P[i][k] = S[i][k];
            for (int e = 0; !symmetric && e < n; e++) {
                P[i][k] = (e == 0 ? 0.0 : P[i][k]) + S[i][e] * S[k][e];
            }
        }
    }
    const int rank = KIND(cholesky)(P, n, L);
    for (int e = 0; e < n; e++) {
        Real column[NC];
        KIND(solve_column)(L, n, rank, D, e, column);
        for (int i = 0; i < n; i++) {
            columns[i][e] = symmetric ? column[i] : 0.0;
            for (int k = 0; !symmetric && k < n; k++) {
                columns[i][e] += D[i] * S[k][i] * column[k] / D[k];
            }
        }
    }
}

/* the same where S is regular, symmetric or not: all columns of D S^-1 D, by elimination with pivoting; 0 if S is
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
        for (int i = k + 1; i < n; i++) {
            pivot = fabs(PART(A[i][k])) > fabs(PART(A[pivot][k])) ? i : pivot;
        }
        if (!(fabs(PART(A[pivot][k])) > 64.0 * n * DBL_EPSILON * largest)) {
            return 0;
        }
        for (int i = 0; i < n; i++) {
            const Real swap = A[k][i];
            A[k][i] = A[pivot][i];
            A[pivot][i] = swap;
            const Real other = columns[k][i];
            columns[k][i] = columns[pivot][i];
            columns[pivot][i] = other;
        }
        for (int i = k + 1; i < n; i++) {
            if (A[i][k] == 0.0) {
                continue;
            }
            const Real f = A[i][k] / A[k][k];
            for (int m = k; m < n; m++) {
                A[i][m] -= f * A[k][m];
            }
            for (int e = 0; e < n; e++) {
                columns[i][e] -= f * columns[k][e];
            }
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int m = i + 1; m < n; m++) {
            if (A[i][m] != 0.0) {
                for (int e = 0; e < n; e++) {
                    columns[i][e] -= A[i][m] * columns[m][e];
                }
            }
        }
        for (int e = 0; e < n; e++) {
            columns[i][e] /= A[i][i];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int e = 0; e < n; e++) {
            columns[i][e] *= D[i];
        }
    }
    return 1;
}

/* force of the slipping friction of rigid contact c per force of c, in these states; 0 if it has none that slips */
static Real KIND(drag)(const Point *at, const signed char *state, int c)
{
    if (MODEL_IMPACTS == 0 || state == NULL || !model_contact_is_impact[c] || model_contact_partner[c] < 0) {
        return 0.0;
    }
    const int friction = model_contact_partner[c];
    const int sign = state[friction] == CONTACT_SLIP_PLUS ? 1 : state[friction] == CONTACT_SLIP_MINUS ? -1 : 0;
    return sign == 0 ? 0.0 : -sign * model_friction(at->p, at->d, friction);
}

/* order 0 of G for row c and member i with its drag */
static Real KIND(effect)(const Jets *j, const Sticking *s, int c, int i)
{
    const int e = s->contact[i];
    Real effect = j->G[c][e][0];
    if (MODEL_IMPACTS > 0 && s->drag[i] != 0.0) {
        effect += s->drag[i] * j->G[c][(int)model_contact_partner[e]][0];
    }
    return effect;
}

/* S = D G D of the members, with the drag of each */
static void KIND(scale_effects)(const Jets *j, const Sticking *s, const Real *D, Real S[NC][NC])
{
    for (int i = 0; i < s->count; i++) {
        for (int k = 0; k < s->count; k++) {
            S[i][k] = D[i] * KIND(effect)(j, s, s->contact[i], k) * D[k];
        }
    }
}

void contact_factor(const Point *at, const Jets *j, const signed char *member, const signed char *state, Sticking *s)
{
    s->count = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (member[c]) {
            s->drag[s->count] = KIND(drag)(at, state, c);
            s->contact[s->count++] = c;
        }
    }
    if (s->count == 1) {
        s->inverse[0][0] = 1.0 / KIND(effect)(j, s, s->contact[0], 0);
        return;
    }
    Real S[NC][NC];
    Real D[NC];
    for (int i = 0; i < s->count; i++) {
        /* the friction of a rigid contact has a capacity only once the forces are known */
        const double capacity = model_contact_partner[s->contact[i]] < 0 ? PART(j->capacity[s->contact[i]][0]) : 0.0;
        D[i] = capacity > 0.0 ? sqrt(capacity) : 1.0;
    }
    KIND(scale_effects)(j, s, D, S);
    if (KIND(solve_regular)(S, s->count, D, s->inverse)) {
        return;
    }
    KIND(scale_effects)(j, s, D, S);
    int symmetric = 1;
    for (int i = 0; i < s->count; i++) {
        symmetric &= s->drag[i] == 0.0;
    }
    KIND(solve_least_norm)(S, s->count, symmetric, D, s->inverse);
}

/* order k of the product of two series */
static Real KIND(product)(const Real *a, const Real *b, int k)
{
    Real sum = 0.0;
    for (int i = 0; i <= k; i++) {
        sum += a[i] * b[k - i];
    }
    return sum;
}

/* order k of G lambda for row c; forces still unknown at this order count as zero */
static Real KIND(transmitted)(const Point *at, const Jets *j, int c, int k)
{
    Real sum = 0.0;
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        /* what is still unknown at this order acts through its lower orders only */
        const int silent = MODEL_CONSTANT_INERTIA && !contact_has_law(at->state, e);
        if (silent || at->state[e] == CONTACT_AWAY || at->state[e] == CONTACT_RELEASED) {
            continue;
        }
        sum += MODEL_CONSTANT_INERTIA ? j->G[c][e][0] * j->force[e][k] : KIND(product)(j->G[c][e], j->force[e], k);
    }
    return sum;
}

/* order k of what follows from the forces of rigid contacts: their slipping friction, and what their friction can
   hold */
static void KIND(friction_of_rigid)(const Point *at, Jets *j, int k)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_is_impact[c] || at->state[c] == CONTACT_AWAY) {
            continue;
        }
        j->capacity[c][k] = model_friction(at->p, at->d, c) * j->force[normal][k];
        if (at->state[c] != CONTACT_STICK) {
            j->force[c][k] = KIND(drag)(at, at->state, normal) * j->force[normal][k];
        }
    }
}

void contact_forces(Point *at, Jets *j, int k)
{
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (contact_is_held(at->state, c)) {
            model_stick(at->p, at->d, j, k, c);
            j->force[c][k] = 0.0;
            any = 1;
        } else if (contact_has_law(at->state, c)) {
            model_law(at->p, at->d, j, k, c);
        } else {
            j->force[c][k] = 0.0;
        }
    }
    if (!any) {
        return;
    }
    Sticking *s = &at->sticking;
    if (k == 0) {
        signed char member[NC];
        for (int c = 0; c < MODEL_NC; c++) {
            member[c] = (signed char)contact_is_held(at->state, c);
        }
        contact_factor(at, j, member, at->state, s);
    }
    Real rest[NC];
    for (int i = 0; i < s->count; i++) {
        const int c = s->contact[i];
        rest[i] = j->slip_rate[c][k] + KIND(transmitted)(at, j, c, k);
    }
    for (int i = 0; i < s->count; i++) {
        Real force = 0.0;
        for (int e = 0; e < s->count; e++) {
            force -= s->inverse[i][e] * rest[e];
        }
        j->force[s->contact[i]][k] = force;
    }
    if (MODEL_IMPACTS > 0) {
        KIND(friction_of_rigid)(at, j, k);
    }
}

Real contact_rate(const Jets *j, int i, int k)
{
    Real sum = j->a[i][k];
    for (int n = model_acting_first[i]; n < model_acting_first[i + 1]; n++) {
        const int c = model_acting[n];
        sum += MODEL_CONSTANT_INERTIA ? j->W[i][c][0] * j->force[c][k] : KIND(product)(j->W[i][c], j->force[c], k);
    }
    return sum;
}

int contact_project(Point *at, Jets *j, const signed char *member)
{
    Sticking s;
    contact_factor(at, j, member, NULL, &s);
    int moved = 0;
    for (int i = 0; i < s.count; i++) {
        Real impulse = 0.0;
        for (int e = 0; e < s.count; e++) {
            impulse -= s.inverse[i][e] * j->slip[s.contact[e]][0];
        }
        if (impulse != 0.0) {
            moved = 1;
            for (int v = 0; v < MODEL_NV; v++) {
                at->x[MODEL_NQ + v] += j->W[v][s.contact[i]][0] * impulse;
            }
        }
    }
    return moved;
}

void contact_impulse(const Point *at, const Jets *j, const ImpactPhase *phase, const Real *given, const Real *target,
                     Real *impulse)
{
    Sticking s;
    contact_factor(at, j, phase->held, phase->friction, &s);
    for (int c = 0; c < MODEL_NC; c++) {
        impulse[c] = 0.0;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_is_impact[c] && !phase->held[c] && given[c] != 0.0) {
            impulse[c] = given[c];
            if (model_contact_partner[c] >= 0 && !phase->held[(int)model_contact_partner[c]]) {
                impulse[(int)model_contact_partner[c]] = KIND(drag)(at, phase->friction, c) * given[c];
            }
        }
    }
    Real rest[NC];
    for (int i = 0; i < s.count; i++) {
        const int c = s.contact[i];
        rest[i] = j->slip[c][0] - target[c];
        for (int e = 0; e < MODEL_NC; e++) {
            rest[i] += j->G[c][e][0] * impulse[e];
        }
    }
    for (int i = 0; i < s.count; i++) {
        Real sum = 0.0;
        for (int e = 0; e < s.count; e++) {
            sum -= s.inverse[i][e] * rest[e];
        }
        impulse[s.contact[i]] = sum;
        if (s.drag[i] != 0.0) {
            impulse[(int)model_contact_partner[s.contact[i]]] = s.drag[i] * sum;
        }
    }
}

void contact_targets(const Point *at, const Jets *j, int number, const Real *before, Real *given, Real *target)
{
    for (int c = 0; c < MODEL_NC; c++) {
        given[c] = 0.0;
        target[c] = 0.0;
        if (!model_contact_is_impact[c]) {
            continue;
        }
        if (number > 0) {
            given[c] = model_restitution(at->p, at->d, c) * before[c];
        } else if (!model_contact_poisson[c] && PART(j->slip[c][0]) < 0.0) {
            target[c] = -model_restitution(at->p, at->d, c) * j->slip[c][0];
        }
    }
}

void contact_apply(Point *at, Jets *j, const Real *impulse)
{
    for (int v = 0; v < MODEL_NV; v++) {
        for (int c = 0; c < MODEL_NC; c++) {
            if (impulse[c] != 0.0) {
                at->x[MODEL_NQ + v] += j->W[v][c][0] * impulse[c];
            }
        }
    }
    for (int c = 0; c < MODEL_NC; c++) {
        for (int e = 0; e < MODEL_NC; e++) {
            j->slip[c][0] += j->G[c][e][0] * impulse[e];
        }
    }
}
