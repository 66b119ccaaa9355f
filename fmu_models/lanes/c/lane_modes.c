/*
 * The modes of the contacts of one motion: their fields and guards. A mode is a number whose digits are the states of the
 * contacts, in their order; that of a rigid contact with friction says the state of both.
 */
#include "lane_modes.h"

#include "lane_held.h"

static const signed char stop_states[] = {CONTACT_AWAY, CONTACT_TOUCHING, CONTACT_RELEASED};
/* slipping ones first: they are at home */
static const signed char slip_states[] = {CONTACT_SLIP_PLUS, CONTACT_SLIP_MINUS, CONTACT_STICK};

/* the state of contact c for a digit; of a rigid contact also that of its friction */
static signed char state_of(int c, int digit, signed char *friction)
{
    const int sides = 2 + lanes_sticks[c];
    *friction = CONTACT_AWAY;
    if (lanes_compliant[c]) return stop_states[digit];
    if (lanes_impulsive[c]) {
        if (digit > 0) *friction = slip_states[digit - 1];
        return digit == 0 ? CONTACT_AWAY : CONTACT_TOUCHING;
    }
    /* away where it has a region, which is at home too */
    const int away = lanes_bounded[c];
    if (away && digit == 2) return CONTACT_AWAY;
    return slip_states[away && digit == sides ? 2 : digit];
}

static int partner_of(int c) { return lanes_partner[c] - 1; }

int table_mode(const signed char *state)
{
    int mode = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        int digit = 0;
        signed char friction;
        if (lanes_led[c]) continue;
        while (digit < lanes_digits[c]
               && (state_of(c, digit, &friction) != state[c]
                   || (partner_of(c) >= 0 && friction != state[partner_of(c)]))) {
            digit++;
        }
        if (digit == lanes_digits[c]) return -1;
        mode = mode * lanes_digits[c] + digit;
    }
    return mode;
}

static void mode_states(int mode, signed char *state)
{
    for (int c = MODEL_NC - 1; c >= 0; c--) {
        signed char friction;
        if (lanes_led[c]) continue;
        state[c] = state_of(c, mode % lanes_digits[c], &friction);
        if (partner_of(c) >= 0) state[partner_of(c)] = friction;
        mode /= lanes_digits[c];
    }
}

int mode_is_away(int mode)
{
    signed char state[NC];
    mode_states(mode, state);
    for (int c = 0; c < MODEL_NC; c++)
        if (lanes_compliant[c] ? state[c] != CONTACT_AWAY : lane_holds(state, c)) return 0;
    return 1;
}

static int is_moved(const double *row)
{
    for (int j = MODEL_NX; j < LANES_Z; j++)
        if (row[j] != 0.0) return 1;
    return 0;
}

/* the place of the wall of the first stop that touches, if it rests and is reached along coordinates; that stop, or
   -1 */
static int mode_shift(const LaneRows *r, LaneMode *m)
{
    memset(m->shift, 0, sizeof m->shift);
    for (int c = 0; c < MODEL_NC; c++) {
        double size = 0.0;
        if (!lanes_compliant[c] || m->state[c] != CONTACT_TOUCHING || is_moved(r->depth[c])) continue;
        for (int i = 0; i < MODEL_NQ; i++)
            size += r->depth[c][i] * r->depth[c][i];
        if (!(size > 0.0)) continue;
        for (int i = 0; i < MODEL_NQ; i++)
            m->shift[i] = -r->depth[c][LANES_Z] / size * r->depth[c][i];
        return c;
    }
    return -1;
}

/* the constant of a row once the origin is moved; that of the stop on whose wall it lies is zero */
static double shifted(const double *row, const double *shift)
{
    double sum = row[LANES_Z];
    for (int j = 0; j < MODEL_NX; j++)
        sum += row[j] * shift[j];
    return sum;
}

static void full_flow(const LaneRows *r, const LaneMode *m, int wall, Full *f)
{
    for (int i = 0; i < MODEL_NX; i++) {
        memcpy(f->flow[i], r->flow[i], sizeof f->flow[i]);
        f->flow[i][LANES_Z] = shifted(r->flow[i], m->shift);
        for (int c = 0; c < MODEL_NC; c++) {
            const int dry = lanes_surface[c] || lanes_rubs[c];
            if (r->W[i][c] != 0.0 && dry && abs(m->state[c]) == 1) {
                for (int j = 0; j < LANES_Z; j++)
                    f->flow[i][j] += r->W[i][c] * r->friction[c][j];
                f->flow[i][LANES_Z] += r->W[i][c] * shifted(r->friction[c], m->shift);
            }
            if (!lanes_compliant[c] || m->state[c] != CONTACT_TOUCHING || r->W[i][c] == 0.0) continue;
            for (int j = 0; j < LANES_Z; j++)
                f->flow[i][j] += r->W[i][c] * (r->force[c][0] * r->depth[c][j] + r->force[c][1] * r->slip[c][j]);
            const double depth = c == wall ? 0.0 : shifted(r->depth[c], m->shift);
            f->flow[i][LANES_Z] +=
                r->W[i][c] * (r->force[c][0] * depth + r->force[c][1] * shifted(r->slip[c], m->shift) + r->force[c][2]);
        }
    }
}

/* a guard that is a row, or its opposite */
static void plain_guard(const double *from, double sign, const LaneMode *m, double *row)
{
    for (int j = 0; j < LANES_Z; j++)
        row[j] = sign * from[j];
    row[LANES_Z] = sign * shifted(from, m->shift);
}

static void release_guard(const LaneRows *r, const LaneMode *m, int wall, int c, double *row)
{
    const double sign = m->state[c] == CONTACT_TOUCHING ? 1.0 : -1.0;
    for (int j = 0; j < LANES_Z; j++)
        row[j] = sign * (r->release[c][0] * r->depth[c][j] + r->release[c][1] * r->slip[c][j]);
    const double depth = c == wall ? 0.0 : shifted(r->depth[c], m->shift);
    row[LANES_Z] = sign
                   * (r->release[c][0] * depth + r->release[c][1] * shifted(r->slip[c], m->shift) + r->release[c][2]);
}

static void full_guard(const LaneRows *r, const LaneMode *m, const Held *held, int wall, int g, double *row)
{
    const int c = lanes_guard_contact[g];
    const int slot = lanes_guard_slot[g];
    const int state = m->state[c];
    memset(row, 0, (LANES_Z + 1) * sizeof *row);
    if (slot == GUARD_NORMAL && lane_holds(m->state, c) && lanes_impulsive[c]) {
        memcpy(row, held->force[c], (LANES_Z + 1) * sizeof *row);
    } else if (slot == GUARD_NORMAL) {
        plain_guard(r->depth[c], state == CONTACT_AWAY ? -1.0 : 1.0, m, row);
        row[LANES_Z] = c == wall ? 0.0 : row[LANES_Z];
    } else if (state == CONTACT_AWAY || (slot == GUARD_MARGIN && state != CONTACT_STICK)) {
        row[LANES_Z] = 1.0;
    } else if (lanes_compliant[c]) {
        release_guard(r, m, wall, c, row);
    } else if (state == CONTACT_STICK) {
        held_margin(r, m, held, c, slot == GUARD_TANGENTIAL ? 1 : -1, row);
    } else {
        plain_guard(r->slip[c], state == CONTACT_SLIP_MINUS ? -1.0 : 1.0, m, row);
    }
}

/* a bound on the rates of a mode: the 16th root of the norm of the 16th power */
static double flow_rate(const Full *f)
{
    double a[MODEL_NX][MODEL_NX], b[MODEL_NX][MODEL_NX];
    double log_scale = 0.0, norm = 0.0;
    for (int i = 0; i < MODEL_NX; i++)
        memcpy(a[i], f->flow[i], sizeof a[i]);
    for (int round = 0; round <= 4; round++) {
        norm = 0.0;
        for (int i = 0; i < MODEL_NX; i++)
            for (int j = 0; j < MODEL_NX; j++)
                norm = fmax(norm, fabs(a[i][j]));
        if (!(norm > 0.0) || !isfinite(norm)) return norm > 0.0 ? norm : 0.0;
        if (round == 4) break;
        for (int i = 0; i < MODEL_NX; i++) {
            for (int j = 0; j < MODEL_NX; j++) {
                double sum = 0.0;
                for (int k = 0; k < MODEL_NX; k++)
                    sum += a[i][k] / norm * (a[k][j] / norm);
                b[i][j] = sum;
            }
        }
        log_scale = 2.0 * (log_scale + log(norm));
        memcpy(a, b, sizeof a);
    }
    return exp((log_scale + log(MODEL_NX * norm)) / 16.0);
}

/* whether a row is a constant */
static int is_constant(const double *row)
{
    for (int j = 0; j < LANES_Z; j++)
        if (row[j] != 0.0) return 0;
    return 1;
}

double row_bound(const LaneTable *t, const Full *f, const double *row, int n, double h, double *bound)
{
    enum { TERMS = 14 };
    if (is_constant(row)) {
        memset(bound, 0, MODEL_NX * sizeof *bound);
        return 0.0;
    }
    double now[LANES_Z + 1], next[LANES_Z + 1], sum[LANES_Z + 1];
    for (int j = 0; j <= LANES_Z; j++) {
        now[j] = fabs(row[j]);
        sum[j] = 0.0;
    }
    for (int k = 0; k < n + TERMS; k++) {
        const double factor = k < n ? 1.0 : h / (k - n + 1);
        memset(next, 0, sizeof next);
        for (int j = 0; j <= LANES_Z; j++)
            sum[j] += k < n ? 0.0 : now[j];
        for (int i = 0; i < MODEL_NX; i++)
            next[i < MODEL_NQ ? MODEL_NQ + i : LANES_Z] += now[i] * (i < MODEL_NQ ? 1.0 : fabs(f->flow[i][LANES_Z]));
        for (int e = 0; e < LANES_FLOW; e++) {
            const int i = lanes_flow_row[e];
            const int j = lanes_flow_column[e];
            next[j] += now[i] * fabs(f->flow[i][j]);
        }
        for (int m = 0; m < LANES_HARMONICS; m++) {
            next[MODEL_NX + 2 * m] += now[MODEL_NX + 2 * m + 1] * fabs(t->wave[m]);
            next[MODEL_NX + 2 * m + 1] += now[MODEL_NX + 2 * m] * fabs(t->wave[m]);
        }
        for (int j = 0; j <= LANES_Z; j++)
            now[j] = next[j] * factor;
    }
    double constant = 0.0;
    for (int j = 0; j <= LANES_Z; j++) {
        const double safe = sum[j] * (1.0 + 1e-6);
        if (j < MODEL_NX)
            bound[j] = safe;
        else
            constant += safe;
    }
    return constant;
}

void flow_over(const LaneTable *t, const Full *f, double h, double (*whole)[LANES_Z + 1])
{
    enum { TERMS = 15 };
    for (int row = 0; row < MODEL_NX; row++) {
        double now[LANES_Z + 1] = {0.0};
        now[row] = 1.0;
        memcpy(whole[row], now, sizeof now);
        for (int n = 1; n <= TERMS; n++) {
            const double factor = h / n;
            double next[LANES_Z + 1] = {0.0};
            for (int i = 0; i < MODEL_NX; i++)
                next[i < MODEL_NQ ? MODEL_NQ + i : LANES_Z] += now[i] * (i < MODEL_NQ ? 1.0 : f->flow[i][LANES_Z]);
            for (int e = 0; e < LANES_FLOW; e++) {
                const int i = lanes_flow_row[e];
                const int j = lanes_flow_column[e];
                next[j] += now[i] * f->flow[i][j];
            }
            for (int k = 0; k < LANES_HARMONICS; k++) {
                next[MODEL_NX + 2 * k] += now[MODEL_NX + 2 * k + 1] * t->wave[k];
                next[MODEL_NX + 2 * k + 1] -= now[MODEL_NX + 2 * k] * t->wave[k];
            }
            for (int j = 0; j <= LANES_Z; j++) {
                now[j] = factor * next[j];
                whole[row][j] += now[j];
            }
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

/* whether an impact of a smooth wall changes nothing but velocities: no force holds a contact, none rubs, no stop may let
   go */
static int is_plain(const LaneMode *m)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int lets_go = lanes_compliant[c] && lanes_digits[c] == 3;
        if (m->state[c] != CONTACT_AWAY && (lets_go || lanes_rubs[c])) return 0;
    }
    return m->held_count == 0;
}

/* whether the flow of a mode is that of a home mode, with stops that have let go left out */
static int is_on_grid(const LaneTable *t, const LaneMode *m)
{
    signed char free[NC];
    for (int c = 0; c < MODEL_NC; c++)
        free[c] = (signed char)(m->state[c] == CONTACT_RELEASED ? CONTACT_AWAY : m->state[c]);
    const int mode = table_mode(free);
    return t->made[mode] && t->mode[mode].home >= 0;
}

void mode_make(LaneTable *t, int mode)
{
    LaneMode *m = &t->mode[mode];
    Full *f = &m->full;
    LaneRows r;
    Held held;
    double sign[NC] = {0.0};
    mode_states(mode, m->state);
    for (int c = 0; c < MODEL_NC; c++)
        sign[c] = abs(m->state[c]) == 1 ? m->state[c] : 0.0;
    lanes_rows(t->p, t->u, sign, &r);
    const int wall = mode_shift(&r, m);
    m->walled = 0;
    for (int i = 0; i < MODEL_NQ; i++)
        m->walled |= m->shift[i] != 0.0;
    full_flow(&r, m, wall, f);
    m->usable = held_make(&r, t->wave, m, f, &held);
    for (int g = 0; g < LANES_GUARDS; g++) {
        full_guard(&r, m, &held, wall, g, f->guard[g]);
        for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++)
            m->guard[e] = f->guard[g][lanes_guard_column[e]];
        m->guard_constant[g] = f->guard[g][LANES_Z];
    }
    for (int e = 0; e < LANES_FLOW; e++)
        m->flow[e] = f->flow[lanes_flow_row[e]][lanes_flow_column[e]];
    for (int i = 0; i < MODEL_NX; i++)
        m->constant[i] = f->flow[i][LANES_Z];
    m->rate = flow_rate(f);
    for (int k = 0; k < LANES_HARMONICS; k++)
        m->rate = fmax(m->rate, fabs(t->wave[k]));
    m->longest = fmin(LANES_REACH / m->rate, t->period);
    m->home = -1;
    m->plain = is_plain(m);
    for (int c = 0; c < MODEL_NC; c++) {
        signed char other[NC], friction;
        memcpy(other, m->state, sizeof other);
        for (int digit = 0; digit < 3 && digit < lanes_digits[c]; digit++) {
            other[c] = state_of(c, digit, &friction);
            m->with[c][digit] = table_mode(other);
        }
    }
    m->on_grid = is_on_grid(t, m);
    if (!m->on_grid) stride_make(t, f, m);
    for (int g = 0; g < LANES_GUARDS; g++) {
        m->tail_constant[g] = row_bound(t, f, f->guard[g], 4, m->longest, m->tail[g]) / 24.0;
        for (int i = 0; i < MODEL_NX; i++)
            m->tail[g][i] /= 24.0;
    }
    t->made[mode] = 1;
}
