/*
 * Which friction contacts stick and which slip, which rigid contacts stay closed and which open, from one instant on.
 *
 *     choose:     order 0 of all candidates together is a complementarity problem with boxes (complementarity.c), in
 *                 which every one that can be held starts held
 *     ties:       contacts that do not fit this by their Taylor series (contact_fit.c) change their states: all at once,
 *                 only the last of them where their number has not fallen for some rounds; until all fit
 *     project:    velocities onto zero slip of the contacts that stick, or that leave zero slip on its wrong side; the
 *                 friction of rigid ones goes with it: what the last bounces of a chatter lack to the force that holds
 *                 the contact until they are over, their friction lacks too
 *
 * The friction of a rigid contact is away where that opens. A contact without a lever is neither held nor projected.
 * With friction alone nothing fits only if rounding decides; then every candidate keeps its state. Closed rigid contacts
 * with much friction can be without any (Painleve); that is an error, which names them.
 */
#include "mode_selection.h"

#include "../step/contact_forces.h"
#include "../step/taylor.h"
#include "contact_box.h"
#include "contact_fit.h"
#include "contact_placement.h"

/* the friction of rigid contacts goes with them, the sides of cones with the whole */
static void follow_rigid(Run *r, const Trial *trial)
{
    cones_follow(r);
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_impulsive[c]) continue;
        if (r->at.state[normal] == CONTACT_AWAY)
            r->at.state[c] = CONTACT_AWAY;
        else if (r->at.state[c] == CONTACT_AWAY)
            r->at.state[c] = trial->slip[c] < 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
    }
}

/* bounds of the force of unknown i, which is contact c */
static void set_bounds(Run *r, const Trial *trial, ContactBox *o, int i)
{
    const int c = o->contact[i];
    const int normal = model_contact_impulsive[c] ? -1 : model_contact_partner[c];
    const int follows = normal >= 0 && o->unknown[normal] >= 0;
    const int lever = placement_has_lever(r, c);
    const int holds = fit_can_stick(r, c) && !follows;
    const double capacity = holds ? stick_bound(&r->scratch, c, 1)[0] : 0.0;
    o->lower[i] = model_contact_impulsive[c] || !holds ? 0.0 : -stick_bound(&r->scratch, c, -1)[0];
    o->upper[i] = model_contact_impulsive[c] ? (lever ? INFINITY : 0.0) : capacity;
    o->mu[i] = follows && lever ? model_friction(r->at.p, r->at.d, c) : 0.0;
    o->partner[i] = follows ? o->unknown[normal] : -1;
    /* where the force decides nothing the sign that it had comes before the other */
    const int room = o->upper[i] > 0.0 || o->mu[i] > 0.0 || (MODEL_DIRECTED && o->lower[i] < 0.0);
    o->state[i] = (signed char)(room ? 0 : trial->before[c] == CONTACT_SLIP_MINUS ? 1 : -1);
}

/* effect of the force of contact e on the rate of c, with that of its friction where this is known to slip */
static double effect_with_drag(const Run *r, const ContactBox *o, int c, int e)
{
    const int friction = model_contact_impulsive[e] ? model_contact_partner[e] : -1;
    double sum = r->scratch.G[c][e][0];
    if (friction >= 0 && o->unknown[friction] < 0) {
        const int state = r->at.state[friction];
        const int sign = state == CONTACT_SLIP_PLUS ? 1 : state == CONTACT_SLIP_MINUS ? -1 : 0;
        sum -= sign * model_friction(r->at.p, r->at.d, friction) * r->scratch.G[c][friction][0];
    }
    return sum;
}

/* rates without the forces of the unknown ones, what these add to them, and their bounds */
static RARE void set_order_0(Run *r, const Trial *trial, ContactBox *o)
{
    int n = 0;
    for (int c = 0; c < MODEL_NC; c++)
        o->unknown[c] = -1;
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        if (cone_is_whole(c)) {
            r->at.state[c] = CONTACT_STICK;
            r->at.known[c][SLOT_TANGENTIAL] = 1; /* slip would begin here */
        } else if (model_contact_sticks[c] || model_contact_impulsive[c]) {
            r->at.state[c] = CONTACT_AWAY;
            o->unknown[c] = n;
            o->contact[n++] = c;
        } else if (r->at.state[c] == CONTACT_STICK || r->at.state[c] == CONTACT_AWAY) {
            r->at.state[c] = CONTACT_SLIP_PLUS;
        }
    }
    cones_follow(r);
    taylor_load(r, &r->scratch);
    taylor_field(r, &r->scratch, 0);
    for (int i = 0; i < n; i++)
        o->b[i] = fit_slip_rate(r, &r->scratch, o->contact[i], &o->size[i]);
    for (int i = 0; i < n; i++) {
        set_bounds(r, trial, o, i);
        for (int e = 0; e < n; e++)
            o->G[i * n + e] = effect_with_drag(r, o, o->contact[i], o->contact[e]);
    }
    contact_box_close(o, n, r->tolerances.margin);
}

/* states by order 0; where it has no solution those of the last attempt */
static RARE void choose_by_order_0(Run *r, Trial *trial)
{
    ContactBox o;
    set_order_0(r, trial, &o);
    contact_box_solve(&o, 1);
    for (int i = 0; i < o.problem.n; i++) {
        const int c = o.contact[i];
        if (model_contact_impulsive[c]) {
            const int closed = trial->before[c] == CONTACT_CHATTERING ? CONTACT_CHATTERING : CONTACT_TOUCHING;
            r->at.state[c] = (signed char)(o.state[i] == 0 ? closed : CONTACT_AWAY);
        } else {
            r->at.state[c] = (signed char)(o.state[i] == 0 ? CONTACT_STICK : -o.state[i]);
        }
    }
    follow_rigid(r, trial);
}

/* change what does not fit by its series until all do; 1 if they do */
static RARE int settle_ties(Run *r, Trial *trial)
{
    enum { PATIENCE = 10 };
    int least = trial->count + 1;
    int patience = PATIENCE;
    for (int round = 0; round < 3 * PATIENCE + 4 * trial->count; round++) {
        signed char wanted[NC];
        int misfits = 0;
        int last = -1;
        trial->series_order = 0;
        taylor_load(r, &r->scratch);
        taylor_field(r, &r->scratch, 0);
        for (int i = 0; i < trial->count; i++) {
            const int c = trial->contact[i];
            wanted[c] = fit_wanted_state(r, trial, c);
            if (wanted[c] != r->at.state[c]) {
                misfits++;
                last = c;
            }
        }
        if (misfits == 0) return 1;
        patience = misfits < least ? PATIENCE : patience - 1;
        least = misfits < least ? misfits : least;
        for (int i = 0; i < trial->count && patience > 0; i++)
            r->at.state[trial->contact[i]] = wanted[trial->contact[i]];
        r->at.state[last] = wanted[last];
        follow_rigid(r, trial);
    }
    return 0;
}

static RARE int search(Run *r, Trial *trial)
{
    choose_by_order_0(r, trial);
    return settle_ties(r, trial);
}

/* held candidates, and those on the wrong side of zero, are moved to it */
static RARE int project(Run *r, const Trial *trial)
{
    signed char member[NC] = {0};
    int any = 0;
    taylor_load(r, &r->scratch);
    taylor_field(r, &r->scratch, 0);
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        if (cone_is_whole(c)) {
            for (int s = c + 1; s <= c + 2; s++)
                member[s] = r->projected[s] = 1;
            any = 1;
            continue;
        }
        const double slip = r->scratch.slip[c][0];
        const double side = model_contact_impulsive[c] ? 1.0 : r->scratch.sign[c];
        const double lever = model_lever(r->at.p, r->at.d, &r->scratch, c);
        const int beyond = (r->at.state[c] != CONTACT_AWAY || model_contact_impulsive[c]) && side * slip < 0.0;
        /* a switch without a jump of the flow has nothing to move the states with */
        member[c] = contact_is_held(r->at.state, c) ? placement_has_lever(r, c) : beyond && lever > r->tolerances.lever;
        any |= member[c];
        r->projected[c] |= member[c];
        if (r->at.state[c] != CONTACT_STICK) stick_unweighted(&r->scratch, c);
    }
    return any && contact_project(&r->at, &r->scratch, member, r->at.state);
}

static RARE RunStatus no_state(Run *r, const Trial *trial)
{
    char names[128];
    int rubs = 0;
    run_name_contacts(trial->contact, trial->count, names, sizeof names);
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        const int friction = model_contact_impulsive[c] ? model_contact_partner[c] : -1;
        rubs |= friction >= 0 && model_friction(r->at.p, r->at.d, friction) > 0.0;
    }
    if (!rubs) {
        return run_fail(r,
                        "the states of %s cannot be told apart at t = %.17g: their forces and rates agree to rounding, "
                        "in an order that decides nothing; move a start value or a parameter by a little",
                        names, r->at.time);
    }
    return run_fail(
        r,
        "no states of %s fit the motion at t = %.17g: with so much friction a closed rigid contact can neither hold "
        "nor open (Painleve); lower its coefficient of friction",
        names, r->at.time);
}

CALLED RunStatus selection_make(Run *r, const signed char *candidate, const signed char *at_limit, int *moved)
{
    /* between a margin too negative to be a tie and a rate of slip too small not to be one nothing fits: then look less
       closely */
    const double COARSER = 1e3;
    Trial trial = {.count = 0, .at_limit = at_limit, .tie = r->tolerances.margin};
    int rigid = 0;
    cones_follow(r);
    memcpy(trial.before, r->at.state, sizeof trial.before);
    for (int c = 0; c < MODEL_NC; c++) {
        if (candidate[c]) {
            trial.contact[trial.count++] = c;
            rigid |= model_contact_impulsive[c];
        }
        trial.slip[c] = r->scratch.slip[c][0];
    }
    if (trial.count == 0) return RUN_OK;
    int found = search(r, &trial);
    if (!found && rigid) {
        trial.tie *= COARSER;
        found = search(r, &trial);
    }
    if (!found) {
        memcpy(r->at.state, trial.before, sizeof trial.before);
        if (rigid) return no_state(r, &trial);
        for (int i = 0; i < trial.count; i++)
            trial.zeros[trial.contact[i]] = 1;
    }
    for (int i = 0; i < trial.count; i++) {
        const int c = trial.contact[i];
        const int opens = model_contact_impulsive[c] && r->at.state[c] == CONTACT_AWAY;
        /* the gap has one zero more than its rate */
        r->at.known[c][model_contact_impulsive[c] ? SLOT_NORMAL : SLOT_TANGENTIAL] =
            (signed char)(trial.zeros[c] + (opens && trial.zeros[c] < ALL_ZERO));
    }
    *moved |= project(r, &trial);
    return RUN_OK;
}
