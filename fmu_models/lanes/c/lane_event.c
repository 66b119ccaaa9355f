/*
 * What happens to one lane at an event, as in engine/events:
 *
 *     stop     away -> touching from its depth on; touching -> released where its force falls to zero, or away; released
 *              -> touching where it would push again, or away
 *     impact   y -> -e y by an impulse; onto the wall, from which it leaves at once
 *     switch   the other side
 *
 * Left to the series of the engine: an impact whose rebound may be the last of a chatter, or that another contact may
 * take part in; a switch that is met along its surface.
 */
#include "lane_event.h"

static double row_value(const double *row, const double *z)
{
    double sum = row[LANES_Z];
    for (int j = 0; j < LANES_Z; j++) {
        sum += row[j] * z[j];
    }
    return sum;
}

static double row_size(const double *row, const double *z)
{
    double sum = fabs(row[LANES_Z]);
    for (int j = 0; j < LANES_Z; j++) {
        sum += fabs(row[j] * z[j]);
    }
    return sum;
}

/* whether another rigid contact is at its wall as well */
static int is_shared(const LaneTable *t, const Lane *lane, const double *z, int c)
{
    for (int e = 0; e < MODEL_NC; e++) {
        if (e != c && lanes_kind[e] == KIND_IMPACT && lane->motion.state[e] == CONTACT_AWAY
            && fabs(row_value(t->depth[e], z)) <= LANES_AT_WALL * row_size(t->depth[e], z)) {
            return 1;
        }
    }
    return 0;
}

static void impact(const LaneTable *t, Lane *lane, double *z, int c)
{
    const double y = row_value(t->approach[c], z);
    const double depth = row_value(t->depth[c], z);
    const double e = t->restitution[c];
    double *fastest = &lane->motion.memory[c];
    *fastest = fmax(*fastest, -y);
    if (!(y < 0.0) || !(-e * y > 2.0 * LANES_CHATTER * *fastest) || is_shared(t, lane, z, c)) {
        lane->failed = 1;
        return;
    }
    for (int i = 0; i < MODEL_NQ; i++) {
        z[i] += depth * t->push[c][MODEL_NQ + i];
    }
    for (int i = MODEL_NQ; i < MODEL_NX; i++) {
        z[i] -= (1.0 + e) * y * t->push[c][i];
    }
    lane->motion.began[c]++;
}

/* from the origin of one mode to that of another */
static void change_mode(const LaneTable *t, Lane *lane, double *z, int c)
{
    const LaneMode *from = &t->mode[lane->mode];
    const int mode = table_mode(lane->motion.state);
    const LaneMode *to = &t->mode[mode];
    for (int i = 0; i < MODEL_NX; i++) {
        z[i] = (z[i] + from->shift[i]) - to->shift[i];
    }
    lane->mode = mode;
    if (lane->motion.state[c] != CONTACT_TOUCHING) {
        return;
    }
    /* it is at the bound exactly */
    double size = 0.0;
    double depth = 0.0;
    int on_wall = 0;
    for (int i = 0; i < MODEL_NQ; i++) {
        on_wall |= to->shift[i] != 0.0;
        size += t->depth[c][i] * t->depth[c][i];
        depth += t->depth[c][i] * z[i];
    }
    for (int i = 0; on_wall && i < MODEL_NQ; i++) {
        z[i] -= depth / size * t->depth[c][i];
    }
}

static void stop(const LaneTable *t, Lane *lane, double *z, int g, double time)
{
    const int c = lanes_guard_contact[g];
    LaneMotion *m = &lane->motion;
    int64_t *known = lane->known;
    const int before = m->state[c];
    double plain[LANES_Z];
    memcpy(plain, z, sizeof plain);
    for (int i = 0; i < MODEL_NX; i++) {
        plain[i] += t->mode[lane->mode].shift[i];
    }
    const double rate = row_value(t->approach[c], plain);
    if (lanes_guard_slot[g] == 1) {
        const int inside = row_value(t->depth[c], plain) > 0.0;
        m->state[c] = before == CONTACT_RELEASED ? CONTACT_TOUCHING : inside ? CONTACT_RELEASED : CONTACT_AWAY;
        known[m->state[c] == CONTACT_AWAY ? g - 1 : g] = 1;
    } else {
        m->state[c] = before == CONTACT_AWAY ? CONTACT_TOUCHING : CONTACT_AWAY;
        known[g] = 1;
        if (before == CONTACT_AWAY) {
            m->memory[c] = fabs(rate);
            if (g + 1 < LANES_GUARDS && lanes_guard_contact[g + 1] == c) {
                known[g + 1] = t->entry_release[c][0] * rate + t->entry_release[c][1] == 0.0;
            }
        }
    }
    if (before == CONTACT_TOUCHING) {
        m->held[c] += t->origin + time - m->since[c];
    }
    if (m->state[c] == CONTACT_TOUCHING) {
        m->since[c] = t->origin + time;
        m->began[c]++;
    }
    const int entered = before == CONTACT_AWAY;
    change_mode(t, lane, z, entered ? c : 0);
}

void lane_event(const LaneTable *t, Lane *lane, double *z, int g, double time)
{
    const int c = lanes_guard_contact[g];
    int64_t *known = lane->known;
    memset(known, 0, sizeof lane->known);
    if (lanes_kind[c] == KIND_STOP) {
        stop(t, lane, z, g, time);
        return;
    }
    known[g] = 1;
    if (lanes_kind[c] == KIND_IMPACT) {
        impact(t, lane, z, c);
        return;
    }
    double rate = 0.0;
    double size = 0.0;
    const LaneMode *m = &t->mode[lane->mode];
    for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++) {
        /* the rate of the guard along the flow, a row at a time */
        const int j = lanes_guard_column[e];
        double flow = 0.0;
        if (j < MODEL_NX) {
            flow = m->constant[j] + (j < MODEL_NQ ? z[MODEL_NQ + j] : 0.0);
            for (int n = 0; n < LANES_FLOW; n++) {
                flow += lanes_flow_row[n] == j ? m->flow[n] * z[lanes_flow_column[n]] : 0.0;
                size += lanes_flow_row[n] == j ? fabs(m->guard[e] * m->flow[n] * z[lanes_flow_column[n]]) : 0.0;
            }
            size += fabs(m->guard[e] * m->constant[j]);
        } else {
            const int k = (j - MODEL_NX) / 2;
            flow = (j - MODEL_NX) % 2 ? t->wave[k] * z[j - 1] : -t->wave[k] * z[j + 1];
        }
        rate += m->guard[e] * flow;
    }
    if (!(-rate > LANES_ALONG * size)) {
        lane->failed = 1;
        return;
    }
    lane->motion.state[c] = lane->motion.state[c] == CONTACT_SLIP_PLUS ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
    change_mode(t, lane, z, c);
}

int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    if (!motion->wanted || !t->usable) {
        return 0;
    }
    const int mode = table_mode(motion->state);
    if (mode < 0) {
        return 0;
    }
    lane->motion = *motion;
    lane->mode = mode;
    lane->failed = 0;
    for (int i = 0; i < MODEL_NX; i++) {
        lane->z[i] = motion->x[i] - t->mode[mode].shift[i];
    }
    return 1;
}

void lane_end(Pool *pool, int64_t slot, LaneMotion *motion, int done)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    if (!done) {
        motion->decided = 0;
        return;
    }
    *motion = lane->motion;
    for (int i = 0; i < MODEL_NX; i++) {
        motion->x[i] = lane->z[i] + t->mode[lane->mode].shift[i];
    }
    for (int c = 0; c < MODEL_NC; c++) {
        motion->since[c] -= t->period;
    }
    motion->decided = 1;
}
