/*
 * States of contacts from one instant on, where one contact alone decides them:
 *
 *     slip falls         stick if all forces that hold contacts then are within their bounds; if that of its own is not,
 *                        slip to the side that it yields to
 *     margin falls       slip to that side
 *     normal force falls open
 *     arrives            an impact by Newton and Coulomb: its own two impulses. It bounces; or, where it does not, it stays
 *                        closed if it pushes then
 *
 * What fits by more than a tie is taken, where no other states can fit as well (LaneTable.unique): forces of dry friction
 * and of smooth walls follow from a convex problem, and so do those of one rough wall whose friction cannot jam. Ties,
 * and several rough walls at once, are left to the engine.
 */
#include "lane_transition.h"

#include "lane_held.h"
#include "lane_modes.h"

/* of the terms of a force, or of the rate of a slip: nearer to zero the engine decides */
static const double TIE = 1e-8;
/* of the terms of a slip speed: nearer to zero it may be none; with room for the rounding of both */
static const double AT_REST = 1e-12;
/* another mode, and the states from its origin */
typedef struct {
    const LaneMode *mode;
    double z[LANES_Z];
    signed char state[NC];
} Next;

static int guard_of(int c, int slot)
{
    int g = 0;
    while (lanes_guard_contact[g] != c || lanes_guard_slot[g] != slot)
        g++;
    return g;
}

/* the mode of other states; 0 if there is none */
static int look(LaneTable *t, const Lane *lane, const double *z, Next *next)
{
    const int mode = table_mode(next->state);
    if (mode < 0 || !table_at(t, mode)->usable) return 0;
    next->mode = &t->mode[mode];
    memcpy(next->z, z, sizeof next->z);
    for (int i = 0; i < MODEL_NX; i++)
        next->z[i] = (z[i] + t->mode[lane->mode].shift[i]) - next->mode->shift[i];
    return 1;
}

/* whether guard g is that of a force which holds its contact */
static int is_bound(const LaneMode *m, int g)
{
    const int c = lanes_guard_contact[g];
    if (lanes_guard_slot[g] == GUARD_NORMAL) return lanes_impulsive[c] && m->state[c] == CONTACT_TOUCHING;
    return !lanes_compliant[c] && m->state[c] == CONTACT_STICK;
}

/* whether the forces that hold contacts are within their bounds, and no contact but c is without slip otherwise */
static int fits(const Next *next, int c)
{
    const LaneMode *m = next->mode;
    int rough = 0;
    for (int g = 0; g < LANES_GUARDS; g++) {
        const int e = lanes_guard_contact[g];
        const double *row = m->full.guard[g];
        const int rubs = lanes_guard_slot[g] == GUARD_TANGENTIAL && abs(m->state[e]) == 1 && lanes_sticks[e] && e != c;
        const double least = is_bound(m, g) ? TIE : rubs ? AT_REST : -1.0;
        if (least > 0.0 && !(row_value(row, next->z) > least * row_size(row, next->z))) return 0;
        rough += lanes_guard_slot[g] == GUARD_NORMAL && lanes_partner[e] && m->state[e] == CONTACT_TOUCHING;
    }
    const int rubbing = rough && abs(m->state[(int)lanes_partner[m->held[0]] - 1]) == 1;
    return rough == 0 || m->held_count == (rubbing ? 1 : 2);
}

/* the motion keeps account of a contact that was and is in these states */
static void note(Lane *lane, int c, int after, int struck, double time)
{
    LaneMotion *m = &lane->motion;
    const int rigid = lanes_impulsive[c];
    const int held = lane_holds(m->state, c);
    const int holds = rigid ? after == CONTACT_TOUCHING : after == CONTACT_STICK;
    if (after == m->state[c] && !struck) return;
    if (held && !holds) m->held[c] += time - m->since[c];
    if (holds && !held) m->since[c] = time;
    m->began[c] += rigid ? !held : holds && !held;
}

/* the lane is in a mode with other states of contacts from now on: z from its origin */
static void change_mode(LaneTable *t, Lane *lane, double *z)
{
    const LaneMode *from = &t->mode[lane->mode];
    lane->mode = table_mode(lane->motion.state);
    const LaneMode *to = table_at(t, lane->mode);
    for (int i = 0; i < MODEL_NX; i++)
        z[i] = (z[i] + from->shift[i]) - to->shift[i];
    lane->failed |= !to->usable;
}

/* the lane goes on in these states; struck: a rigid contact that has had an impact, -1: none */
static void take(LaneTable *t, Lane *lane, double *z, const signed char *state, int struck, double time)
{
    for (int c = 0; c < MODEL_NC; c++) {
        note(lane, c, state[c], c == struck, time);
        lane->motion.state[c] = state[c];
    }
    change_mode(t, lane, z);
    held_settle(t, &t->mode[lane->mode], z);
}

/* the side to which a contact yields that would have to stick in the mode; 0: to none, or it is not clear */
static int yields_to(const Next *stuck, int c)
{
    const double *plus = stuck->mode->full.guard[guard_of(c, GUARD_TANGENTIAL)];
    const double *minus = stuck->mode->full.guard[guard_of(c, GUARD_MARGIN)];
    const double upper = row_value(plus, stuck->z);
    const double lower = row_value(minus, stuck->z);
    const double tie = TIE * fmax(row_size(plus, stuck->z), row_size(minus, stuck->z));
    return upper < -tie && lower > tie ? CONTACT_SLIP_MINUS : lower < -tie && upper > tie ? CONTACT_SLIP_PLUS : 0;
}

/* a contact at zero slip sticks, or yields to a side; 0: not clear */
static int stick_or_yield(LaneTable *t, const Lane *lane, const double *z, Next *next, int c, int64_t *known)
{
    next->state[c] = CONTACT_STICK;
    if (!look(t, lane, z, next)) return 0;
    Next settled = *next;
    held_settle(t, settled.mode, settled.z);
    if (fits(&settled, c)) return 1;
    next->state[c] = (signed char)yields_to(&settled, c);
    if (next->state[c] == CONTACT_STICK || !look(t, lane, z, next) || !fits(next, c)) return 0;
    const int g = guard_of(c, GUARD_TANGENTIAL);
    double size;
    const double rate = guard_rate(t, next->mode, next->z, g, &size);
    known[g] = 1;
    return rate > TIE * size;
}

static int slip_falls(LaneTable *t, Lane *lane, double *z, int c, double time, int64_t *known)
{
    Next next;
    memcpy(next.state, lane->motion.state, sizeof next.state);
    if (!stick_or_yield(t, lane, z, &next, c, known) || next.state[c] == lane->motion.state[c]) return 0;
    take(t, lane, z, next.state, -1, time);
    return 1;
}

/* whether guard g falls by more than a tie */
static int falls_clearly(const LaneTable *t, const Lane *lane, const double *z, int g)
{
    double size;
    const double rate = guard_rate(t, &t->mode[lane->mode], z, g, &size);
    return rate < -TIE * size;
}

static int margin_falls(LaneTable *t, Lane *lane, double *z, int g, double time, int64_t *known)
{
    const int c = lanes_guard_contact[g];
    const int slip = guard_of(c, GUARD_TANGENTIAL);
    const int plus = lanes_guard_slot[g] == GUARD_TANGENTIAL;
    const double *other = t->mode[lane->mode].full.guard[plus ? guard_of(c, GUARD_MARGIN) : slip];
    Next next;
    double size;
    memcpy(next.state, lane->motion.state, sizeof next.state);
    next.state[c] = plus ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
    if (!(row_value(other, z) > TIE * row_size(other, z)) || !falls_clearly(t, lane, z, g) || !look(t, lane, z, &next)
        || !fits(&next, c)) {
        return 0;
    }
    const double rate = guard_rate(t, next.mode, next.z, slip, &size);
    if (rate < -TIE * size) return 0;
    /* without a jump of the force the rate of slip is zero too */
    known[slip] = rate > TIE * size ? 1 : 2;
    take(t, lane, z, next.state, -1, time);
    return 1;
}

static int force_falls(LaneTable *t, Lane *lane, double *z, int g, double time, int64_t *known)
{
    const int c = lanes_guard_contact[g];
    const int rub = lanes_partner[c] - 1;
    Next next;
    memcpy(next.state, lane->motion.state, sizeof next.state);
    next.state[c] = CONTACT_AWAY;
    if (rub >= 0 && next.state[rub] == CONTACT_STICK) return 0;
    if (rub >= 0) next.state[rub] = CONTACT_AWAY;
    if (!falls_clearly(t, lane, z, g) || !look(t, lane, z, &next) || !fits(&next, c)) return 0;
    /* gap, speed and acceleration */
    known[g] = 3;
    take(t, lane, z, next.state, -1, time);
    return 1;
}

int lane_is_alone(const LaneTable *t, const Lane *lane, const double *z, int c)
{
    for (int e = 0; e < MODEL_NC; e++) {
        const int state = lane->motion.state[e];
        if (e == c || state == CONTACT_AWAY) {
            const int rigid = e != c && lanes_impulsive[e];
            if (rigid && fabs(row_value(t->depth[e], z)) <= LANES_AT_WALL * row_size(t->depth[e], z)) return 0;
        } else if (lanes_compliant[e] ? lanes_digits[e] == 3 : lanes_impulsive[e]) {
            return 0;
        }
    }
    return 1;
}

void lane_impulses(const LaneTable *t, int c, int friction, double arrival, double slip, double *normal, double *rub)
{
    const int f = lanes_partner[c] - 1;
    const double *G = t->G[c];
    const double wanted = -(1.0 + t->restitution[c]) * arrival;
    if (friction == CONTACT_AWAY) {
        *normal = wanted / G[c];
        *rub = 0.0;
    } else if (friction == CONTACT_STICK) {
        const double determinant = G[c] * t->G[f][f] - G[f] * t->G[f][c];
        *normal = (wanted * t->G[f][f] + slip * G[f]) / determinant;
        *rub = -(slip * G[c] + wanted * t->G[f][c]) / determinant;
    } else {
        *normal = wanted / (G[c] - friction * t->mu[f] * G[f]);
        *rub = -friction * t->mu[f] * *normal;
    }
}

/* impulses of an impact, by Newton and Coulomb, and how its friction ends; AWAY: it has none; 0: not clear */
static int impulses(const LaneTable *t, const double *z, int c, double *normal, double *rub, int *friction)
{
    const int f = lanes_partner[c] - 1;
    const double *G = t->G[c];
    const double arrival = row_value(t->approach[c], z);
    const double slip = f >= 0 ? row_value(t->approach[f], z) : 0.0;
    *friction = f < 0 ? CONTACT_AWAY : CONTACT_STICK;
    if (f < 0 || G[c] * t->G[f][f] - G[f] * t->G[f][c] > TIE * G[c] * t->G[f][f]) {
        lane_impulses(t, c, *friction, arrival, slip, normal, rub);
        const double most = f < 0 ? 0.0 : t->mu[f] * *normal;
        if (f < 0 || (*normal > 0.0 && most - fabs(*rub) > TIE * (most + fabs(*rub)))) return 1;
    }
    for (*friction = 1; *friction >= -1; *friction -= 2) {
        lane_impulses(t, c, *friction, arrival, slip, normal, rub);
        const double change = t->G[f][c] * *normal + t->G[f][f] * *rub;
        if (*friction * (slip + change) > TIE * (fabs(slip) + fabs(change))) return 1;
    }
    return 0;
}

/* sides of the contacts of dry friction after a jump of the velocities; 0 where one may have come to rest by it */
static int new_sides(const LaneTable *t, const double *z, signed char *state)
{
    for (int e = 0; e < MODEL_NC; e++) {
        if (lanes_rubs[e] && state[e] != CONTACT_AWAY) {
            const double slip = row_value(t->approach[e], z);
            const int rests = fabs(slip) <= AT_REST * row_size(t->approach[e], z);
            if (rests && state[e] != CONTACT_STICK) return 0;
            state[e] = (signed char)(rests ? CONTACT_STICK : slip > 0.0 ? CONTACT_SLIP_PLUS : CONTACT_SLIP_MINUS);
        }
    }
    return 1;
}

/* states of a contact after an impact from which it does not bounce; 0: not clear */
static int rest(LaneTable *t, const Lane *lane, const double *z, int c, int friction, Next *next, int64_t *known)
{
    const int f = lanes_partner[c] - 1;
    const int g = guard_of(c, GUARD_NORMAL);
    next->state[c] = CONTACT_TOUCHING;
    known[g] = 0;
    if (f >= 0 && friction == CONTACT_STICK) return stick_or_yield(t, lane, z, next, f, known);
    if (f >= 0) next->state[f] = (signed char)friction;
    if (!look(t, lane, z, next)) return 0;
    if (fits(next, -1)) return 1;
    const double *force = next->mode->full.guard[g];
    if (!(row_value(force, next->z) < -TIE * row_size(force, next->z))) return 0;
    /* it would have to pull: it leaves without speed */
    next->state[c] = CONTACT_AWAY;
    if (f >= 0) next->state[f] = CONTACT_AWAY;
    known[g] = 2;
    return look(t, lane, z, next) && fits(next, -1);
}

static int arrives(LaneTable *t, Lane *lane, double *z, int c, double time, int64_t *known)
{
    double normal, rub, after[LANES_Z];
    int friction;
    Next next;
    const int f = lanes_partner[c] - 1;
    const double y = row_value(t->approach[c], z);
    const double depth = row_value(t->depth[c], z);
    const double fastest = fmax(lane->motion.memory[c], -y);
    const double leaves = -t->restitution[c] * y;
    if (lanes_poisson[c] || !(y < 0.0) || (leaves > 0.0 && !(leaves > 2.0 * LANES_CHATTER * fastest))
        || !lane_is_alone(t, lane, z, c) || !impulses(t, z, c, &normal, &rub, &friction)) {
        return 0;
    }
    memcpy(next.state, lane->motion.state, sizeof next.state);
    memcpy(after, z, sizeof after);
    for (int i = 0; i < MODEL_NQ; i++)
        after[i] += depth * t->push[c][MODEL_NQ + i];
    for (int i = MODEL_NQ; i < MODEL_NX; i++)
        after[i] += t->W[i][c] * normal + (f >= 0 ? t->W[i][f] * rub : 0.0);
    known[guard_of(c, GUARD_NORMAL)] = 1;
    if (!new_sides(t, after, next.state)) return 0;
    if (leaves > 0.0 ? !look(t, lane, after, &next) || !fits(&next, -1)
                     : !rest(t, lane, after, c, friction, &next, known)) {
        return 0;
    }
    lane->motion.memory[c] = fastest;
    lane->struck = c;
    lane->friction = friction;
    memcpy(z, after, sizeof after);
    take(t, lane, z, next.state, c, time);
    return 1;
}

int lane_transition(LaneTable *t, Lane *lane, double *z, int g, double time, int64_t *known)
{
    const int c = lanes_guard_contact[g];
    const int state = lane->motion.state[c];
    int done = 0;
    if (!t->unique[c] || lanes_compliant[c]) return 0;
    if (lanes_guard_slot[g] == GUARD_NORMAL) {
        /* regions of friction are the engine's */
        done = !lanes_impulsive[c]     ? 0
               : state == CONTACT_AWAY ? arrives(t, lane, z, c, time, known)
                                       : force_falls(t, lane, z, g, time, known);
    } else if (lanes_sticks[c] && state == CONTACT_STICK) {
        done = margin_falls(t, lane, z, g, time, known);
    } else if (lanes_sticks[c]) {
        done = slip_falls(t, lane, z, c, time, known);
    }
    if (!done) memset(known, 0, sizeof lane->known);
    return done;
}
