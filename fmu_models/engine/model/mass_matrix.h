/*
 * The accelerations of a mass matrix M(t,u,x) that is too large for its inverse to be written out, as Taylor series:
 *
 *     M x = b,  order by order:   M[0] x[k] = b[k] - sum_{i=1..k} M[i] x[k-i]
 *
 * so that only M[0] = L D L^T is factored, once a step, and every order costs a product and two substitutions. Rows of
 * the lower triangle are kept from their first entry that is not zero on, where L has its own: what is banded stays
 * banded. M is positive definite, so that no pivot is exchanged; a pivot that is not positive makes all that follows
 * NaN, which ends the run.
 *
 * Included once per kind of number (scalar.h).
 *
 * Sources: Golub and Van Loan, Matrix Computations (2013), section 4.1; Jennings, Computer Journal 9 (1966) (envelope).
 */
/* order k of the entry of M in row i and column c of its lower triangle, within the envelope */
#define MASS_PLACE(i, c) (model_mass_row[i] + (c))

/* L below and 1/D on the diagonal, from order 0 of M */
static inline void mass_factor(const InertiaSeries *M, Real *factor)
{
    for (int i = 0; i < MODEL_NV; i++) {
        Real pivot = M[MASS_PLACE(i, i)][0];
        for (int c = model_mass_first[i]; c < i; c++) {
            const int from = model_mass_first[i] > model_mass_first[c] ? model_mass_first[i] : model_mass_first[c];
            Real sum = M[MASS_PLACE(i, c)][0]; /* L D until the row is complete */
            for (int e = from; e < c; e++)
                sum -= factor[MASS_PLACE(i, e)] * factor[MASS_PLACE(c, e)];
            factor[MASS_PLACE(i, c)] = sum;
        }
        for (int c = model_mass_first[i]; c < i; c++) {
            const Real scaled = factor[MASS_PLACE(i, c)];
            factor[MASS_PLACE(i, c)] = scaled * factor[MASS_PLACE(c, c)];
            pivot -= scaled * factor[MASS_PLACE(i, c)];
        }
        factor[MASS_PLACE(i, i)] = PART(pivot) > 0.0 ? 1.0 / pivot : (Real)NAN;
    }
}

/* order k of x from that of b, which is in its place; stride: numbers from one series of x to the next */
static inline void mass_solve(const InertiaSeries *M, const Real *factor, Real *x, int stride, int k)
{
    for (int i = 0; i < MODEL_NV && k > 0; i++) {
        for (int c = model_mass_first[i]; c <= i; c++) {
            if (!model_mass_moves[MASS_PLACE(i, c)]) continue;
            const Real *entry = M[MASS_PLACE(i, c)];
            x[i * stride + k] -= jet_convolution(entry, x + c * stride, k, 1, k);
            if (c < i) x[c * stride + k] -= jet_convolution(entry, x + i * stride, k, 1, k);
        }
    }
    for (int i = 0; i < MODEL_NV; i++)
        for (int c = model_mass_first[i]; c < i; c++)
            x[i * stride + k] -= factor[MASS_PLACE(i, c)] * x[c * stride + k];
    for (int i = 0; i < MODEL_NV; i++)
        x[i * stride + k] *= factor[MASS_PLACE(i, i)];
    for (int i = MODEL_NV - 1; i >= 0; i--)
        for (int c = model_mass_first[i]; c < i; c++)
            x[c * stride + k] -= factor[MASS_PLACE(i, c)] * x[i * stride + k];
}

#undef MASS_PLACE
