/*
 * What happens to one lane at an event, as in engine/events:
 *
 *     stop     away -> touching from its depth on; touching -> released where its force falls to zero, or away; released
 *              -> touching where it would push again, or away; the states of all lanes in lane_stops.h
 *     held, rubbing and rigid contacts: lane_transition.c
 *     switch   the other side, where it is crossed fast enough: lane_fall.h
 *
 * All else the engine decides, from the same point: an impact whose rebound may be the last of a chatter or that another
 * contact may take part in, the end of a region, a switch that is met along its surface, several contacts at once, ties.
 */
#include "lane_event.h"

#include "lane_held.h"
#include "lane_modes.h"
#include "lane_transition.h"

/* a stop that has just been entered is at its bound exactly, where the origin of the mode lies there */
static void place_on_bound(const LaneTable *t, const LaneMode *m, double *z, int c)
{
    double size = 0.0, depth = 0.0;
    int on_wall = 0;
    for (int i = 0; i < MODEL_NQ; i++) {
        on_wall |= m->shift[i] != 0.0;
        size += t->depth[c][i] * t->depth[c][i];
        depth += t->depth[c][i] * z[i];
    }
    for (int i = 0; on_wall && i < MODEL_NQ; i++)
        z[i] -= depth / size * t->depth[c][i];
}

/* how many zeros guard g has from now on: of the two margins of stick the nearer one has them, or both without load */
static int64_t zeros(const LaneMode *m, const LaneEvent *e, const double *z, int g)
{
    const int c = lanes_guard_contact[g];
    const int slot = lanes_guard_slot[g];
    const int count = e->known[c][slot == GUARD_NORMAL ? SLOT_NORMAL : SLOT_TANGENTIAL];
    const int normal = lanes_led[c] ? lanes_partner[c] - 1 : -1;
    if (slot != GUARD_NORMAL && (m->state[c] == CONTACT_AWAY || (slot == GUARD_MARGIN && m->state[c] != CONTACT_STICK)))
        return 0; /* it watches nothing */
    const int unloaded = normal >= 0 && e->known[normal][SLOT_NORMAL] > 0;
    if (slot != GUARD_NORMAL && m->state[c] == CONTACT_STICK && !unloaded) {
        const int other = slot == GUARD_TANGENTIAL ? g + 1 : g - 1;
        if (row_value(m->full.guard[g], z) > row_value(m->full.guard[other], z)) return 0;
    }
    return count < LANES_ZERO ? count : LANES_ZERO;
}

/* the engine decides */
static void ask(Pool *pool, int64_t slot, double *z, const signed char *falls, double *time, int64_t *known)
{
    Lane *lane = &pool->lanes[slot];
    LaneTable *t = &pool->tables[slot];
    LaneEvent e = {.time = *time};
    signed char before[NC];
    memcpy(before, lane->motion.state, sizeof before);
    for (int i = 0; i < MODEL_NX; i++)
        lane->motion.x[i] = z[i] + t->mode[lane->mode].shift[i];
    for (int g = 0; g < LANES_GUARDS; g++) {
        e.falls[lanes_guard_contact[g]][lanes_guard_slot[g] == GUARD_NORMAL ? SLOT_NORMAL : SLOT_TANGENTIAL] |=
            falls[g];
    }
    const int mode = pool->resolve(pool->context, slot, &lane->motion, &e) ? table_mode(lane->motion.state) : -1;
    if (mode < 0 || !table_at(t, mode)->usable) {
        lane->failed = 1;
        return;
    }
    const LaneMode *m = &t->mode[mode];
    lane->mode = mode;
    for (int i = 0; i < MODEL_NX; i++)
        z[i] = lane->motion.x[i] - m->shift[i];
    for (int c = 0; c < MODEL_NC; c++)
        if (lanes_compliant[c] && before[c] == CONTACT_AWAY && m->state[c] == CONTACT_TOUCHING)
            place_on_bound(t, m, z, c);
    for (int k = 0; e.time != *time && k < LANES_HARMONICS; k++) {
        const double angle = t->wave[k] * e.time + t->phase[k];
        z[MODEL_NX + 2 * k] = cos(angle);
        z[MODEL_NX + 2 * k + 1] = sin(angle);
    }
    *time = e.time;
    for (int g = 0; g < LANES_GUARDS; g++)
        known[g] = zeros(m, &e, z, g);
}

/* guards that have fallen with g, but for rounding */
static void fallen(const LaneTable *t, const LaneMode *m, const double *z, int g, signed char *falls)
{
    for (int e = 0; e < LANES_GUARDS; e++) {
        const double *row = m->full.guard[e];
        double size;
        falls[e] = (signed char)(e == g
                                 || (fabs(row_value(row, z)) <= LANES_AT_WALL * row_size(row, z)
                                     && guard_rate(t, m, z, e, &size) < 0.0));
    }
}

int lane_event(Pool *pool, int64_t slot, int g, double *time)
{
    Lane *lane = &pool->lanes[slot];
    LaneTable *t = &pool->tables[slot];
    double *z = lane->z;
    int64_t *known = lane->known;
    signed char falls[LANES_NG];
    int alone = 1, decided = 0;
    memset(known, 0, sizeof lane->known);
    lane->struck = -1;
    fallen(t, &t->mode[lane->mode], z, g, falls);
    for (int e = 0; e < LANES_GUARDS; e++)
        alone &= e == g || !falls[e];
    if (alone) decided = lane_transition(t, lane, z, g, *time, known);
    if (!decided) ask(pool, slot, z, falls, time, known);
    return decided;
}

int lane_loses(const LaneMotion *from, const LaneMotion *to)
{
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++)
        any |= !lanes_compliant[c] && (to->began[c] != from->began[c] || lane_holds(from->state, c));
    return any;
}
