/*
 * Which friction contacts stick and which slip, which rigid contacts stay closed and which open, from one instant on.
 *
 *     choose:     of all assignments {stick, slip+, slip-} and {closed, open} to the candidates, most held first, the
 *                 first in which
 *                     every sticking candidate    has margin = capacity - |force| > 0, and its slip stays at rest
 *                     every slipping candidate    has sign * (rate of slip) > 0
 *                     every closed candidate      has force > 0, and its gap stays zero
 *                     every opening candidate     has a gap with a positive second derivative
 *                 The friction of a rigid contact is away where that opens.
 *                 a quantity that is zero within its tolerance is a tie: it is decided by the first coefficient of its
 *                 Taylor series that is not. That number of zeros is remembered, so that the search for the next event
 *                 does not find the one just resolved (a release has zero slip and zero rate of slip).
 *     project:    velocities onto zero slip of the contacts that stick, or that leave zero slip on its wrong side
 *
 * With friction alone, no assignment fits only if rounding decides; then every candidate keeps its state. Closed rigid
 * contacts with much friction can be without any (Painleve); that is an error, which names them.
 */
#include "mode_selection.h"

#include "../step/contact_forces.h"
#include "../step/taylor.h"

enum { TIE_ORDER = 8, MAX_CANDIDATES = 12, ALL_ZERO = MODEL_TERMS };

typedef struct {
    int count;
    int contact[NC];
    const signed char *at_limit; /* sticking contacts whose margin is zero by construction, whatever rounding says */
    signed char before[NC];
    double slip[NC];  /* slip speeds at the instant */
    int series_order; /* orders of the trial's series in r->scratch, 0 if only order 0 is there */
    double length;
    signed char zeros[NC]; /* leading zeros of the indicator of each candidate in this trial */
    double tie;            /* a stick margin below this fraction of the capacity is one */
} Trial;

/* the largest term of c[from..order] over length */
static double largest_term(const double *c, int from, int order, double length)
{
    double largest = 0.0;
    for (int k = from; k <= order; k++) {
        largest = fmax(largest, fabs(c[k]) * pow(length, k));
    }
    return largest;
}

/* the sign of the first coefficient of c[from..order] whose term over length exceeds floor, 0 if none does; from moves
   to it */
static int first_sign(const double *c, int order, double length, double floor, int *from)
{
    for (int k = *from; k <= order; k++) {
        if (fabs(c[k]) * pow(length, k) > floor) {
            *from = k;
            return c[k] > 0.0 ? 1 : -1;
        }
    }
    return 0;
}

/* the zeros of a series that has just fallen to zero: two if it comes back before it is below -floor, else one */
static int zeros_at_fall(const double *c, double floor)
{
    return c[1] < 0.0 && c[2] > 0.0 && c[1] * c[1] <= 4.0 * c[2] * floor ? 2 : 1;
}

/* the trial's series to a few orders, for ties */
static void expand(Run *r, Trial *trial)
{
    if (trial->series_order == 0) {
        taylor_series(r, &r->scratch, TIE_ORDER, INFINITY);
        trial->series_order = TIE_ORDER;
        trial->length = taylor_time_scale(r, &r->scratch, TIE_ORDER);
    }
}

/* rate of the slip speed at order 0, contact forces included, and the sum of the magnitudes of its terms */
static double slip_acceleration(const Run *r, Jets *j, int c, double *magnitude)
{
    if (!contact_is_held(r->at.state, c)) {
        const double capacity = j->capacity[c][0]; /* of the friction of a rigid contact: not the model's to say */
        model_stick(r->at.p, r->at.d, j, 0, c);
        j->capacity[c][0] = model_contact_partner[c] >= 0 ? capacity : j->capacity[c][0];
    }
    double sum = j->slip_rate[c][0];
    *magnitude = fabs(sum);
    if (MODEL_IMPACTS > 0) {
        *magnitude = fmax(*magnitude, model_rate_magnitude(r->at.p, r->at.d, j, c));
    }
    for (int e = 0; e < MODEL_NC; e++) {
        const double term = j->G[c][e][0] * j->force[e][0];
        sum += term;
        *magnitude += fabs(term);
    }
    return sum;
}

/* whether the rigid contact whose friction c is has no force, but for rounding */
static int unloaded(Run *r, int c)
{
    const int normal = model_contact_partner[c];
    double magnitude;
    slip_acceleration(r, &r->scratch, normal, &magnitude);
    return fabs(r->scratch.force[normal][0]) <= r->tolerances.margin * magnitude / r->scratch.G[normal][normal][0];
}

/* with the force of its rigid contact, what friction can hold starts at zero: it must grow faster than what it has to
   hold */
static int stick_starts_unloaded(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double magnitude;
    if (fabs(slip_acceleration(r, j, c, &magnitude)) > r->tolerances.margin * magnitude) {
        return 0;
    }
    const double floor = r->tolerances.slip * magnitude / j->G[c][c][0];
    expand(r, trial);
    for (int side = -1; side <= 1; side += 2) {
        double series[TIE_ORDER];
        for (int k = 0; k < TIE_ORDER; k++) {
            series[k] = j->capacity[c][k] - side * j->force[c][k];
        }
        int zeros = 0;
        if (first_sign(series, TIE_ORDER - 1, trial->length, floor, &zeros) <= 0) {
            return 0;
        }
        trial->zeros[c] = (signed char)(zeros > trial->zeros[c] ? zeros : trial->zeros[c]);
    }
    return 1;
}

static int stick_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    const double capacity = j->capacity[c][0];
    const double tolerance = r->tolerances.margin;
    double magnitude;
    trial->zeros[c] = 0;
    /* a rigid contact about to push has no load yet */
    if (model_contact_partner[c] >= 0 && unloaded(r, c)) {
        return stick_starts_unloaded(r, trial, c);
    }
    /* without load nothing holds; where the force would drive the slip away from zero nothing holds for long */
    if (!(capacity > 0.0) || !(j->G[c][c][0] > 0.0)) {
        return 0;
    }
    /* contacts that constrain the same motion in different ways cannot all stick */
    if (fabs(slip_acceleration(r, j, c, &magnitude)) > tolerance * magnitude) {
        return 0;
    }
    const double margin = capacity - fabs(j->force[c][0]);
    if (!trial->at_limit[c] && fabs(margin) > trial->tie * capacity) {
        return margin > 0.0;
    }
    expand(r, trial);
    const double side = j->force[c][0] > 0.0 ? 1.0 : -1.0;
    double series[TIE_ORDER];
    for (int k = 0; k < TIE_ORDER; k++) {
        series[k] = j->capacity[c][k] - side * j->force[c][k];
    }
    int zeros = zeros_at_fall(series, r->tolerances.slip * capacity);
    const int sign = first_sign(series, TIE_ORDER - 1, trial->length, r->tolerances.slip * capacity, &zeros);
    trial->zeros[c] = (signed char)zeros;
    /* a margin that stays at zero: one that was seen to fall has let go, one that started there holds */
    return sign > 0 || (sign == 0 && !trial->at_limit[c]);
}

/* a closed rigid contact that pushes */
static int closed_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double magnitude;
    trial->zeros[c] = 0;
    if (fabs(slip_acceleration(r, j, c, &magnitude)) > r->tolerances.margin * magnitude) {
        return 0;
    }
    const double scale = magnitude / j->G[c][c][0];
    if (!trial->at_limit[c] && fabs(j->force[c][0]) > r->tolerances.margin * scale) {
        return j->force[c][0] > 0.0;
    }
    expand(r, trial);
    int zeros = zeros_at_fall(j->force[c], r->tolerances.slip * scale);
    const int sign = first_sign(j->force[c], TIE_ORDER - 1, trial->length, r->tolerances.slip * scale, &zeros);
    trial->zeros[c] = (signed char)(sign == 0 ? ALL_ZERO : zeros);
    /* a force that stays at zero: one that was seen to fall has let go, one that started there holds */
    return sign > 0 || (sign == 0 && !trial->at_limit[c]);
}

/* y leaves zero to the side of the sign: slip of friction, rate of the gap of a rigid contact */
static int leaves_zero(Run *r, Trial *trial, int c, double sign)
{
    Jets *j = &r->scratch;
    double magnitude;
    const double rate = sign * slip_acceleration(r, j, c, &magnitude);
    const int decides = fabs(rate) > r->tolerances.margin * magnitude;
    trial->zeros[c] = 1;
    if (decides && !(trial->at_limit[c] && model_contact_is_impact[c])) {
        return rate > 0.0;
    }
    expand(r, trial);
    /* the force of a rigid contact has just fallen to zero, and a single term can do that: what it leaves is
       rounding */
    if (decides
        && fabs(rate) * trial->length > r->tolerances.margin * largest_term(j->slip[c], 2, TIE_ORDER, trial->length)) {
        return rate > 0.0;
    }
    double series[TIE_ORDER + 1];
    for (int k = 0; k <= TIE_ORDER; k++) {
        series[k] = sign * j->slip[c][k];
    }
    int zeros = 2;
    const double largest = largest_term(series, zeros, TIE_ORDER, trial->length);
    if (j->force[c][0] == 0.0 && largest <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, j, c)) {
        trial->zeros[c] = ALL_ZERO; /* a contact that carries no force may ride along at zero slip for good */
        return 1;
    }
    const int leaves = first_sign(series, TIE_ORDER, trial->length, r->tolerances.margin * largest, &zeros);
    trial->zeros[c] = (signed char)zeros;
    return leaves > 0;
}

/* whether the states now in r are consistent for every candidate */
static int holds(Run *r, Trial *trial)
{
    Jets *j = &r->scratch;
    trial->series_order = 0;
    taylor_load(r, j);
    taylor_field(r, j, 0);
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        int fits;
        if (model_contact_is_impact[c]) {
            fits = contact_is_held(r->at.state, c) ? closed_holds(r, trial, c) : leaves_zero(r, trial, c, 1.0);
        } else if (r->at.state[c] == CONTACT_AWAY) {
            fits = 1; /* with the rigid contact whose friction it is */
        } else {
            fits = r->at.state[c] == CONTACT_STICK ? stick_holds(r, trial, c) : leaves_zero(r, trial, c, j->sign[c]);
        }
        if (!fits) {
            return 0;
        }
    }
    return 1;
}

/* the friction of a rigid contact goes with it; 0 if a candidate would be counted twice by that */
static int follow_rigid(Run *r, const Trial *trial, int c, int choice)
{
    const int normal = model_contact_partner[c];
    if (normal >= 0 && r->at.state[normal] == CONTACT_AWAY) {
        r->at.state[c] = CONTACT_AWAY;
        return choice == 0;
    }
    if (r->at.state[c] == CONTACT_AWAY) {
        r->at.state[c] = trial->slip[c] < 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
    }
    return 1;
}

/* write assignment number code into r's states; the number of contacts held, or -1 where it is none */
static int assign(Run *r, const Trial *trial, long code)
{
    signed char choice[NC] = {0};
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        const int choices = model_contact_is_impact[c] ? 2 : 3;
        choice[c] = (signed char)(code % choices);
        code /= choices;
        if (model_contact_is_impact[c]) {
            const int closed = trial->before[c] == CONTACT_CHATTERING ? CONTACT_CHATTERING : CONTACT_TOUCHING;
            r->at.state[c] = (signed char)(choice[c] == 0 ? closed : CONTACT_AWAY);
            continue;
        }
        /* the sign a contact had comes before the other: where both fit, nothing changes */
        const int sign = trial->before[c] == CONTACT_SLIP_MINUS ? -1 : 1;
        const int state = choice[c] == 0 ? CONTACT_STICK : choice[c] == 1 ? sign : -sign;
        if (state == CONTACT_STICK && !model_contact_sticks[c]) {
            return -1;
        }
        r->at.state[c] = (signed char)state;
    }
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        if (!model_contact_is_impact[c] && model_contact_partner[c] >= 0 && !follow_rigid(r, trial, c, choice[c])) {
            return -1;
        }
    }
    int held = 0;
    for (int i = 0; i < trial->count; i++) {
        held += contact_is_held(r->at.state, trial->contact[i]);
    }
    return held;
}

static int search(Run *r, Trial *trial)
{
    long codes = 1;
    for (int i = 0; i < trial->count; i++) {
        codes *= model_contact_is_impact[trial->contact[i]] ? 2 : 3;
    }
    for (int held = trial->count; held >= 0; held--) {
        for (long code = 0; code < codes; code++) {
            if (assign(r, trial, code) == held && holds(r, trial)) {
                return 1;
            }
        }
    }
    return 0;
}

/* held candidates, and those on the wrong side of zero, are moved to it */
static int project(Run *r, const Trial *trial)
{
    signed char member[NC] = {0};
    int any = 0;
    taylor_load(r, &r->scratch);
    taylor_field(r, &r->scratch, 0);
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        const double slip = r->scratch.slip[c][0];
        /* a switch without a jump of the flow has nothing to move the states with */
        const double side = model_contact_is_impact[c] ? 1.0 : r->scratch.sign[c];
        member[c] = r->scratch.G[c][c][0] != 0.0
                    && (contact_is_held(r->at.state, c) || (r->at.state[c] != CONTACT_AWAY && side * slip < 0.0)
                        || (model_contact_is_impact[c] && slip < 0.0));
        any |= member[c];
        r->projected[c] |= member[c];
        if (r->at.state[c] != CONTACT_STICK) {
            r->scratch.capacity[c][0] = 0.0; /* no weight of its own where the law has no capacity */
        }
    }
    return any && contact_project(&r->at, &r->scratch, member);
}

static RunStatus no_state(Run *r, const Trial *trial)
{
    char names[128];
    run_name_contacts(trial->contact, trial->count, names, sizeof names);
    return run_fail(
        r,
        "no states of %s fit the motion at t = %.17g: with so much friction a closed rigid contact can neither hold "
        "nor open (Painleve); lower its coefficient of friction",
        names, r->at.time);
}

RunStatus selection_make(Run *r, const signed char *candidate, const signed char *at_limit, int *moved)
{
    /* between a margin too negative to be a tie and a rate of slip too small not to be one nothing fits: then look less
       closely */
    const double COARSER = 1e3;
    Trial trial = {.count = 0, .at_limit = at_limit, .tie = r->tolerances.margin};
    int rigid = 0;
    memcpy(trial.before, r->at.state, sizeof trial.before);
    for (int c = 0; c < MODEL_NC; c++) {
        if (candidate[c] && trial.count < MAX_CANDIDATES) {
            trial.contact[trial.count++] = c;
            rigid |= model_contact_is_impact[c];
        }
        trial.slip[c] = r->scratch.slip[c][0];
    }
    if (trial.count == 0) {
        return RUN_OK;
    }
    int found = search(r, &trial);
    if (!found && rigid) {
        trial.tie *= COARSER;
        found = search(r, &trial);
    }
    if (!found) {
        memcpy(r->at.state, trial.before, sizeof trial.before);
        if (rigid) {
            return no_state(r, &trial);
        }
        for (int i = 0; i < trial.count; i++) {
            trial.zeros[trial.contact[i]] = 1;
        }
    }
    for (int i = 0; i < trial.count; i++) {
        const int c = trial.contact[i];
        const int opens = model_contact_is_impact[c] && r->at.state[c] == CONTACT_AWAY;
        /* the gap has one zero more than its rate */
        r->at.known[c][model_contact_is_impact[c] ? SLOT_NORMAL : SLOT_TANGENTIAL] =
            (signed char)(trial.zeros[c] + (opens && trial.zeros[c] < ALL_ZERO));
    }
    *moved |= project(r, &trial);
    return RUN_OK;
}
