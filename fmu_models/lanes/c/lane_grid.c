/* The numbers of one motion's flow, its steps of a grid among them. */
#include "lane_grid.h"

#include "lane_held.h"
#include "lane_modes.h"

/* modes whose rate is so many times that of the slowest still have a step of the grid */
static const double AS_SLOW = 3.0;
/* of harmonics at the end of a period: what is nearer to where they began is rounding */
static const double SAME_PHASE = 1e-9;

/* exp(A h) and what the harmonics and constants add */
static void home_step(const LaneTable *t, const Full *f, HomeStep *s)
{
    double whole[MODEL_NX][LANES_Z + 1];
    flow_over(t, f, t->h, whole);
    for (int e = 0; e < LANES_STEP; e++)
        s->step[e] = whole[lanes_step_row[e]][lanes_step_column[e]];
    for (int k = 0; k <= lane_point(t->steps - 1); k++) {
        for (int i = 0; i < MODEL_NX; i++) {
            double sum = whole[i][LANES_Z];
            for (int j = 0; j < 2 * LANES_HARMONICS; j++)
                sum += whole[i][MODEL_NX + j] * t->phasor[k][j];
            s->forced[k][i] = sum;
        }
    }
}

/* of a step of length h: what a guard is beyond its terms of order n - 1, at most, over the states that it reads on the way;
   the rest is returned */
static double beyond(const LaneTable *t, const Full *f, int c, int n, double factor, double *over)
{
    double bound[MODEL_NX];
    const double rest = row_bound(t, f, f->guard[lanes_home_guard[c]], n, t->h, bound);
    for (int e = lanes_bound_first[c]; e < lanes_bound_first[c + 1]; e++)
        over[e] = factor * bound[lanes_bound_column[e]];
    return factor * rest;
}

static void home_slopes(const LaneTable *t, const LaneMode *m, HomeStep *s, int c)
{
    const int g = lanes_home_guard[c];
    const double third = t->h / 3.0;
    double z[LANES_Z] = {0.0}, size;
    for (int k = 0; k <= lane_point(t->steps); k++) {
        memcpy(z + MODEL_NX, t->phasor[k], 2 * LANES_HARMONICS * sizeof *z);
        s->slope_constant[k][c] = third * guard_rate(t, m, z, g, &size);
    }
    for (int e = lanes_bound_first[c]; e < lanes_bound_first[c + 1]; e++) {
        double rate = 0.0;
        for (int i = 0; i < MODEL_NX; i++)
            rate += m->full.guard[g][i] * m->full.flow[i][lanes_bound_column[e]];
        s->slope[e] = third * rate;
    }
}

static void home_make(const LaneTable *t, const LaneMode *m, HomeStep *s)
{
    const Full *f = &m->full;
    const double square = t->h * t->h;
    home_step(t, f, s);
    for (int c = 0; c < LANES_HOME_GUARDS; c++) {
        const double *row = f->guard[lanes_home_guard[c]];
        for (int e = lanes_home_first[c]; e < lanes_home_first[c + 1]; e++)
            s->guard[e] = row[lanes_home_column[e]];
        for (int k = 0; k <= lane_point(t->steps); k++) {
            double sum = row[LANES_Z];
            for (int j = 0; j < 2 * LANES_HARMONICS; j++)
                sum += row[MODEL_NX + j] * t->phasor[k][j];
            s->guard_constant[k][c] = sum;
        }
        s->bound_constant[c] = beyond(t, f, c, 2, 0.125 * square, s->bound);
        s->tail_constant[c] = beyond(t, f, c, 4, square * square / 384.0, s->tail);
        home_slopes(t, m, s, c);
    }
}

/* where the harmonics are at the points of the grid */
static void table_phasors(LaneTable *t, const LaneRows *r)
{
    for (int n = 0; n <= lane_point(t->steps); n++) {
        const double time = t->period * n / t->steps;
        for (int k = 0; k < LANES_HARMONICS; k++) {
            const double angle = r->wave[k] * time + r->phase[k];
            t->phasor[n][2 * k] = cos(angle);
            t->phasor[n][2 * k + 1] = sin(angle);
        }
    }
    /* held where walls are when the time goes back: rounding of the period would else leave a contact in its wall */
    double far = 0.0;
    for (int j = 0; j < 2 * LANES_HARMONICS; j++)
        far = fmax(far, fabs(t->phasor[lane_point(t->steps)][j] - t->phasor[0][j]));
    if (LANES_HARMONICS > 0 && far < SAME_PHASE)
        memcpy(t->phasor[lane_point(t->steps)], t->phasor[0], sizeof t->phasor[0]);
}

/* whether the forces of contact c have one solution, whatever the motion is */
static int is_unique(const LaneRows *r, int c)
{
    /* near the friction that jams a wall forces are no longer told apart */
    const double FAR_FROM_JAM = 0.99;
    const int partner = lanes_partner[c] - 1;
    const int normal = lanes_led[c] ? partner : c;
    int switches = 0;
    for (int e = 0; e < MODEL_NC; e++)
        switches += lanes_surface[e];
    if (lanes_surface[c]) return switches == 1 && r->G[c][c] > 0.0;
    if (partner < 0) return 1;
    const int rub = lanes_partner[normal] - 1;
    return r->mu[rub] * fabs(r->G[normal][rub]) < FAR_FROM_JAM * r->G[normal][normal];
}

static void table_contacts(LaneTable *t, const LaneRows *r)
{
    memcpy(t->W, r->W, sizeof t->W);
    memcpy(t->G, r->G, sizeof t->G);
    memcpy(t->mu, r->mu, sizeof t->mu);
    for (int c = 0; c < MODEL_NC; c++) {
        t->unique[c] = (signed char)is_unique(r, c);
        memcpy(t->approach[c], r->slip[c], sizeof t->approach[c]);
        memcpy(t->depth[c], r->depth[c], sizeof t->depth[c]);
        t->restitution[c] = r->restitution[c];
        t->entry_release[c][0] = r->release[c][1];
        t->entry_release[c][1] = r->release[c][2];
        for (int i = 0; i < MODEL_NX; i++)
            t->push[c][i] = lanes_impulsive[c] ? r->W[i][c] / r->G[c][c] : 0.0;
    }
}

int table_make(LaneTable *t, const double *p, const double *u, double period)
{
    static const double no_sign[NC];
    LaneRows r;
    double slowest = INFINITY, fastest = 0.0;
    int homes = 0, home[LANES_HOMES] = {0};
    t->usable = 0;
    memset(t->made, 0, sizeof t->made);
    memcpy(t->p, p, MODEL_NP * sizeof *p);
    memcpy(t->u, u, MODEL_NU * sizeof *u);
    t->period = period;
    lanes_rows(p, u, no_sign, &r);
    memcpy(t->wave, r.wave, sizeof t->wave);
    memcpy(t->phase, r.phase, sizeof t->phase);
    table_contacts(t, &r);
    for (int m = 0; m < LANES_MODES && homes < LANES_HOMES; m++) {
        if (!mode_is_away(m)) continue;
        slowest = fmin(slowest, table_at(t, m)->rate);
        home[homes++] = m;
    }
    for (int n = 0; n < homes; n++) {
        LaneMode *mode = &t->mode[home[n]];
        mode->home = mode->rate <= AS_SLOW * slowest ? n : -1;
        mode->on_grid = mode->home >= 0;
        fastest = mode->home >= 0 ? fmax(fastest, mode->rate) : fastest;
    }
    const double steps = ceil(period * fastest / LANES_REACH);
    if (!(period > 0.0) || !(steps <= LANES_GRID)) return 0;
    t->steps = steps > 1.0 ? (int)steps : 1;
    t->h = period / t->steps;
    table_phasors(t, &r);
    for (int n = 0; n < homes; n++)
        if (t->mode[home[n]].home >= 0) home_make(t, &t->mode[home[n]], &t->home[n]);
    t->usable = 1;
    return 1;
}
