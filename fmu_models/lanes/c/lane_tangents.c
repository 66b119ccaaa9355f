/* Differences of neighbours along the motion of one lane: events that no batch makes, and held contacts. */
#include "lane_tangents.h"

#include "lane_held.h"
#include "lane_transition.h"

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

/* without slip of the contacts that are held: what the engine takes out too */
static void hold(const LaneTable *t, const LaneMode *m, double *w)
{
    double y[NC];
    for (int k = 0; k < m->held_count; k++)
        y[k] = row_sum(t->approach[m->held[k]], w, 0.0);
    for (int k = 0; k < m->held_count; k++)
        for (int i = MODEL_NQ; i < MODEL_NX; i++)
            w[i] += m->no_slip[k][i] * y[k];
}

void tangents_held(const LaneTable *t, Lane *lane, int64_t directions)
{
    const LaneMode *m = &t->mode[lane->mode];
    for (int n = 0; n < directions && m->held_count > 0; n++) {
        double w[LANES_Z] = {0.0};
        memcpy(w, lane->tangent[n], sizeof lane->tangent[n]);
        hold(t, m, w);
        memcpy(lane->tangent[n], w, sizeof lane->tangent[n]);
    }
}

/* an impact of contact c, which has changed velocities */
static void strike(const LaneTable *t, const Lane *lane, int c, double *w)
{
    const int f = lanes_partner[c] - 1;
    double normal, rub;
    const double arrival = row_sum(t->approach[c], w, 0.0);
    const double slip = f >= 0 ? row_sum(t->approach[f], w, 0.0) : 0.0;
    lane_impulses(t, c, lane->friction, arrival, slip, &normal, &rub);
    for (int i = MODEL_NQ; i < MODEL_NX; i++)
        w[i] += t->W[i][c] * normal + (f >= 0 ? t->W[i][f] * rub : 0.0);
}

void tangents_jump(const LaneTable *t, Lane *lane, const Fall *fall, int64_t directions)
{
    const LaneMode *m = &t->mode[lane->mode];
    double after[LANES_Z];
    rates(t, m, lane->z, after);
    for (int n = 0; n < directions; n++) {
        double *d = lane->tangent[n];
        double w[LANES_Z];
        for (int j = 0; j < LANES_Z; j++)
            w[j] = j < MODEL_NX ? d[j] : fall->turn[j - MODEL_NX] * fall->later[n];
        if (lane->struck >= 0) strike(t, lane, lane->struck, w);
        hold(t, m, w);
        for (int i = 0; i < MODEL_NX; i++)
            d[i] = w[i] - after[i] * fall->later[n];
    }
}

void tangents_end(const LaneTable *t, Lane *lane)
{
    double z[LANES_Z], f[LANES_Z];
    double square = 0.0;
    if (lane->motion.speed == 0.0) return;
    memcpy(z, lane->z, MODEL_NX * sizeof *z);
    memcpy(z + MODEL_NX, t->phasor[lane_point(t->steps)], 2 * LANES_HARMONICS * sizeof *z);
    rates(t, &t->mode[lane->mode], z, f);
    for (int i = 0; i < MODEL_NX; i++)
        square += f[i] * f[i];
    lane->motion.speed = sqrt(square);
}
