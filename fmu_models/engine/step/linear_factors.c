/*
 * The factors of a mode that is linear (linear.c): what the model's own functions make at order 1 of one column after the
 * other. Included once per kind of number: those of numbers with a tangent have the derivatives of the factors.
 */
#include "linear_factors.h"

#include "contact_forces.h"
#include "flow.h"

#if MODEL_LINEAR

Real *linear_row(Jets *j, const LinearMode *m, int row)
{
    Series *const of[Y_KINDS] = {j->slip, j->depth, j->force, j->release, j->capacity, j->capacity_minus};
    return row < MODEL_NX ? j->x[row] : of[m->quantity[row - MODEL_NX]][m->contact[row - MODEL_NX]];
}

/* column n: what the model's functions make, at order 1, of what j holds there, less that of the time */
static void KIND(probe)(Point *at, Jets *j, const LinearMode *m, LinearFactors *f, int n, double less)
{
    flow_field(at, j, 1, 0);
    for (int i = 0; i < m->rows; i++) {
        const int v = i - MODEL_NQ;
        const Real made = i >= MODEL_NX  ? linear_row(j, m, i)[1]
                          : v < 0        ? j->x[MODEL_NQ + i][1]
                          : v < MODEL_NV ? contact_rate(j, v, 1)
                                         : j->zrate[v - MODEL_NV][1];
        f->row[i][n] = made - less * f->row[i][Z_TIME];
    }
}

/* order 1 of the state, input or rate of an input of column n; NULL of harmonics and the time */
static Real *KIND(term_of)(Jets *j, int n)
{
    return n < Z_SINE    ? &j->x[n][1]
           : n < Z_INPUT ? NULL
           : n < Z_RATE  ? &j->u[n - Z_INPUT][1]
           : n < Z_TIME  ? &j->du[n - Z_RATE][1]
                         : NULL;
}

static void KIND(probe_columns)(Point *at, Jets *j, const LinearMode *m, LinearFactors *f)
{
    memset(f, 0, sizeof *f);
    flow_load(at, j, 0);
    for (int h = 0; h < MODEL_NH; h++)
        j->w[model_sine[h]][0] = j->w[model_cosine[h]][0] = 0.0, j->w[model_angle[h]][1] = NAN;
    for (int n = 0; n < Z_TIME; n++)
        if (KIND(term_of)(j, n)) *KIND(term_of)(j, n) = 0.0;
    KIND(probe)(at, j, m, f, Z_TIME, 0.0);
    for (int h = 0; h < MODEL_NH; h++) {
        const Real rate = j->w[model_angle[h]][1];
        f->rate[h] = isnan(PART(rate)) ? 0.0 : rate; /* nothing in this mode makes this harmonic */
        f->still |= PART(rate) == 0.0;
        for (int side = 0; side < 2 && PART(f->rate[h]) != 0.0; side++) {
            /* order 1 of a sine is order 0 of its cosine, times the rate; of a cosine that of the sine, negative */
            Real *other = &j->w[side ? model_sine[h] : model_cosine[h]][0];
            *other = (side ? -1.0 : 1.0) / f->rate[h];
            KIND(probe)(at, j, m, f, Z_SINE + 2 * h + side, 1.0);
            *other = 0.0;
        }
    }
    j->t[1] = 0.0;
    for (int n = 0; n < Z_TIME; n++) {
        Real *one = KIND(term_of)(j, n);
        if (!one) continue;
        *one = 1.0;
        KIND(probe)(at, j, m, f, n, 0.0);
        *one = 0.0;
    }
}

/* T and R T, order by order, all columns side by side */
static void KIND(fill_orders)(const LinearMode *m, LinearFactors *f)
{
    Real z[Z_COLUMNS][Z_COLUMNS] = {{0.0}}, made[Z_ROWS][Z_COLUMNS];
    for (int n = 0; n < Z_COLUMNS; n++)
        z[n][n] = 1.0;
    for (int k = 1; k <= LINEAR_ORDER; k++) {
        const double share = 1.0 / (k + 1);
        memset(made, 0, (size_t)m->rows * sizeof *made);
        for (int i = 0; i < m->rows; i++) {
            for (int e = 0; e < Z_COLUMNS; e++)
                for (int n = 0; f->row[i][e] != 0.0 && n < Z_COLUMNS; n++)
                    made[i][n] += f->row[i][e] * z[e][n];
            for (int n = 0; n < Z_COLUMNS; n++)
                f->order[i][n][k - 1] = i < MODEL_NX ? z[i][n] : made[i][n];
        }
        for (int h = 0; h < MODEL_NH; h++) {
            Real *sine = z[Z_SINE + 2 * h], *cosine = z[Z_SINE + 2 * h + 1];
            const Real rate = f->rate[h] * share;
            for (int n = 0; n < Z_COLUMNS; n++) {
                const Real was = sine[n];
                sine[n] = rate * cosine[n];
                cosine[n] = -rate * was;
            }
        }
        for (int i = 0; i < MODEL_NX; i++)
            for (int n = 0; n < Z_COLUMNS; n++)
                z[i][n] = made[i][n] * share;
        memset(z + Z_INPUT, 0, (Z_COLUMNS - Z_INPUT) * sizeof *z);
    }
}

void linear_factors(Point *at, Jets *j, const LinearMode *m, LinearFactors *f)
{
    KIND(probe_columns)(at, j, m, f);
    KIND(fill_orders)(m, f);
}

#endif
