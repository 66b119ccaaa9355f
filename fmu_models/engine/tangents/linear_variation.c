/*
 * Variations of series that are sums (step/linear.c), capital letters:
 *
 *     Z[k] = T_k Z[1] + dT_k z[1]     Y[k] = R T_k Z[1] + d(R T_k) z[1],  k >= 1
 *
 * A start value changes no factor; those that parameters change are what the model makes of numbers with a tangent, once
 * per mode and run.
 */
#include "linear_variation.h"

#if MODEL_LINEAR

#include "../step/linear_factors.h"

enum { Z_PART = LINEAR_ORDER / 4 };

static Pair *variation_row(Variation *l, const LinearMode *m, int row)
{
    PairSeries *const of[Y_KINDS] = {l->slip, l->depth, l->force, l->release, l->capacity, l->capacity_minus};
    return row < MODEL_NX ? l->x[row] : of[m->quantity[row - MODEL_NX]][m->contact[row - MODEL_NX]];
}

/* what is not zero of the factors of one tangent, in a lane; two lanes share their entries */
static int is_zero(const Real *factor)
{
    int zero = 1;
    for (int k = 0; k < LINEAR_ORDER; k++)
        zero &= cimag(factor[k]) == 0.0;
    return zero;
}

static void keep_changes(const LinearMode *m, const LinearFactors *f, LinearChange *change)
{
    int count = 0;
    for (int i = 0; i < m->rows; i++) {
        change->first[i] = (short)count;
        for (int n = 0; n < Z_COLUMNS; n++) {
            if (is_zero(f[0].order[i][n]) && is_zero(f[1].order[i][n])) continue;
            for (int k = 0; k < LINEAR_ORDER; k++)
                change->factor[count][k] = (Pair){cimag(f[0].order[i][n][k]) / EPS, cimag(f[1].order[i][n][k]) / EPS};
            change->column[count++] = (unsigned char)n;
        }
    }
    change->first[m->rows] = (short)count;
    for (int h = 0; h < MODEL_NH; h++)
        change->rate[h] = (Pair){cimag(f[0].rate[h]) / EPS, cimag(f[1].rate[h]) / EPS};
}

static const LinearChange *change_of(const Run *r, Tangents *tangents, int k, const LinearMode *m)
{
    LinearChange *change = &variation_of(tangents, k)->change[m - r->linear];
    if (change->known && memcmp(change->state, m->state, sizeof m->state) == 0) return change;
    LinearFactors f[PAIR];
    memset(f, 0, sizeof f);
    for (int lane = 0; lane < PAIR && k + lane < tangents->count; lane++) {
        Tangent *t = &tangents->list[k + lane];
        flow_load(&t->at, &t->jets, 0);
        flow_field(&t->at, &t->jets, 0, 0);
        linear_factors(&t->at, &t->jets, m, &f[lane]);
    }
    keep_changes(m, f, change);
    memcpy(change->state, m->state, sizeof m->state);
    change->known = 1;
    return change;
}

/* z[1] of the motion and of two directions */
static void load_first(const Run *r, const LinearMode *m, const Variation *l, const LinearChange *change, double *z,
                       Pair *along)
{
    for (int i = 0; i < MODEL_NX; i++) {
        z[i] = r->jets.x[i][1];
        along[i] = l->x[i][1];
    }
    for (int h = 0; h < MODEL_NH; h++) {
        const int n = Z_SINE + 2 * h;
        const double sine = r->jets.w[model_sine[h]][0], cosine = r->jets.w[model_cosine[h]][0];
        const Pair turned = m->rate[h] * l->w[model_angle[h]][0], faster = change ? change->rate[h] : PAIR_ZERO;
        z[n] = m->rate[h] * cosine;
        z[n + 1] = -m->rate[h] * sine;
        along[n] = faster * cosine - turned * sine;
        along[n + 1] = -faster * sine - turned * cosine;
    }
    for (int i = 0; i < MODEL_NU; i++) {
        z[Z_INPUT + i] = r->jets.u[i][1];
        along[Z_INPUT + i] = l->u[i][1];
        z[Z_RATE + i] = r->jets.du[i][1];
        along[Z_RATE + i] = l->du[i][1];
    }
    z[Z_TIME] = 1.0;
    along[Z_TIME] = PAIR_ZERO;
}

void linear_variation(const Run *r, Tangents *tangents, int k, int every)
{
    Variation *l = variation_of(tangents, k);
    const LinearMode *m = &r->linear[r->segment_linear - 1];
    const LinearChange *change = l->moved ? change_of(r, tangents, k, m) : NULL;
    double z[Z_COLUMNS];
    Pair along[Z_COLUMNS];
    load_first(r, m, l, change, z, along);
    for (int i = 0; i < m->rows; i++) {
        const int contact = i < MODEL_NX ? 0 : m->contact[i - MODEL_NX];
        if (!every && i >= MODEL_NX && !r->falling[contact][0] && !r->falling[contact][1]) continue;
        Pair *series = variation_row(l, m, i) + 1;
        for (int n = 0; n < LINEAR_ORDER; n += Z_PART) {
            Pair sum[Z_PART] = {PAIR_ZERO};
            for (int e = m->first[i]; e < m->first[i + 1] && n < m->last[i]; e++)
                for (int p = 0; p < Z_PART; p++)
                    sum[p] += m->factor[e][n + p] * along[m->column[e]];
            for (int e = change ? change->first[i] : 0; change && e < change->first[i + 1]; e++)
                for (int p = 0; p < Z_PART; p++)
                    sum[p] += change->factor[e][n + p] * z[change->column[e]];
            memcpy(series + n, sum, sizeof sum);
        }
        if (!r->at.curved) continue;
        LINEAR_ADD_CURVES(series - 1, l, m->column, m->factor, m->first[i], m->first[i + 1])
        if (change)
            LINEAR_ADD_CURVES(series - 1, &r->jets, change->column, change->factor, change->first[i],
                              change->first[i + 1])
    }
    l->order = variation_order(&r->jets, l, LINEAR_ORDER);
}

#else

void linear_variation(const Run *r, Tangents *tangents, int k, int every)
{
    (void)r, (void)tangents, (void)k, (void)every;
}

#endif

#include "../model/scalar_real.h"
