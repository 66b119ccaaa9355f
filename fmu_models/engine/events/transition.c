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
 *     impact:     all rigid contacts at their wall take part (impact.c); afterwards those that leave it are open, those
 *                 that do not are candidates, and whatever else feels the new velocities is placed anew
 *     candidates: the contacts of friction whose tangential indicator falls now, those at zero slip within rounding,
 *                 all that stick or are closed (another contact's change can tear them loose), and those at rest, at
 *                 their wall or in slip, only because others hold the same motion
 *     choose:     mode_selection.c; then the clocks of contacts that begin or end to stick start anew
 *     tick:       jumps and bends of signals, whose times are known: resets that a jump takes through zero, then reconsider
 *     settle:     an impact in the tail of a chatter is the last: its contacts are held from here on (chatter.c)
 *
 * Changes at one instant are bounded; beyond the bound the run stops and names the contact (accumulation.c).
 */
#include "transition.h"

#include "../step/contact_forces.h"
#include "../step/taylor.h"
#include "accumulation.h"
#include "chatter.h"
#include "contact_placement.h"
#include "energy_watch.h"
#include "impact.h"
#include "mode_selection.h"

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
        const int rigid = model_contact_impulsive[c];
        takes_part[c] =
            (signed char)(rigid && (arrives[c] || contact_is_held(r->at.state, c) || placement_at_wall(r, c)));
        r->struck[c] = (signed char)(takes_part[c] && !contact_is_held(r->at.state, c) && r->scratch.slip[c][0] < 0.0);
        speed[c] = -r->scratch.slip[c][0];
    }
    placement_load_inertia(r);
    const Velocities before = energy_velocities(r);
    if (impact_resolve(r, takes_part) == RUN_ERROR || energy_check_impact(r, &before) == RUN_ERROR) return RUN_ERROR;
    *moved = 1;
    placement_on_walls(r, takes_part);
    const ImpactPhase *last = &r->impact[r->impact_phases - 1];
    for (int c = 0; c < MODEL_NC; c++) {
        if (!takes_part[c]) continue;
        const int rests = (last->held[c] && (r->impact_phases > 1 || !bounces(r, c, speed[c])))
                          || placement_at_zero_slip(r, c);
        r->at.known[c][SLOT_NORMAL] = 1;
        if (r->struck[c]) {
            r->at.memory[c] = fmax(r->at.memory[c], speed[c]);
            r->closings[c].fastest = fmax(r->closings[c].fastest, speed[c]);
        }
        candidate[c] = (signed char)rests;
        if (!rests) {
            placement_open(r, c);
            continue;
        }
        r->at.state[c] = contact_is_held(r->at.state, c) ? r->at.state[c] : CONTACT_TOUCHING;
        placement_friction(r, c, candidate);
        const int friction = model_contact_partner[c];
        if (friction >= 0 && last->friction[friction] == CONTACT_STICK) candidate[friction] = 1;
    }
    placement_others(r, candidate);
    return RUN_OK;
}

/* choose states; what is projected on the way is rounding */
static RunStatus select_watched(Run *r, const signed char *candidate, const signed char *at_limit, int *moved)
{
    const Velocities before = energy_velocities(r);
    return selection_make(r, candidate, at_limit, moved) == RUN_ERROR ? RUN_ERROR : energy_check_projection(r, &before);
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
            while (k < ORDER && !(fabs(j->depth[c][k]) * pow(length, k) > floor))
                k++;
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
    signed char sign[NC], without[NC];
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
    if (!leaves) return RUN_OK;
    if (selection_make(r, candidate, at_limit, moved) == RUN_ERROR) return RUN_ERROR;
    leaving_signs(r, resting, without);
    if (memcmp(sign, without, sizeof sign) != 0) r->at = touching;
    return RUN_OK;
}

/* what knows the time in stick begins anew where contacts have begun or ended to stick */
static void restart_clocks(Run *r, const signed char *before, int *moved)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int changed = (before[c] == CONTACT_STICK) != (r->at.state[c] == CONTACT_STICK);
        if ((model_contact_resets[c] & 4) && changed) {
            taylor_load(r, &r->scratch);
            model_reset(r->at.p, r->at.d, &r->scratch, c, r->at.x);
            r->jumped[c] = 1;
            *moved = 1;
        }
    }
}

/* whom an instant has taken where; what has happened there before stays noted */
static RunStatus reconsider(Run *r, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char candidate[NC] = {0}, resting[NC], arrives[NC] = {0}, before[NC];
    int any = 0;
    memcpy(before, r->at.state, sizeof before);
    placement_all(r, candidate, resting);
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        if (model_contact_impulsive[c]) {
            const int arrival = placement_rigid(r, c, candidate);
            if (arrival == RUN_ERROR) return RUN_ERROR;
            arrives[c] = (signed char)(arrival != 0);
            any |= arrival;
        }
    }
    if (any && strike(r, arrives, candidate, moved) == RUN_ERROR) return RUN_ERROR;
    /* at a wall that an input moves closed contacts take its new speed */
    const int driven = MODEL_IMPACTS > 0 && !r->starting;
    if ((driven ? selection_make : select_watched)(r, candidate, at_limit, moved) == RUN_ERROR) return RUN_ERROR;
    if (memchr(resting, 1, sizeof resting) && leave_regions(r, candidate, resting, moved) == RUN_ERROR)
        return RUN_ERROR;
    if (!r->starting) restart_clocks(r, before, moved);
    if (MODEL_NE > 0) placement_elements(r, moved);
    return any ? chatter_settle(r, moved) : RUN_OK;
}

/* states jump where the contact's switching function reaches zero from the side it was on */
static void jump(Run *r, int c, int *moved)
{
    const int side = r->at.state[c] == CONTACT_SLIP_PLUS ? 1 : r->at.state[c] == CONTACT_SLIP_MINUS ? 2 : 0;
    if (!(model_contact_resets[c] & side)) return;
    const double rate = contact_may_rest(c) ? chatter_rate(r, c) : 0.0;
    if (contact_is_array(c))
        placement_hold_next(r, c);
    else
        model_reset(r->at.p, r->at.d, &r->scratch, c, r->at.x);
    if (contact_may_rest(c)) chatter_note_reset(r, c, rate);
    placement_load(r);
    r->jumped[c] = 1;
    *moved = 1;
}

/* jumps of switches that were at zero when an input was touched, and would have fallen there: they go on through it */
static void jump_at_zero(Run *r, int *moved)
{
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++) {
        const signed char state = r->at.state[c];
        const int slips = state == CONTACT_SLIP_PLUS || state == CONTACT_SLIP_MINUS;
        if (!slips || !(model_contact_resets[c] & 3) || !placement_at_zero_slip(r, c)) continue;
        const signed char leaving = placement_leaving(r, c);
        placement_load(r);
        if (leaving == CONTACT_STICK || leaving == state) continue;
        jump(r, c, moved);
        r->events++;
    }
}

RunStatus transition_reconsider(Run *r, int *moved)
{
    forget_event(r);
    if (!r->starting) jump_at_zero(r, moved);
    return reconsider(r, moved);
}

/* the jumps of all switches that fall, which may take others off the surface they slide along, or past it; a fallen
   function is zero but for its rounding, which `reached` keeps */
static void make_jumps(Run *r, double *reached, int *moved)
{
    for (int c = 0; c < MODEL_NC; c++) {
        reached[c] = fabs(r->scratch.slip[c][0]);
        const int falls = model_contact_tangential[c] && r->falling[c][SLOT_TANGENTIAL];
        if (falls && !contact_is_settling(r, c)) jump(r, c, moved);
    }
    const int any = memchr(r->jumped, 1, sizeof r->jumped) != NULL;
    for (int c = 0; any && c < MODEL_NC; c++) {
        const int slides = model_contact_tangential[c] && r->at.state[c] != CONTACT_AWAY;
        const int stays = contact_may_rest(c) && fabs(r->scratch.slip[c][0]) <= reached[c];
        if (slides && !r->jumped[c] && !stays && !placement_at_zero_slip(r, c))
            r->at.state[c] = placement_slipping(r, c);
    }
}

/* a slip that falls is zero: bounds that yield read it, and a body that sticks would else seem to push them on */
static void drop_fallen_slips(Run *r)
{
    signed char fallen[NC] = {0};
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        const int slips = model_contact_rubs[c] && model_contact_sticks[c] && r->at.state[c] != CONTACT_STICK;
        fallen[c] = slips && r->falling[c][SLOT_TANGENTIAL];
        if (cone_is_side(c)) fallen[c] = cone_is_side(c - 1) ? fallen[c - 1] : r->falling[c - 1][SLOT_TANGENTIAL];
        any |= fallen[c];
    }
    if (!any) return;
    contact_project(&r->at, &r->scratch, fallen, NULL);
    placement_load(r);
}

/* a switch that may rest has come to zero; 1 if it may rest there */
static int cross_zero(Run *r, int c)
{
    const int over = contact_is_settling(r, c) && !r->jumped[c];
    const signed char leaving = over ? CONTACT_STICK : placement_leaving(r, c);
    if (leaving == CONTACT_STICK)
        r->closings[c] = (Closings){0};
    else
        r->at.state[c] = leaving;
    return leaving == CONTACT_STICK;
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
    if (!model_contact_compliant[c]) {
        *state = placement_slipping(r, c);
        return 1;
    }
    placement_enter(r, c);
    return 0;
}

/* the state of a rigid contact whose indicator may have fallen; 1 if it arrives at its wall */
static int cross_wall(Run *r, int c, signed char *candidate, signed char *at_limit)
{
    const int falls = r->falling[c][SLOT_NORMAL];
    const int state = r->at.state[c];
    if (state == CONTACT_AWAY) {
        /* a speed that is the rounding of others' does not arrive */
        if ((falls || placement_at_wall(r, c)) && placement_at_rest_by_others(r, c)) {
            candidate[c] = 1;
            placement_friction(r, c, candidate);
            return 0;
        }
        return falls && !placement_touches(r, c);
    }
    candidate[c] = 1;
    at_limit[c] = (signed char)(falls && state == CONTACT_TOUCHING);
    if (falls && state == CONTACT_CHATTERING) {
        r->at.state[c] = CONTACT_TOUCHING;
        r->at.memory[c] = 0.0;
    }
    return 0;
}

RunStatus transition_make(Run *r, int *moved)
{
    signed char candidate[NC], at_limit[NC], arrives[NC] = {0}, before[NC];
    double reached[NC];
    int any = 0;
    memcpy(before, r->at.state, sizeof before);
    placement_load(r);
    placement_load_inertia(r);
    memset(r->at.known, 0, sizeof r->at.known);
    forget_event(r);
    make_jumps(r, reached, moved);
    if (MODEL_YIELDS) drop_fallen_slips(r);
    for (int c = 0; c < MODEL_NC; c++) {
        const int sticks = r->at.state[c] == CONTACT_STICK;
        const int falls = r->falling[c][SLOT_TANGENTIAL];
        at_limit[c] = sticks && falls;
        candidate[c] = 0;
        if (contact_is_array(c) || cone_is_side(c)) continue;
        if (model_contact_impulsive[c]) {
            arrives[c] = (signed char)cross_wall(r, c, candidate, at_limit);
            any |= arrives[c];
        } else if (r->falling[c][SLOT_NORMAL]) {
            candidate[c] = (signed char)(cross_bound(r, c) && placement_at_zero_slip(r, c));
        } else if (r->at.state[c] == CONTACT_AWAY) {
            continue;
        } else if (model_contact_compliant[c]) {
            if (falls) {
                const int inside = r->scratch.depth[c][0] > 0.0;
                r->at.known[c][SLOT_TANGENTIAL] = 1;
                r->at.state[c] = r->at.state[c] == CONTACT_RELEASED ? CONTACT_TOUCHING
                                 : inside                           ? CONTACT_RELEASED
                                                                    : CONTACT_AWAY;
            }
        } else if (contact_may_rest(c) && !sticks) {
            candidate[c] = (signed char)(falls && cross_zero(r, c));
        } else {
            const int still_zero = falls && fabs(r->scratch.slip[c][0]) <= reached[c];
            candidate[c] = sticks || placement_at_zero_slip(r, c) || still_zero || placement_at_rest_by_others(r, c);
            if (r->jumped[c] && !candidate[c]) r->at.state[c] = placement_slipping(r, c);
        }
    }
    if (any && strike(r, arrives, candidate, moved) == RUN_ERROR) return RUN_ERROR;
    if (select_watched(r, candidate, at_limit, moved) == RUN_ERROR) return RUN_ERROR;
    restart_clocks(r, before, moved);
    if (MODEL_NE > 0) placement_elements(r, moved);
    return any ? chatter_settle(r, moved) : RUN_OK;
}

/* what has happened to contact c since it was in this state; 0 if nothing. Of simultaneous impacts the work is told
   once: taken from what is left of it */
static int told(const Run *r, int c, int before, double *work, ContactEvent *event)
{
    const int reset = r->jumped[c] && (model_contact_resets[c] & 3);
    if (cone_is_side(c)) return 0;
    if (r->at.state[c] == before && !r->struck[c] && !reset) return 0;
    *event = (ContactEvent){r->at.time, c, before, r->at.state[c], reset, r->struck[c] ? *work : 0.0};
    *work = r->struck[c] ? 0.0 : *work;
    return 1;
}

RARE void transition_tell(const Run *r, const signed char *before, EventSink sink, void *context)
{
    ContactEvent event;
    double work = r->impact_work;
    for (int c = 0; c < MODEL_NC; c++)
        if (told(r, c, before[c], &work, &event)) sink(context, &event);
}

RARE RunStatus transition_tick(Run *r, EventSink sink, void *context)
{
    signed char before[NC];
    int moved = 0;
    ContactEvent event;
    double work;
    memcpy(before, r->at.state, sizeof before);
    run_touched(r);
    placement_note_slips(r);
    run_place_signals(r);
    forget_event(r);
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++) {
        const int over = r->at.state[c] == CONTACT_SLIP_PLUS    ? r->scratch.slip[c][0] < 0.0
                         : r->at.state[c] == CONTACT_SLIP_MINUS ? r->scratch.slip[c][0] > 0.0
                                                                : 0;
        if (over && (model_contact_resets[c] & 3)) jump(r, c, &moved);
    }
    if (reconsider(r, &moved) == RUN_ERROR) return RUN_ERROR;
    work = r->impact_work;
    for (int c = 0; c < MODEL_NC; c++)
        r->events += told(r, c, before[c], &work, &event);
    if (sink) transition_tell(r, before, sink, context);
    return RUN_OK;
}

CALLED RunStatus transition_resolve(Run *r, EventSink sink, void *context)
{
    signed char before[NC];
    int moved = 0, last = 0;
    memcpy(before, r->at.state, sizeof before);
    const int bounds = accumulation_note(r);
    if (transition_make(r, &moved) == RUN_ERROR) return RUN_ERROR;
    const int ends = bounds && accumulation_ends(r);
    if (ends) accumulation_place(r);
    if ((ends || accumulation_rest(r)) && transition_reconsider(r, &moved) == RUN_ERROR) return RUN_ERROR;
    double work = r->impact_work;
    for (int c = 0; c < MODEL_NC; c++) {
        last = r->falling[c][SLOT_NORMAL] || r->falling[c][SLOT_TANGENTIAL] ? c : last;
        if (r->entered[c] && model_contact_remembers[c] && !(r->at.memory[c] > 0.0)) {
            return run_fail(
                r,
                "the stop '%s' is entered without speed at t = %.17g, but its force depends on the speed at which it "
                "was entered: start with a speed towards it, or away from it",
                model_contact_names[c], r->at.time);
        }
        ContactEvent event;
        if (!told(r, c, before[c], &work, &event)) continue;
        r->events++;
        if (!model_contact_impulsive[c] && !(contact_may_rest(c) && event.reset)
            && accumulation_check_pace(r, c) == RUN_ERROR)
            return RUN_ERROR;
        if (sink) sink(context, &event);
    }
    return accumulation_check(r, last, bounds);
}
