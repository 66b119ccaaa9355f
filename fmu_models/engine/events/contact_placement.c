/*
 * Where contacts are: states from depths, gaps and slip speeds at one instant, and coordinates from states.
 *
 *     all:      friction and stops; marks contacts at zero slip, which are candidates (mode_selection.c), and bodies
 *               that rest at the end of a region
 *     rigid:    a rigid contact from its gap: open, resting at its wall, running into it, or an error below it
 *     others:   friction with a force of its own, and stops, after the velocities have jumped
 */
#include "contact_placement.h"

#include "../step/contact_forces.h"
#include "../step/taylor.h"
#include "gap_tolerance.h"

int placement_at_zero_slip(const Run *r, int c)
{
    return fabs(r->scratch.slip[c][0]) <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, &r->scratch, c);
}

void placement_note_slips(Run *r)
{
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++)
        r->noted_slip[c] = r->scratch.slip[c][0];
}

/* whether a contact goes on at zero slip, or comes to it */
static int stays_at_zero_slip(const Run *r, int c)
{
    const double made = r->scratch.slip[c][0] - r->noted_slip[c];
    const double terms = model_slip_magnitude(r->at.p, r->at.d, &r->scratch, c);
    const int sticks = !r->starting && r->at.state[c] == CONTACT_STICK;
    return placement_at_zero_slip(r, c) || (sticks && fabs(made) <= r->tolerances.slip * terms);
}

int placement_has_lever(const Run *r, int c)
{
    return model_lever(r->at.p, r->at.d, &r->scratch, c) > r->tolerances.slip;
}

int placement_at_rest_by_others(const Run *r, int c)
{
    enum { ROUNDINGS = 4 };
    const Jets *j = &r->scratch;
    const double own = j->G[c][c][0];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        const double other = j->G[e][e][0];
        const double both = j->G[c][e][0];
        if (e != c && contact_is_held(r->at.state, e)
            && fabs(both * j->G[e][c][0] - own * other) <= r->tolerances.margin * own * other
            && fabs(other * j->slip[c][0]) <= ROUNDINGS * fabs(both * j->slip[e][0])) {
            return 1;
        }
    }
    return 0;
}

void placement_load(Run *r)
{
    taylor_load(r, &r->scratch);
    model_slip(r->at.p, r->at.d, &r->scratch, 0);
    if (MODEL_BOUNDED) model_depth(r->at.p, r->at.d, &r->scratch, 0);
}

void placement_load_inertia(Run *r)
{
    if (!MODEL_CONSTANT_INERTIA) model_inertia(r->at.p, r->at.d, &r->scratch, 0);
}

signed char placement_slipping(const Run *r, int c)
{
    return r->scratch.slip[c][0] < 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
}

signed char placement_leaving(Run *r, int c)
{
    enum { ORDER = 8 };
    Jets *j = &r->scratch;
    taylor_series(r, j, ORDER, INFINITY);
    const double way = j->slip[c][1] * taylor_time_scale(r, j, ORDER);
    if (fabs(way) <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, j, c)) return CONTACT_STICK;
    r->at.known[c][SLOT_TANGENTIAL] = 1;
    return way > 0.0 ? CONTACT_SLIP_PLUS : CONTACT_SLIP_MINUS;
}

/* the state of a stop that is inside: released where its force would pull */
static signed char inside_state(Run *r, int c)
{
    if (model_contact_releases[c]) {
        model_release(r->at.p, r->at.d, &r->scratch, 0, c);
        return r->scratch.release[c][0] > 0.0 ? CONTACT_TOUCHING : CONTACT_RELEASED;
    }
    return CONTACT_TOUCHING;
}

void placement_enter(Run *r, int c)
{
    r->at.state[c] = CONTACT_TOUCHING;
    r->at.memory[c] = fabs(r->scratch.slip[c][0]);
    r->entered[c] = 1;
    if (model_contact_releases[c]) {
        /* at the bound exactly: a stop without damping has no force yet */
        r->scratch.depth[c][0] = 0.0;
        r->scratch.memory[c] = r->at.memory[c];
        model_release(r->at.p, r->at.d, &r->scratch, 0, c);
        r->at.known[c][SLOT_TANGENTIAL] = r->scratch.release[c][0] == 0.0;
    }
}

/* rate of the depth of a region, which is not the rate that y stands for */
static double depth_rate(Run *r, int c)
{
    Jets *j = &r->scratch;
    taylor_field(r, j, 0);
    for (int i = 0; i < MODEL_NQ; i++)
        j->x[i][1] = j->x[MODEL_NQ + i][0];
    for (int i = 0; i < MODEL_NV; i++)
        j->x[MODEL_NQ + i][1] = contact_rate(j, i, 0);
    model_depth(r->at.p, r->at.d, j, 1);
    return j->depth[c][1];
}

int placement_at_wall(Run *r, int c)
{
    const double depth = r->scratch.depth[c][0];
    const double terms = model_depth_magnitude(r->at.p, r->at.d, &r->scratch, c);
    /* terms that are zero all the time, as those of a body at rest where its wall is, have no rounding of their own */
    const double least = DBL_EPSILON * r->nominal_gap[c];
    const double rounding = r->tolerances.slip * fmax(fmax(terms, r->largest_gap[c]), least);
    if (r->starting) return fabs(depth) <= rounding || (depth > 0.0 && depth <= gap_rounding(r, c));
    const double located = r->tolerances.drift > 0.0 ? gap_shift(r, &r->scratch, c) : 0.0;
    return fabs(depth) <= fmax(rounding, located);
}

void placement_friction(Run *r, int normal, signed char *candidate)
{
    const int c = model_contact_partner[normal];
    if (c >= 0) {
        candidate[c] = (signed char)stays_at_zero_slip(r, c);
        r->at.state[c] = !candidate[c] || r->at.state[c] == CONTACT_AWAY ? placement_slipping(r, c) : r->at.state[c];
    }
}

void placement_open(Run *r, int c)
{
    r->at.state[c] = CONTACT_AWAY;
    if (model_contact_partner[c] >= 0) r->at.state[(int)model_contact_partner[c]] = CONTACT_AWAY;
}

int placement_touches(Run *r, int c)
{
    enum { DIGITS = 16 };
    const double LEAST_PART = 1e-6; /* of the energy; what takes less may as well be an impact */
    const double speed = r->scratch.slip[c][0];
    placement_load_inertia(r);
    if (speed * speed <= 2.0 * LEAST_PART * model_kinetic_energy(&r->at) * r->scratch.G[c][c][0]) return 0;
    Jets *j = &r->scratch;
    taylor_series(r, j, MODEL_NZ > 0 ? 2 : 1, INFINITY); /* of speeds one order less is enough */
    for (int i = 0; i < MODEL_NQ; i++)
        j->x[i][2] = 0.5 * j->x[MODEL_NQ + i][1];
    model_depth(r->at.p, r->at.d, j, 2);
    const double bend = -2.0 * j->depth[c][2];
    const double rounding = DIGITS * DBL_EPSILON * model_depth_magnitude(r->at.p, r->at.d, &r->scratch, c);
    if (!(speed * speed <= 2.0 * bend * rounding)) return 0;
    r->at.known[c][SLOT_NORMAL] = 2;
    return 1;
}

int placement_rigid(Run *r, int c, signed char *candidate)
{
    const double depth = r->scratch.depth[c][0];
    const int starts = r->starting;
    const int held = contact_is_held(r->at.state, c);
    candidate[c] = 0;
    if (!placement_at_wall(r, c) && (starts || fabs(depth) > gap_resolution(r, &r->scratch, c))) {
        if (depth > 0.0) {
            return run_fail(r, "the wall of the rigid contact '%s' is penetrated by %.6g at t = %.17g: %s",
                            model_contact_names[c], depth, r->at.time,
                            starts ? "start with a gap of zero or more" : "an input moved it through the body");
        }
        placement_open(r, c);
        return 0;
    }
    if (!held && !placement_at_wall(r, c) && depth < 0.0) return 0;
    r->at.known[c][SLOT_NORMAL] = 1;
    if (!held && !placement_at_zero_slip(r, c)) {
        placement_open(r, c);
        return r->scratch.slip[c][0] < 0.0 && !placement_touches(r, c);
    }
    r->at.state[c] = held ? r->at.state[c] : CONTACT_TOUCHING;
    candidate[c] = 1;
    placement_friction(r, c, candidate);
    return 0;
}

/* contact states where depths decide; marks contacts at zero slip, and regions at whose end the body rests: counted as
   entered */
void placement_all(Run *r, signed char *candidate, signed char *resting)
{
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++) {
        int inside = 1, enters = 0;
        resting[c] = 0;
        if (contact_is_array(c)) r->at.state[c] = CONTACT_SLIP_PLUS;
        if (contact_is_array(c) || model_contact_partner[c] >= 0 || model_contact_impulsive[c]) continue;
        candidate[c] = 0;
        if (cone_is_side(c)) continue;
        if (model_contact_bounded[c]) {
            const double depth = r->scratch.depth[c][0];
            const int at_bound = fabs(depth)
                                 <= r->tolerances.slip * model_depth_magnitude(r->at.p, r->at.d, &r->scratch, c);
            /* at the bound itself the rate of the depth decides; at rest there a stop does not count as entered */
            double rate = 0.0;
            if (at_bound) {
                rate = model_contact_compliant[c] ? r->scratch.slip[c][0] : depth_rate(r, c);
                r->at.known[c][SLOT_NORMAL] = 1;
            }
            resting[c] = (signed char)(at_bound && rate == 0.0 && !model_contact_compliant[c]);
            inside = at_bound ? rate > 0.0 || resting[c] : depth > 0.0;
            enters = at_bound && inside && model_contact_compliant[c];
        }
        const int was_inside = r->at.state[c] != CONTACT_AWAY;
        const int rests = contact_may_rest(c) && r->at.state[c] == CONTACT_STICK;
        if (!inside) {
            r->at.state[c] = CONTACT_AWAY;
        } else if (enters) {
            placement_enter(r, c);
        } else if (model_contact_compliant[c]) {
            r->at.state[c] = was_inside && r->at.state[c] == CONTACT_RELEASED ? CONTACT_RELEASED : inside_state(r, c);
        } else if (rests || stays_at_zero_slip(r, c)) {
            const signed char leaving = contact_may_rest(c) && !rests ? placement_leaving(r, c) : CONTACT_STICK;
            candidate[c] = leaving == CONTACT_STICK;
            r->at.state[c] = !candidate[c] ? leaving : was_inside ? r->at.state[c] : CONTACT_SLIP_PLUS;
        } else {
            r->at.state[c] = placement_slipping(r, c);
        }
    }
}

/* coordinates of contacts at their wall onto it: what rounding leaves would add up over many impacts */
void placement_on_walls(Run *r, const signed char *at_walls)
{
    Jets *j = &r->scratch;
    Sticking s;
    for (int c = 0; c < MODEL_NC; c++)
        stick_unweighted(j, c);
    contact_factor(&r->at, j, at_walls, NULL, &s);
    for (int i = 0; i < s.count; i++) {
        double push = 0.0;
        for (int e = s.first[i]; e < s.last[i]; e++)
            push += s.inverse[i][e] * j->depth[s.contact[e]][0];
        for (int v = 0; v < MODEL_NQ; v++)
            r->at.x[v] += j->W[v][s.contact[i]][0] * push;
    }
}

/* friction with a force of its own, and stops, after the velocities have jumped */
void placement_others(Run *r, signed char *candidate)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_partner[c] >= 0 || model_contact_impulsive[c] || r->at.state[c] == CONTACT_AWAY) continue;
        if (contact_is_array(c) || cone_is_side(c)) continue;
        if (model_contact_compliant[c]) {
            r->at.state[c] = inside_state(r, c);
        } else {
            candidate[c] = (signed char)placement_at_zero_slip(r, c);
            r->at.state[c] = candidate[c] ? r->at.state[c] : placement_slipping(r, c);
        }
    }
}

int placement_closed_on_walls(Run *r, signed char *closed)
{
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        closed[c] = (signed char)contact_is_closed(r, c);
        any |= closed[c];
    }
    if (any) {
        placement_load(r);
        placement_load_inertia(r);
        placement_on_walls(r, closed);
    }
    return any;
}

void placement_hold_next(Run *r, int c)
{
    const int next = r->scratch.next[c], side = r->at.state[c - 1] == CONTACT_SLIP_MINUS ? -1 : 1;
    if (next < 0) return;
    r->at.held[next - (MODEL_NX - MODEL_NE)] = (signed char)side;
    r->at.x[next] = side * element_bound(r->at.d, c)[next - model_contact_first[c]];
}

void placement_elements(Run *r, int *moved)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const double *bound = element_bound(r->at.d, c);
        const int side = c > 0 && r->at.state[c - 1] == CONTACT_SLIP_MINUS ? -1 : 1;
        for (int i = 0; i < model_contact_elements[c]; i++) {
            double *z = &r->at.x[model_contact_first[c] + i];
            const int yields = bound[i] - side * *z <= r->tolerances.slip * bound[i];
            const double before = *z;
            if (yields || -side * *z > bound[i]) *z = (yields ? side : -side) * bound[i];
            r->at.held[model_contact_first[c] + i - (MODEL_NX - MODEL_NE)] = (signed char)(yields ? side : 0);
            *moved |= *z != before;
        }
    }
}
