/*
 * What happens at an event.
 *
 *     transit:    an indicator has fallen to zero. By its slot and the state of its contact:
 *                     friction  normal      inside -> away; away -> inside, slipping as the slip speed says
 *                               tangential  candidate for another state
 *                     stop      normal      away -> touching, the speed of entry kept; touching or released -> away
 *                               tangential  touching -> released (away if no longer inside); released -> touching
 *                 a switch with a jump of the states makes it first
 *     candidates: the contacts of friction whose tangential indicator falls now, those at zero slip within rounding,
 *                 and all that stick (another contact's change can tear them loose)
 *     choose:     choice.c
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

/* contact states where depths decide; marks contacts at zero slip, and regions at whose end the body rests: counted as entered */
static void place(Run *r, signed char *candidate, signed char *resting)
{
    load_contacts(r);
    for (int c = 0; c < MODEL_NC; c++) {
        int inside = 1;
        candidate[c] = 0;
        resting[c] = 0;
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
static void leave_regions(Run *r, signed char *candidate, const signed char *resting, int *moved)
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
        return;
    }
    choice_make(r, candidate, at_limit, moved);
    leaving_signs(r, resting, without);
    if (memcmp(sign, without, sizeof sign) != 0) {
        r->at = touching;
    }
}

void events_reconsider(Run *r, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char candidate[NC];
    signed char resting[NC];
    place(r, candidate, resting);
    choice_make(r, candidate, at_limit, moved);
    if (memchr(resting, 1, sizeof resting)) {
        leave_regions(r, candidate, resting, moved);
    }
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

void events_transit(Run *r, int *moved)
{
    signed char candidate[NC];
    signed char at_limit[NC];
    load_contacts(r);
    memset(r->at.known, 0, sizeof r->at.known);
    memset(r->entered, 0, sizeof r->entered);
    memset(r->jumped, 0, sizeof r->jumped);
    memset(r->projected, 0, sizeof r->projected);
    for (int c = 0; c < MODEL_NC; c++) {
        const int sticks = r->at.state[c] == CONTACT_STICK;
        const int falls = r->falling[c][SLOT_TANGENTIAL];
        at_limit[c] = sticks && falls;
        candidate[c] = 0;
        if (r->falling[c][SLOT_NORMAL]) {
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
    choice_make(r, candidate, at_limit, moved);
}

RunStatus events_resolve(Run *r, EventSink sink, void *context)
{
    signed char before[NC];
    int moved = 0;
    int last = 0;
    memcpy(before, r->at.state, sizeof before);
    events_transit(r, &moved);
    for (int c = 0; c < MODEL_NC; c++) {
        last = r->falling[c][SLOT_NORMAL] || r->falling[c][SLOT_TANGENTIAL] ? c : last;
        if (r->entered[c] && model_contact_remembers[c] && !(r->at.memory[c] > 0.0)) {
            return run_fail(r, "the stop '%s' is entered without speed at t = %.17g, but its force depends on the speed at which it "
                               "was entered: start with a speed towards it, or away from it",
                            model_contact_names[c], r->at.time);
        }
        if (r->at.state[c] != before[c]) {
            r->events++;
            if (sink) {
                const ContactEvent event = {r->at.time, c, before[c], r->at.state[c]};
                sink(context, &event);
            }
        }
    }
    if (++r->stalled > r->tolerances.max_iterations) {
        return run_fail(r, "contact '%s' keeps switching at t = %.17g: after %d events without progress the motion there is "
                           "not determined by the model",
                        model_contact_names[last], r->at.time, r->stalled);
    }
    return RUN_OK;
}
