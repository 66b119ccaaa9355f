/* The numbers of one motion's flow. */
#include "lane_table.h"

/* rate times length of a step, over which a series of LANES_ORDER terms leaves rounding */
static const double REACH = 0.42;
/* modes whose rate is so many times that of the slowest still have a step of the grid */
static const double AS_SLOW = 3.0;

static const signed char stop_states[] = {CONTACT_AWAY, CONTACT_TOUCHING, CONTACT_RELEASED};
static const signed char switch_states[] = {CONTACT_SLIP_PLUS, CONTACT_SLIP_MINUS};

static signed char state_of(int c, int digit)
{
    return lanes_kind[c] == KIND_STOP     ? stop_states[digit]
           : lanes_kind[c] == KIND_SWITCH ? switch_states[digit]
                                          : CONTACT_AWAY;
}

int table_mode(const signed char *state)
{
    int mode = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        int digit = 0;
        while (digit < lanes_digits[c] && state_of(c, digit) != state[c]) {
            digit++;
        }
        if (digit == lanes_digits[c]) {
            return -1;
        }
        mode = mode * lanes_digits[c] + digit;
    }
    return mode;
}

static void mode_states(int mode, signed char *state)
{
    for (int c = MODEL_NC - 1; c >= 0; c--) {
        state[c] = state_of(c, mode % lanes_digits[c]);
        mode /= lanes_digits[c];
    }
}

static int is_moved(const double *row)
{
    for (int j = MODEL_NX; j < LANES_Z; j++) {
        if (row[j] != 0.0) {
            return 1;
        }
    }
    return 0;
}

/* the place of the wall of the first stop that touches, if it rests and is reached along coordinates; that stop, or
   -1 */
static int mode_shift(const LaneRows *r, LaneMode *m)
{
    memset(m->shift, 0, sizeof m->shift);
    for (int c = 0; c < MODEL_NC; c++) {
        double size = 0.0;
        if (lanes_kind[c] != KIND_STOP || m->state[c] != CONTACT_TOUCHING || is_moved(r->depth[c])) {
            continue;
        }
        for (int i = 0; i < MODEL_NQ; i++) {
            size += r->depth[c][i] * r->depth[c][i];
        }
        if (!(size > 0.0)) {
            continue;
        }
        for (int i = 0; i < MODEL_NQ; i++) {
            m->shift[i] = -r->depth[c][LANES_Z] / size * r->depth[c][i];
        }
        return c;
    }
    return -1;
}

/* the constant of a row once the origin is moved; that of the stop on whose wall it lies is zero */
static double shifted(const double *row, const double *shift)
{
    double sum = row[LANES_Z];
    for (int j = 0; j < MODEL_NX; j++) {
        sum += row[j] * shift[j];
    }
    return sum;
}

/* the rows of a mode in full: flow, and guards */
typedef struct {
    double flow[MODEL_NX][LANES_Z + 1], guard[LANES_NG][LANES_Z + 1];
} Full;

static void full_flow(const LaneRows *r, const LaneMode *m, int wall, Full *f)
{
    for (int i = 0; i < MODEL_NX; i++) {
        memcpy(f->flow[i], r->flow[i], sizeof f->flow[i]);
        f->flow[i][LANES_Z] = shifted(r->flow[i], m->shift);
        for (int c = 0; c < MODEL_NC; c++) {
            if (m->state[c] != CONTACT_TOUCHING || r->W[i][c] == 0.0) {
                continue;
            }
            for (int j = 0; j < LANES_Z; j++) {
                f->flow[i][j] += r->W[i][c] * (r->force[c][0] * r->depth[c][j] + r->force[c][1] * r->slip[c][j]);
            }
            const double depth = c == wall ? 0.0 : shifted(r->depth[c], m->shift);
            f->flow[i][LANES_Z] +=
                r->W[i][c] * (r->force[c][0] * depth + r->force[c][1] * shifted(r->slip[c], m->shift) + r->force[c][2]);
        }
    }
}

static void full_guard(const LaneRows *r, const LaneMode *m, int wall, int g, double *row)
{
    const int c = lanes_guard_contact[g];
    const int state = m->state[c];
    memset(row, 0, (LANES_Z + 1) * sizeof *row);
    if (lanes_guard_slot[g] == 1 && state == CONTACT_AWAY) {
        row[LANES_Z] = 1.0;
        return;
    }
    if (lanes_guard_slot[g] == 1) {
        const double sign = state == CONTACT_TOUCHING ? 1.0 : -1.0;
        for (int j = 0; j < LANES_Z; j++) {
            row[j] = sign * (r->release[c][0] * r->depth[c][j] + r->release[c][1] * r->slip[c][j]);
        }
        const double depth = c == wall ? 0.0 : shifted(r->depth[c], m->shift);
        row[LANES_Z] =
            sign * (r->release[c][0] * depth + r->release[c][1] * shifted(r->slip[c], m->shift) + r->release[c][2]);
        return;
    }
    const int outside = lanes_kind[c] == KIND_SWITCH ? state == CONTACT_SLIP_MINUS : state == CONTACT_AWAY;
    const double *from = lanes_kind[c] == KIND_SWITCH ? r->slip[c] : r->depth[c];
    const double sign = outside ? -1.0 : 1.0;
    for (int j = 0; j < LANES_Z; j++) {
        row[j] = sign * from[j];
    }
    row[LANES_Z] = c == wall ? 0.0 : sign * shifted(from, m->shift);
}

/* a bound on the rates of a mode: the 16th root of the norm of the 16th power */
static double flow_rate(const Full *f)
{
    double a[MODEL_NX][MODEL_NX], b[MODEL_NX][MODEL_NX];
    double log_scale = 0.0;
    double norm = 0.0;
    for (int i = 0; i < MODEL_NX; i++) {
        memcpy(a[i], f->flow[i], sizeof a[i]);
    }
    for (int round = 0; round <= 4; round++) {
        norm = 0.0;
        for (int i = 0; i < MODEL_NX; i++) {
            for (int j = 0; j < MODEL_NX; j++) {
                norm = fmax(norm, fabs(a[i][j]));
            }
        }
        if (!(norm > 0.0) || !isfinite(norm)) {
            return norm > 0.0 ? norm : 0.0;
        }
        if (round == 4) {
            break;
        }
        for (int i = 0; i < MODEL_NX; i++) {
            for (int j = 0; j < MODEL_NX; j++) {
                double sum = 0.0;
                for (int k = 0; k < MODEL_NX; k++) {
                    sum += a[i][k] / norm * (a[k][j] / norm);
                }
                b[i][j] = sum;
            }
        }
        log_scale = 2.0 * (log_scale + log(norm));
        memcpy(a, b, sizeof a);
    }
    return exp((log_scale + log(MODEL_NX * norm)) / 16.0);
}

/* |row| |A|^n exp(|A| h) over z and 1: what bounds the n-th derivative of a guard over a step; of harmonics and 1, whose
   magnitudes are at most 1, as the sum that is returned */
static double row_bound(const LaneTable *t, const Full *f, const double *row, int n, double h, double *bound)
{
    enum { TERMS = 14 };
    double now[LANES_Z + 1], next[LANES_Z + 1], sum[LANES_Z + 1];
    for (int j = 0; j <= LANES_Z; j++) {
        now[j] = fabs(row[j]);
        sum[j] = 0.0;
    }
    for (int k = 0; k < n + TERMS; k++) {
        const double factor = k < n ? 1.0 : h / (k - n + 1);
        memset(next, 0, sizeof next);
        for (int j = 0; j <= LANES_Z; j++) {
            sum[j] += k < n ? 0.0 : now[j];
        }
        for (int i = 0; i < MODEL_NX; i++) {
            for (int j = 0; j <= LANES_Z; j++) {
                next[j] += now[i] * fabs(f->flow[i][j]);
            }
        }
        for (int m = 0; m < LANES_HARMONICS; m++) {
            next[MODEL_NX + 2 * m] += now[MODEL_NX + 2 * m + 1] * fabs(t->wave[m]);
            next[MODEL_NX + 2 * m + 1] += now[MODEL_NX + 2 * m] * fabs(t->wave[m]);
        }
        for (int j = 0; j <= LANES_Z; j++) {
            now[j] = next[j] * factor;
        }
    }
    double constant = 0.0;
    for (int j = 0; j <= LANES_Z; j++) {
        const double safe = sum[j] * (1.0 + 1e-6);
        if (j < MODEL_NX) {
            bound[j] = safe;
        } else {
            constant += safe;
        }
    }
    return constant;
}

static void mode_make(LaneTable *t, int mode, Full *f)
{
    LaneMode *m = &t->mode[mode];
    LaneRows r;
    double sign[NC] = {0.0};
    mode_states(mode, m->state);
    for (int c = 0; c < MODEL_NC; c++) {
        sign[c] = lanes_kind[c] == KIND_SWITCH ? m->state[c] : 0.0;
    }
    lanes_rows(t->p, t->u, sign, &r);
    const int wall = mode_shift(&r, m);
    full_flow(&r, m, wall, f);
    for (int g = 0; g < LANES_GUARDS; g++) {
        full_guard(&r, m, wall, g, f->guard[g]);
        for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++) {
            m->guard[e] = f->guard[g][lanes_guard_column[e]];
        }
        m->guard_constant[g] = f->guard[g][LANES_Z];
    }
    for (int e = 0; e < LANES_FLOW; e++) {
        m->flow[e] = f->flow[lanes_flow_row[e]][lanes_flow_column[e]];
    }
    for (int i = 0; i < MODEL_NX; i++) {
        m->constant[i] = f->flow[i][LANES_Z];
    }
    m->rate = flow_rate(f);
    for (int k = 0; k < LANES_HARMONICS; k++) {
        m->rate = fmax(m->rate, fabs(t->wave[k]));
    }
    m->longest = fmin(REACH / m->rate, t->period);
    m->home = -1;
    for (int g = 0; g < LANES_GUARDS; g++) {
        m->tail_constant[g] = row_bound(t, f, f->guard[g], 4, m->longest, m->tail[g]) / 24.0;
        for (int i = 0; i < MODEL_NX; i++) {
            m->tail[g][i] /= 24.0;
        }
    }
}

/* rows of exp(A h) of the states, over z and 1 */
static void flow_over(const LaneTable *t, const Full *f, double h, double (*whole)[LANES_Z + 1])
{
    for (int column = 0; column <= LANES_Z; column++) {
        double now[LANES_Z + 1] = {0.0}, next[LANES_Z + 1];
        double sum[MODEL_NX] = {0.0};
        now[column] = 1.0;
        for (int n = 0; n < 15; n++) {
            const double factor = h / (n + 1);
            for (int i = 0; i < MODEL_NX; i++) {
                sum[i] += now[i];
                next[i] = 0.0;
                for (int j = 0; j <= LANES_Z; j++) {
                    next[i] += f->flow[i][j] * now[j];
                }
                next[i] *= factor;
            }
            for (int k = 0; k < LANES_HARMONICS; k++) {
                next[MODEL_NX + 2 * k] = -factor * t->wave[k] * now[MODEL_NX + 2 * k + 1];
                next[MODEL_NX + 2 * k + 1] = factor * t->wave[k] * now[MODEL_NX + 2 * k];
            }
            next[LANES_Z] = 0.0;
            memcpy(now, next, sizeof now);
        }
        for (int i = 0; i < MODEL_NX; i++) {
            whole[i][column] = sum[i];
        }
    }
}

static void stride_make(const LaneTable *t, const Full *f, LaneMode *m)
{
    flow_over(t, f, m->longest, m->stride);
    for (int k = 0; k < LANES_HARMONICS; k++) {
        m->turn[2 * k] = cos(t->wave[k] * m->longest);
        m->turn[2 * k + 1] = sin(t->wave[k] * m->longest);
    }
}

/* exp(A h) and what the harmonics and constants add */
static void home_step(const LaneTable *t, const Full *f, HomeStep *s)
{
    double whole[MODEL_NX][LANES_Z + 1];
    flow_over(t, f, t->h, whole);
    for (int e = 0; e < LANES_STEP; e++) {
        s->step[e] = whole[lanes_step_row[e]][lanes_step_column[e]];
    }
    for (int k = 0; k < t->steps; k++) {
        for (int i = 0; i < MODEL_NX; i++) {
            double sum = whole[i][LANES_Z];
            for (int j = 0; j < 2 * LANES_HARMONICS; j++) {
                sum += whole[i][MODEL_NX + j] * t->phasor[k][j];
            }
            s->forced[k][i] = sum;
        }
    }
}

static void home_powers(const LaneTable *t, HomeStep *s)
{
    memcpy(s->power[0], s->step, sizeof s->step);
    for (int n = 1; n < LANES_POWERS && t->steps >> n; n++) {
        double half[MODEL_NX][MODEL_NX] = {{0.0}};
        for (int e = 0; e < LANES_STEP; e++) {
            half[lanes_step_row[e]][lanes_step_column[e]] = s->power[n - 1][e];
        }
        for (int e = 0; e < LANES_STEP; e++) {
            double sum = 0.0;
            for (int k = 0; k < MODEL_NX; k++) {
                sum += half[lanes_step_row[e]][k] * half[k][lanes_step_column[e]];
            }
            s->power[n][e] = sum;
        }
    }
}

static void home_make(const LaneTable *t, const Full *f, HomeStep *s)
{
    home_step(t, f, s);
    home_powers(t, s);
    for (int c = 0; c < MODEL_NC; c++) {
        double bound[MODEL_NX];
        int g = 0;
        while (lanes_guard_contact[g] != c) {
            g++;
        }
        const double *row = f->guard[g];
        for (int e = lanes_home_first[c]; e < lanes_home_first[c + 1]; e++) {
            s->guard[e] = row[lanes_home_column[e]];
        }
        for (int k = 0; k <= t->steps; k++) {
            double sum = row[LANES_Z];
            for (int j = 0; j < 2 * LANES_HARMONICS; j++) {
                sum += row[MODEL_NX + j] * t->phasor[k][j];
            }
            s->guard_constant[k][c] = sum;
        }
        const double square = 0.125 * t->h * t->h;
        s->bound_constant[c] = square * row_bound(t, f, row, 2, t->h, bound);
        for (int e = lanes_bound_first[c]; e < lanes_bound_first[c + 1]; e++) {
            s->bound[e] = square * bound[lanes_bound_column[e]];
        }
    }
}

/* where the harmonics are at the points of the grid */
static void table_phasors(LaneTable *t, const LaneRows *r)
{
    for (int n = 0; n <= t->steps; n++) {
        const double time = t->origin + t->period * n / t->steps;
        for (int k = 0; k < LANES_HARMONICS; k++) {
            const double angle = r->wave[k] * time + r->phase[k];
            t->phasor[n][2 * k] = cos(angle);
            t->phasor[n][2 * k + 1] = sin(angle);
        }
    }
}

static void table_contacts(LaneTable *t, const LaneRows *r)
{
    for (int c = 0; c < MODEL_NC; c++) {
        memcpy(t->approach[c], r->slip[c], sizeof t->approach[c]);
        memcpy(t->depth[c], r->depth[c], sizeof t->depth[c]);
        t->restitution[c] = r->restitution[c];
        t->entry_release[c][0] = r->release[c][1];
        t->entry_release[c][1] = r->release[c][2];
        for (int i = 0; i < MODEL_NX; i++) {
            t->push[c][i] = lanes_kind[c] == KIND_IMPACT ? r->W[i][c] / r->G[c][c] : 0.0;
        }
    }
}

int table_make(LaneTable *t, const double *p, const double *u, double origin, double period)
{
    static const double no_sign[NC];
    Full full[LANES_MODES];
    LaneRows r;
    double slowest = INFINITY, fastest = 0.0;
    int homes = 0;
    t->usable = 0;
    memcpy(t->p, p, MODEL_NP * sizeof *p);
    memcpy(t->u, u, MODEL_NU * sizeof *u);
    t->origin = origin;
    t->period = period;
    lanes_rows(p, u, no_sign, &r);
    memcpy(t->wave, r.wave, sizeof t->wave);
    table_contacts(t, &r);
    for (int m = 0; m < LANES_MODES; m++) {
        mode_make(t, m, &full[m]);
        int touches = 0;
        for (int c = 0; c < MODEL_NC; c++) {
            touches |= t->mode[m].state[c] == CONTACT_TOUCHING || t->mode[m].state[c] == CONTACT_RELEASED;
        }
        t->mode[m].home = touches ? -1 : homes++;
        slowest = touches ? slowest : fmin(slowest, t->mode[m].rate);
    }
    for (int m = 0; m < LANES_MODES; m++) {
        LaneMode *mode = &t->mode[m];
        mode->home = mode->home >= 0 && mode->rate <= AS_SLOW * slowest ? mode->home : -1;
        fastest = mode->home >= 0 ? fmax(fastest, mode->rate) : fastest;
    }
    for (int m = 0; m < LANES_MODES; m++) {
        signed char free[NC];
        for (int c = 0; c < MODEL_NC; c++) {
            const int state = t->mode[m].state[c];
            free[c] = (signed char)(state == CONTACT_RELEASED ? CONTACT_AWAY : state);
        }
        t->mode[m].on_grid = t->mode[table_mode(free)].home >= 0;
        for (int c = 0; c < MODEL_NC; c++) {
            signed char other[NC];
            memcpy(other, t->mode[m].state, sizeof other);
            other[c] = (signed char)(lanes_kind[c] == KIND_SWITCH ? -other[c] : other[c]);
            t->mode[m].crossed[c] = table_mode(other);
        }
    }
    const double steps = ceil(period * fastest / REACH);
    if (!(period > 0.0) || !(steps <= LANES_GRID)) {
        return 0;
    }
    t->steps = steps > 1.0 ? (int)steps : 1;
    t->h = period / t->steps;
    table_phasors(t, &r);
    for (int m = 0; m < LANES_MODES; m++) {
        if (t->mode[m].home >= 0) {
            home_make(t, &full[m], &t->home[t->mode[m].home]);
        } else if (!t->mode[m].on_grid) {
            stride_make(t, &full[m], &t->mode[m]);
        }
    }
    t->usable = 1;
    return 1;
}
