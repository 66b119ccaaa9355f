/*
 * What happens at an event.
 *
 *     transit:    an indicator has fallen to zero. By its slot and the state of its contact:
 *                     friction  normal      inside -> away; away -> inside, slipping as the slip speed says
 *                               tangential  candidate for another state
 *                     stop      normal      away -> touching, the speed of entry kept; touching or released -> away
 *                               tangential  touching -> released (away if no longer inside); released -> touching
 *                     impact    normal      open -> impact; closed -> candidate; chattering -> closed
 *                 a switch with a jump of the states makes it first
 *     impact:     all rigid contacts at their wall take part (impact.c); afterwards those that leave it are open, those that do
 *                 not are candidates, and whatever else feels the new velocities is placed anew
 *     candidates: the contacts of friction whose tangential indicator falls now, those at zero slip within rounding,
 *                 and all that stick or are closed (another contact's change can tear them loose)
 *     choose:     choice.c
 *     settle:     a bounce in the tail of a chatter is the last: its contact is held from here on (impact.c)
 *
 * Changes at one instant are bounded; beyond the bound the run stops and names the contact.
 */
#include "engine.h"

static int at_zero_slip(const Run *r, int c)
{
    return fabs(r->scratch.slip[c][0]) <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, &r->scratch, c);
}

/* slip speeds and depths at r's instant, in scratch */
static void load_contacts(Run *r)
{
    taylor_load(r, &r->scratch);
    model_slip(r->at.p, r->at.d, &r->scratch, 0);
    if (MODEL_BOUNDED) {
        model_depth(r->at.p, r->at.d, &r->scratch, 0);
    }
}

/* W and G at r's instant, in scratch */
static void load_inertia(Run *r)
{
    if (!MODEL_CONSTANT_INERTIA) {
        model_inertia(r->at.p, r->at.d, &r->scratch, 0);
    }
}

/* nothing has happened at this instant yet */
static void forget_event(Run *r)
{
    memset(r->entered, 0, sizeof r->entered);
    memset(r->jumped, 0, sizeof r->jumped);
    memset(r->projected, 0, sizeof r->projected);
    memset(r->struck, 0, sizeof r->struck);
    r->impact_phases = 0;
    r->impact_work = 0.0;
}

/* a contact of friction that is inside slips as its slip speed says */
static signed char slipping_state(const Run *r, int c)
{
    return r->scratch.slip[c][0] < 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
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

/* rate of the depth of a region, which is not the rate that y stands for */
static double depth_rate(Run *r, int c)
{
    Jets *j = &r->scratch;
    taylor_field(r, j, 0);
    for (int i = 0; i < MODEL_NQ; i++) {
        j->x[i][1] = j->x[MODEL_NQ + i][0];
    }
    for (int i = 0; i < MODEL_NV; i++) {
        j->x[MODEL_NQ + i][1] = contact_rate(j, i, 0);
    }
    model_depth(r->at.p, r->at.d, j, 1);
    return j->depth[c][1];
}

/* whether the gap of a rigid contact is zero, but for rounding */
static int at_wall(const Run *r, int c)
{
    return fabs(r->scratch.depth[c][0]) <= r->tolerances.slip * model_depth_magnitude(r->at.p, r->at.d, &r->scratch, c);
}

/* the friction of a rigid contact that is closed; marks it if it is at zero slip */
static void place_friction(Run *r, int normal, signed char *candidate)
{
    const int c = model_contact_partner[normal];
    if (c >= 0) {
        candidate[c] = (signed char)at_zero_slip(r, c);
        r->at.state[c] = !candidate[c] || r->at.state[c] == CONTACT_AWAY ? slipping_state(r, c) : r->at.state[c];
    }
}

/* a rigid contact leaves its wall, or is not at it */
static void open_rigid(Run *r, int c)
{
    r->at.state[c] = CONTACT_AWAY;
    if (model_contact_partner[c] >= 0) {
        r->at.state[(int)model_contact_partner[c]] = CONTACT_AWAY;
    }
}

/* the state of a rigid contact from its gap; marks it if it rests at its wall; 1 if it runs into it, RUN_ERROR below it */
static int place_rigid(Run *r, int c, signed char *candidate)
{
    const double depth = r->scratch.depth[c][0];
    const int starts = r->starting;
    const int held = contact_is_held(r->at.state, c);
    candidate[c] = 0;
    if (!at_wall(r, c) && (starts || fabs(depth) > r->tolerances.drift)) {
        if (depth > 0.0) {
            return run_fail(r, "the wall of the rigid contact '%s' is penetrated by %.6g at t = %.17g: %s", model_contact_names[c], depth,
                            r->at.time, starts ? "start with a gap of zero or more" : "an input moved it through the body");
        }
        open_rigid(r, c);
        return 0;
    }
    if (!held && !at_wall(r, c) && depth < 0.0) {
        return 0;
    }
    r->at.known[c][SLOT_NORMAL] = 1;
    if (!held && !at_zero_slip(r, c)) {
        open_rigid(r, c);
        return r->scratch.slip[c][0] < 0.0;
    }
    r->at.state[c] = held ? r->at.state[c] : CONTACT_TOUCHING;
    candidate[c] = 1;
    place_friction(r, c, candidate);
    return 0;
}

/* contact states where depths decide; marks contacts at zero slip, and regions at whose end the body rests: counted as entered */
static void place(Run *r, signed char *candidate, signed char *resting)
{
    load_contacts(r);
    for (int c = 0; c < MODEL_NC; c++) {
        int inside = 1;
        resting[c] = 0;
        if (model_contact_partner[c] >= 0 || model_contact_is_impact[c]) {
            continue;
        }
        candidate[c] = 0;
        if (model_contact_bounded[c]) {
            const double depth = r->scratch.depth[c][0];
            const int at_bound = fabs(depth) <= r->tolerances.slip * model_depth_magnitude(r->at.p, r->at.d, &r->scratch, c);
            /* at the bound itself the rate of the depth decides; at rest there a stop does not count as entered */
            double rate = 0.0;
            if (at_bound) {
                rate = model_contact_is_stop[c] ? r->scratch.slip[c][0] : depth_rate(r, c);
                r->at.known[c][SLOT_NORMAL] = 1;
            }
            resting[c] = (signed char)(at_bound && rate == 0.0 && !model_contact_is_stop[c]);
            inside = at_bound ? rate > 0.0 || resting[c] : depth > 0.0;
            if (at_bound && inside && model_contact_is_stop[c]) {
                r->at.memory[c] = fabs(rate);
            }
        }
        const int was_inside = r->at.state[c] != CONTACT_AWAY;
        if (!inside) {
            r->at.state[c] = CONTACT_AWAY;
        } else if (model_contact_is_stop[c]) {
            r->at.state[c] = was_inside && r->at.state[c] == CONTACT_RELEASED ? CONTACT_RELEASED : inside_state(r, c);
        } else if (at_zero_slip(r, c)) {
            candidate[c] = 1;
            r->at.state[c] = was_inside ? r->at.state[c] : CONTACT_SLIP_PLUS;
        } else {
            r->at.state[c] = slipping_state(r, c);
        }
    }
}

/* the signs with which the depths of regions leave zero where the body rests at their end; 0 for all others */
static void leaving_signs(Run *r, const signed char *resting, signed char *sign)
{
    enum { ORDER = 8 };
    Jets *j = &r->scratch;
    taylor_series(r, j, ORDER, INFINITY);
    const double length = taylor_time_scale(r, j, ORDER);
    for (int c = 0; c < MODEL_NC; c++) {
        sign[c] = 0;
        if (resting[c]) {
            const double floor = r->tolerances.margin * model_depth_magnitude(r->at.p, r->at.d, j, c);
            int k = 2;
            while (k < ORDER && !(fabs(j->depth[c][k]) * pow(length, k) > floor)) {
                k++;
            }
            sign[c] = (signed char)(k == ORDER ? 0 : j->depth[c][k] > 0.0 ? 1 : -1);
            r->at.known[c][SLOT_NORMAL] = (signed char)(k == ORDER ? MODEL_TERMS : k);
        }
    }
}

/*
 * What a body at rest touches decides where it goes. Regions that it would go out of are left at once, if it still goes
 * there without them; otherwise it is held at their end from both sides, and touches all.
 */
static RunStatus leave_regions(Run *r, signed char *candidate, const signed char *resting, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char sign[NC];
    signed char without[NC];
    const Point touching = r->at;
    int leaves = 0;
    leaving_signs(r, resting, sign);
    for (int c = 0; c < MODEL_NC; c++) {
        if (sign[c] < 0) {
            leaves = 1;
            candidate[c] = 0;
            r->at.state[c] = CONTACT_AWAY;
        }
    }
    if (!leaves) {
        return RUN_OK;
    }
    if (choice_make(r, candidate, at_limit, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    leaving_signs(r, resting, without);
    if (memcmp(sign, without, sizeof sign) != 0) {
        r->at = touching;
    }
    return RUN_OK;
}

/* coordinates of contacts at their wall onto it: what rounding leaves would add up over many impacts */
void events_place_on_walls(Run *r, const signed char *at_walls)
{
    Jets *j = &r->scratch;
    Sticking s;
    taylor_load(r, j);
    model_slip(r->at.p, r->at.d, j, 0);
    model_depth(r->at.p, r->at.d, j, 0);
    load_inertia(r);
    for (int c = 0; c < MODEL_NC; c++) {
        j->capacity[c][0] = 0.0;
    }
    contact_factor(&r->at, j, at_walls, NULL, &s);
    for (int i = 0; i < s.count; i++) {
        double push = 0.0;
        for (int e = 0; e < s.count; e++) {
            push += s.inverse[i][e] * j->depth[s.contact[e]][0];
        }
        for (int v = 0; v < MODEL_NQ; v++) {
            r->at.x[v] += j->W[v][s.contact[i]][0] * push;
        }
    }
}

/* friction with a force of its own, and stops, after the velocities have jumped */
static void place_others(Run *r, signed char *candidate)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_partner[c] >= 0 || model_contact_is_impact[c] || r->at.state[c] == CONTACT_AWAY) {
            continue;
        }
        if (model_contact_is_stop[c]) {
            r->at.state[c] = inside_state(r, c);
        } else {
            candidate[c] = (signed char)at_zero_slip(r, c);
            r->at.state[c] = candidate[c] ? r->at.state[c] : slipping_state(r, c);
        }
    }
}

/* whether Newton's rule lets a contact that arrived with this speed leave again */
static int bounces(const Run *r, int c, double speed)
{
    return r->struck[c] && model_restitution(r->at.p, r->at.d, c) * speed > 0.0;
}

/* an impact of the contacts that arrive at their walls, with all that are there */
static RunStatus strike(Run *r, const signed char *arrives, signed char *candidate, int *moved)
{
    signed char takes_part[NC] = {0};
    double speed[NC];
    for (int c = 0; c < MODEL_NC; c++) {
        const int rigid = model_contact_is_impact[c];
        takes_part[c] = (signed char)(rigid && (arrives[c] || contact_is_held(r->at.state, c) || at_wall(r, c)));
        r->struck[c] = (signed char)(takes_part[c] && !contact_is_held(r->at.state, c) && r->scratch.slip[c][0] < 0.0);
        speed[c] = -r->scratch.slip[c][0];
    }
    load_inertia(r);
    if (impact_resolve(r, takes_part) == RUN_ERROR) {
        return RUN_ERROR;
    }
    *moved = 1;
    events_place_on_walls(r, takes_part);
    load_contacts(r);
    const ImpactPhase *last = &r->impact[r->impact_phases - 1];
    for (int c = 0; c < MODEL_NC; c++) {
        if (!takes_part[c]) {
            continue;
        }
        const int rests = (last->held[c] && (r->impact_phases > 1 || !bounces(r, c, speed[c]))) || at_zero_slip(r, c);
        r->at.known[c][SLOT_NORMAL] = 1;
        r->at.memory[c] = r->struck[c] ? fmax(r->at.memory[c], speed[c]) : r->at.memory[c];
        candidate[c] = (signed char)rests;
        if (!rests) {
            open_rigid(r, c);
            continue;
        }
        r->at.state[c] = contact_is_held(r->at.state, c) ? r->at.state[c] : CONTACT_TOUCHING;
        place_friction(r, c, candidate);
        const int friction = model_contact_partner[c];
        if (friction >= 0 && last->friction[friction] == CONTACT_STICK) {
            candidate[friction] = 1;
        }
    }
    place_others(r, candidate);
    return RUN_OK;
}

/* contacts that bounced slowly enough are held from now on, until infinitely many bounces would be over */
static RunStatus settle(Run *r, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char candidate[NC] = {0};
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        double wait;
        int other;
        if (!r->struck[c] || r->at.state[c] != CONTACT_AWAY || !impact_settles(r, c, &wait, &other)) {
            continue;
        }
        for (int e = c; e >= 0; e = e == c ? other : -1) {
            r->at.settles[e] = r->at.time + wait;
            r->at.state[e] = r->at.settles[e] > r->at.time ? CONTACT_CHATTERING : CONTACT_TOUCHING;
            candidate[e] = 1;
            any = 1;
        }
    }
    if (!any) {
        return RUN_OK;
    }
    load_contacts(r);
    for (int c = 0; c < MODEL_NC; c++) {
        if (candidate[c]) {
            place_friction(r, c, candidate);
        } else if (contact_is_held(r->at.state, c)) {
            candidate[c] = 1;
        }
    }
    return choice_make(r, candidate, at_limit, moved);
}

RunStatus events_reconsider(Run *r, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char candidate[NC] = {0};
    signed char resting[NC];
    signed char arrives[NC] = {0};
    int any = 0;
    place(r, candidate, resting);
    forget_event(r);
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        if (model_contact_is_impact[c]) {
            const int arrival = place_rigid(r, c, candidate);
            if (arrival == RUN_ERROR) {
                return RUN_ERROR;
            }
            arrives[c] = (signed char)(arrival != 0);
            any |= arrival;
        }
    }
    if (any && strike(r, arrives, candidate, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    if (choice_make(r, candidate, at_limit, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    if (memchr(resting, 1, sizeof resting) && leave_regions(r, candidate, resting, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    return any ? settle(r, moved) : RUN_OK;
}

/* states jump where the contact's switching function reaches zero from the side it was on */
static int jump(Run *r, int c, int *moved)
{
    const int side = r->at.state[c] == CONTACT_SLIP_PLUS ? 1 : r->at.state[c] == CONTACT_SLIP_MINUS ? 2 : 0;
    if (!(model_contact_resets[c] & side)) {
        return 0;
    }
    model_reset(r->at.p, r->at.d, &r->scratch, c, r->at.x);
    load_contacts(r);
    r->jumped[c] = 1;
    *moved = 1;
    return 1;
}

/* the new state of contact c after the fall of its normal indicator; 1 if it is now inside with friction */
static int cross_bound(Run *r, int c)
{
    signed char *state = &r->at.state[c];
    r->at.known[c][SLOT_NORMAL] = 1;
    if (*state != CONTACT_AWAY) {
        *state = CONTACT_AWAY;
        return 0;
    }
    if (!model_contact_is_stop[c]) {
        *state = slipping_state(r, c);
        return 1;
    }
    *state = CONTACT_TOUCHING;
    r->at.memory[c] = fabs(r->scratch.slip[c][0]);
    r->entered[c] = 1;
    if (model_contact_releases[c]) {
        /* at the bound exactly: a stop without damping has no force yet */
        r->scratch.depth[c][0] = 0.0;
        r->scratch.memory[c] = r->at.memory[c];
        model_release(r->at.p, r->at.d, &r->scratch, 0, c);
        r->at.known[c][SLOT_TANGENTIAL] = r->scratch.release[c][0] == 0.0;
    }
    return 0;
}

/* the state of a rigid contact whose indicator may have fallen; 1 if it arrives at its wall */
static int cross_wall(Run *r, int c, signed char *candidate, signed char *at_limit)
{
    const int falls = r->falling[c][SLOT_NORMAL];
    const int state = r->at.state[c];
    if (state == CONTACT_AWAY) {
        return falls;
    }
    candidate[c] = 1;
    at_limit[c] = (signed char)(falls && state == CONTACT_TOUCHING);
    if (falls && state == CONTACT_CHATTERING) {
        r->at.state[c] = CONTACT_TOUCHING;
        r->at.memory[c] = 0.0;
    }
    return 0;
}

RunStatus events_transit(Run *r, int *moved)
{
    signed char candidate[NC];
    signed char at_limit[NC];
    signed char arrives[NC] = {0};
    int any = 0;
    load_contacts(r);
    memset(r->at.known, 0, sizeof r->at.known);
    forget_event(r);
    for (int c = 0; c < MODEL_NC; c++) {
        const int sticks = r->at.state[c] == CONTACT_STICK;
        const int falls = r->falling[c][SLOT_TANGENTIAL];
        at_limit[c] = sticks && falls;
        candidate[c] = 0;
        if (model_contact_is_impact[c]) {
            arrives[c] = (signed char)cross_wall(r, c, candidate, at_limit);
            any |= arrives[c];
        } else if (r->falling[c][SLOT_NORMAL]) {
            candidate[c] = (signed char)(cross_bound(r, c) && at_zero_slip(r, c));
        } else if (r->at.state[c] == CONTACT_AWAY) {
            continue;
        } else if (model_contact_is_stop[c]) {
            if (falls) {
                const int inside = r->scratch.depth[c][0] > 0.0;
                r->at.known[c][SLOT_TANGENTIAL] = 1;
                r->at.state[c] = r->at.state[c] == CONTACT_RELEASED ? CONTACT_TOUCHING : inside ? CONTACT_RELEASED : CONTACT_AWAY;
            }
        } else {
            const double reached = fabs(r->scratch.slip[c][0]); /* a fallen function is zero but for its rounding */
            const int jumped = falls && jump(r, c, moved);
            const int still_zero = falls && fabs(r->scratch.slip[c][0]) <= reached;
            candidate[c] = sticks || at_zero_slip(r, c) || still_zero;
            if (jumped && !candidate[c]) {
                r->at.state[c] = slipping_state(r, c);
            }
        }
    }
    if (any && strike(r, arrives, candidate, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    if (choice_make(r, candidate, at_limit, moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    return any ? settle(r, moved) : RUN_OK;
}

/* whether events crowd into ever shorter times; asked once per event */
static int crowds(Run *r)
{
    r->longest_pause = fmax(r->longest_pause, r->at.time - r->last_event);
    r->last_event = r->at.time;
    if (r->at.time - r->crowd_start > r->tolerances.crowd * r->longest_pause) {
        r->crowd_start = r->at.time;
        r->crowded = 0;
    }
    return ++r->crowded > 10 * r->tolerances.max_iterations;
}

RunStatus events_resolve(Run *r, EventSink sink, void *context)
{
    signed char before[NC];
    int moved = 0;
    int last = 0;
    memcpy(before, r->at.state, sizeof before);
    if (events_transit(r, &moved) == RUN_ERROR) {
        return RUN_ERROR;
    }
    double work = r->impact_work;
    for (int c = 0; c < MODEL_NC; c++) {
        last = r->falling[c][SLOT_NORMAL] || r->falling[c][SLOT_TANGENTIAL] ? c : last;
        if (r->entered[c] && model_contact_remembers[c] && !(r->at.memory[c] > 0.0)) {
            return run_fail(r, "the stop '%s' is entered without speed at t = %.17g, but its force depends on the speed at which it "
                               "was entered: start with a speed towards it, or away from it",
                            model_contact_names[c], r->at.time);
        }
        if (r->at.state[c] != before[c] || r->struck[c]) {
            r->events++;
            if (sink) {
                const ContactEvent event = {r->at.time, c, before[c], r->at.state[c], r->struck[c] ? work : 0.0};
                sink(context, &event);
            }
            work = r->struck[c] ? 0.0 : work; /* of simultaneous impacts it is told once */
        }
    }
    if (crowds(r)) {
        return run_fail(r, "contact '%s' switches ever faster at t = %.17g: %d events since t = %.17g, without an end in sight",
                        model_contact_names[last], r->at.time, r->crowded, r->crowd_start);
    }
    if (++r->stalled > r->tolerances.max_iterations) {
        return run_fail(r, "contact '%s' keeps switching at t = %.17g: after %d events without progress the motion there is "
                           "not determined by the model",
                        model_contact_names[last], r->at.time, r->stalled);
    }
    return RUN_OK;
}
