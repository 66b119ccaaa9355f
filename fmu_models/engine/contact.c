/*
 * Forces of the contacts at one order of the Taylor series. Slipping contacts have a law; sticking ones share
 * whatever keeps their slip at rest:
 *
 *     G_ss lambda_s = -(slip_rate_s + G_sl lambda_l)                                             (1)
 *
 * Where several sticking contacts constrain the same motion (two discs of one speed) G_ss is singular and (1) has
 * many solutions; the one with the smallest sum of (lambda/capacity)^2 is taken. For contacts in parallel it loads
 * all to the same share of their capacity, so that they let go together, at the sum of the capacities.
 */
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

/* the same where S is regular, symmetric or not: D S^-1 D, by elimination with pivoting; 0 if S is singular */
static int KIND(solve_regular_column)(Real S[NC][NC], int n, const Real *D, int e, Real *column)
{
    Real A[NC][NC];
    double largest = 0.0;
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < n; k++) {
            A[i][k] = S[i][k];
            largest = fmax(largest, fabs(PART(S[i][k])));
        }
        column[i] = i == e ? D[e] : 0.0;
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
        }
        const Real swap = column[k];
        column[k] = column[pivot];
        column[pivot] = swap;
        for (int i = k + 1; i < n; i++) {
            const Real f = A[i][k] / A[k][k];
            for (int m = k; m < n; m++) {
                A[i][m] -= f * A[k][m];
            }
            column[i] -= f * column[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int m = i + 1; m < n; m++) {
            column[i] -= A[i][m] * column[m];
        }
        column[i] /= A[i][i];
    }
    for (int i = 0; i < n; i++) {
        column[i] *= D[i];
    }
    return 1;
}

void contact_factor(const Jets *j, const signed char *member, Sticking *s)
{
    s->count = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (member[c]) {
            s->contact[s->count++] = c;
        }
    }
    if (s->count == 1) {
        const int c = s->contact[0];
        s->inverse[0][0] = 1.0 / j->G[c][c][0];
        return;
    }
    Real S[NC][NC];
    Real L[NC][NC];
    Real D[NC];
    for (int i = 0; i < s->count; i++) {
        const double capacity = PART(j->capacity[s->contact[i]][0]);
        D[i] = capacity > 0.0 ? capacity : 1.0;
    }
    for (int i = 0; i < s->count; i++) {
        for (int k = 0; k < s->count; k++) {
            S[i][k] = D[i] * j->G[s->contact[i]][s->contact[k]][0] * D[k];
        }
    }
    int rank = s->count;
    for (int e = 0; e < s->count; e++) {
        Real column[NC];
        if (rank < s->count || !KIND(solve_regular_column)(S, s->count, D, e, column)) {
            if (rank == s->count) {
                rank = KIND(cholesky)(S, s->count, L);
            }
            KIND(solve_column)(L, s->count, rank, D, e, column);
        }
        for (int i = 0; i < s->count; i++) {
            s->inverse[i][e] = column[i];
        }
    }
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

/* order k of G lambda for row c, the unknown lambda[k] of sticking contacts left out */
static Real KIND(transmitted)(const Point *at, const Jets *j, int c, int k)
{
    Real sum = 0.0;
    for (int e = 0; e < MODEL_NC; e++) {
        const int sticks = at->state[e] == CONTACT_STICK;
        if (at->state[e] == CONTACT_AWAY || at->state[e] == CONTACT_RELEASED || (MODEL_CONSTANT_INERTIA && sticks)) {
            continue;
        }
        if (MODEL_CONSTANT_INERTIA) {
            sum += j->G[c][e][0] * j->force[e][k];
        } else {
            sum += KIND(product)(j->G[c][e], j->force[e], k) - (sticks ? j->G[c][e][0] * j->force[e][k] : 0.0);
        }
    }
    return sum;
}

void contact_forces(Point *at, Jets *j, int k)
{
    int sticking = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        switch (at->state[c]) {
        case CONTACT_STICK:
            model_stick(at->p, at->d, j, k, c);
            j->force[c][k] = 0.0;
            sticking = 1;
            break;
        case CONTACT_AWAY:
        case CONTACT_RELEASED:
            j->force[c][k] = 0.0;
            break;
        default:
            model_law(at->p, at->d, j, k, c);
        }
    }
    if (!sticking) {
        return;
    }
    Sticking *s = &at->sticking;
    if (k == 0) {
        signed char member[NC];
        for (int c = 0; c < MODEL_NC; c++) {
            member[c] = at->state[c] == CONTACT_STICK;
        }
        contact_factor(j, member, s);
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
}

Real contact_rate(const Jets *j, int i, int k)
{
    Real sum = j->a[i][k];
    for (int c = 0; c < MODEL_NC; c++) {
        sum += MODEL_CONSTANT_INERTIA ? j->W[i][c][0] * j->force[c][k] : KIND(product)(j->W[i][c], j->force[c], k);
    }
    return sum;
}

int contact_project(Point *at, Jets *j, const signed char *member)
{
    Sticking s;
    contact_factor(j, member, &s);
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
