/*
 * Differences of neighbours along the motion of one lane.
 *
 *     at home    d -> exp(A h) d per step of the grid; steps between two events are made at once, by powers of two
 *     event      a neighbour meets it later by dt = -(dg . d) / g', with the slope g' of the guard along the flow f- ;
 *                d -> J (d + f- dt) - f+ dt, J: the derivative of the jump, harmonics included
 *
 * Left to the series of the engine, which tell it: a guard that falls so slowly that there may be no derivative.
 *
 * Source: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.
 */
#include "lane_tangents.h"

/* of the terms of a guard's slope, over a sub-step: the engine has no derivative below a tenth of it
   (Tolerances.graze) */
static const double SLOW = 1e-6;

static void bring(const double *power, double *d)
{
    double next[MODEL_NX] = {0.0};
    LANES_STEP_SUMS(power, d, next);
    memcpy(d, next, sizeof next);
}

void tangents_bring(const Pool *pool, int64_t slot, int k)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    const int home = t->mode[lane->mode].home;
    if (pool->directions == 0) return;
    for (int bit = 0, left = k - lane->brought; left > 0; bit++, left >>= 1)
        for (int n = 0; n < pool->directions && (left & 1); n++)
            bring(t->home[home].power[bit], lane->tangent[n]);
    lane->brought = k;
}

/* rates of the states, from their own values and a constant, and of the harmonics */
static void rates(const LaneTable *t, const LaneMode *m, const double *z, double *f)
{
    LANES_FLOW(m->flow, z, f);
    for (int i = 0; i < MODEL_NX; i++)
        f[i] += m->constant[i];
    for (int k = 0; k < LANES_HARMONICS; k++) {
        f[MODEL_NX + 2 * k] = -t->wave[k] * z[MODEL_NX + 2 * k + 1];
        f[MODEL_NX + 2 * k + 1] = t->wave[k] * z[MODEL_NX + 2 * k];
    }
}

void tangents_begin(const Pool *pool, int64_t slot)
{
    const double *given = pool->tangents + slot * pool->directions * MODEL_NX;
    Lane *lane = &pool->lanes[slot];
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            lane->tangent[n][i] = pool_flushed(given[n * MODEL_NX + i]);
    lane->brought = 0;
}

void tangents_end(const Pool *pool, int64_t slot)
{
    double *wanted = pool->tangents + slot * pool->directions * MODEL_NX;
    const LaneTable *t = &pool->tables[slot];
    Lane *lane = &pool->lanes[slot];
    double z[LANES_Z], f[LANES_Z];
    double square = 0.0;
    if (pool->directions == 0) return;
    tangents_bring(pool, slot, t->steps);
    for (int n = 0; n < pool->directions; n++)
        memcpy(wanted + n * MODEL_NX, lane->tangent[n], sizeof lane->tangent[n]);
    if (lane->motion.speed == 0.0) return;
    memcpy(z, lane->z, MODEL_NX * sizeof *z);
    memcpy(z + MODEL_NX, t->phasor[lane_point(t->steps)], 2 * LANES_HARMONICS * sizeof *z);
    rates(t, &t->mode[lane->mode], z, f);
    for (int i = 0; i < MODEL_NX; i++)
        square += f[i] * f[i];
    lane->motion.speed = sqrt(square);
}

/* the terms of the slope of a guard along a flow, and of what that changes by over a sub-step */
static double slope_size(const LaneTable *t, const LaneMode *m, const double *f, int g)
{
    double bend[LANES_Z] = {0.0}, size = 0.0;
    for (int i = 0; i < MODEL_NQ; i++)
        bend[i] = fabs(f[MODEL_NQ + i]);
    for (int e = 0; e < LANES_FLOW; e++)
        bend[lanes_flow_row[e]] += fabs(m->flow[e] * f[lanes_flow_column[e]]);
    for (int j = MODEL_NX; j < LANES_Z; j++)
        bend[j] = t->wave[(j - MODEL_NX) / 2];
    for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++) {
        const int j = lanes_guard_column[e];
        size += fabs(m->guard[e]) * (fabs(f[j]) + m->longest * fabs(bend[j]));
    }
    return size;
}

void tangents_jump(const LaneTable *t, Lane *lane, const Fall *fall, const double *z, int g, int64_t directions)
{
    const LaneMode *m = &t->mode[fall->mode];
    const int c = lanes_guard_contact[g];
    double before[LANES_Z], after[LANES_Z];
    double slope = 0.0;
    rates(t, m, fall->z, before);
    rates(t, &t->mode[lane->mode], z, after);
    for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++)
        slope += m->guard[e] * before[lanes_guard_column[e]];
    lane->failed |= !(-slope > SLOW * slope_size(t, m, before, g));
    const double per_slope = 1.0 / slope;
    for (int n = 0; n < directions; n++) {
        double *d = lane->tangent[n];
        double w[LANES_Z], later = 0.0;
        for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++) {
            const int j = lanes_guard_column[e];
            later -= j < MODEL_NX ? m->guard[e] * d[j] : 0.0;
        }
        later *= per_slope;
        for (int j = 0; j < LANES_Z; j++)
            w[j] = (j < MODEL_NX ? d[j] : 0.0) + before[j] * later;
        if (lanes_impulsive[c] && m->state[c] == CONTACT_AWAY) {
            double y = 0.0;
            for (int j = 0; j < LANES_Z; j++)
                y += t->approach[c][j] * w[j];
            for (int i = MODEL_NQ; i < MODEL_NX; i++)
                w[i] -= (1.0 + t->restitution[c]) * y * t->push[c][i];
        }
        for (int i = 0; i < MODEL_NX; i++)
            d[i] = w[i] - after[i] * later;
    }
}
