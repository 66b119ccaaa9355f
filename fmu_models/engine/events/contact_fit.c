/*
 * Whether a contact fits its state from one instant on, with all contacts in the states that they have now.
 *
 *     sticking    margin = bound - |force| > 0 on the nearer side, and its slip stays at rest; of a cone (two directions)
 *                 bound^2 - |force|^2
 *     slipping    sign * (rate of slip) > 0
 *     closed      force > 0, and its gap stays zero
 *     opening     the gap has a positive second derivative
 *
 * A quantity that is zero within its tolerance is a tie: it is decided by the first coefficient of its Taylor series
 * that is not. That number of zeros is remembered, so that the search for the next event does not find the one just
 * resolved (a release has zero slip and zero rate of slip).
 */
#include "contact_fit.h"

#include "../step/cone_rest.h"
#include "../step/contact_forces.h"
#include "../step/taylor.h"
#include "contact_placement.h"

enum { TIE_ORDER = 8 };

/* the largest term of c[from..order] over length */
static double largest_term(const double *c, int from, int order, double length)
{
    double largest = 0.0;
    for (int k = from; k <= order; k++)
        largest = fmax(largest, fabs(c[k]) * pow(length, k));
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

double fit_slip_rate(const Run *r, Jets *j, int c, double *magnitude)
{
    if (!contact_is_held(r->at.state, c)) {
        const double capacity = j->capacity[c][0];
        model_stick(r->at.p, r->at.d, j, 0, c);
        if (model_contact_partner[c] >= 0) { /* not the model's to say */
            j->capacity[c][0] = capacity;
            stick_mirror(j, c, 0);
        }
    }
    double sum = j->slip_rate[c][0];
    *magnitude = fabs(sum);
    if (MODEL_IMPACTS > 0 || MODEL_YIELDS) *magnitude = fmax(*magnitude, model_rate_magnitude(r->at.p, r->at.d, j, c));
    if (contact_may_rest(c)) *magnitude = fmax(*magnitude, j->G[c][c][0] * stick_scale(j, c));
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const double term = j->G[c][model_joined[n]][0] * j->force[model_joined[n]][0];
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
    fit_slip_rate(r, &r->scratch, normal, &magnitude);
    return fabs(r->scratch.force[normal][0]) <= r->tolerances.margin * magnitude / r->scratch.G[normal][normal][0];
}

/* with the force of its rigid contact, what friction can hold starts at zero: it must grow faster than what it has to
   hold */
static int stick_starts_unloaded(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double magnitude;
    if (fabs(fit_slip_rate(r, j, c, &magnitude)) > r->tolerances.margin * magnitude) return 0;
    const double floor = r->tolerances.slip * magnitude / j->G[c][c][0];
    expand(r, trial);
    for (int side = -1; side <= 1; side += 2) {
        double series[TIE_ORDER];
        for (int k = 0; k < TIE_ORDER; k++)
            series[k] = stick_bound(j, c, side)[k] - side * j->force[c][k];
        int zeros = 0;
        if (first_sign(series, TIE_ORDER - 1, trial->length, floor, &zeros) <= 0) return 0;
        trial->zeros[c] = (signed char)(zeros > trial->zeros[c] ? zeros : trial->zeros[c]);
    }
    return 1;
}

/* by how much a function changes between two numbers of the time, where the model reads it: narrow pulses in capacities
   and forces cross zero between them */
static double rounding_of_time(const Run *r, const double *series)
{
    return 4.0 * DBL_EPSILON * fabs(r->at.time) * fabs(series[1]);
}

/* a contact that sticks */
static int stick_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    const double capacity = stick_scale(j, c);
    const double tolerance = r->tolerances.margin;
    double magnitude;
    trial->zeros[c] = 0;
    /* a rigid contact about to push has no load yet */
    if (model_contact_partner[c] >= 0 && unloaded(r, c)) return stick_starts_unloaded(r, trial, c);
    /* without load nothing holds; where the force would drive the slip away from zero nothing holds for long */
    if (!fit_can_stick(r, c)) return 0;
    /* contacts that constrain the same motion in different ways cannot all stick */
    if (fabs(fit_slip_rate(r, j, c, &magnitude)) > tolerance * magnitude) return 0;
    const int side = stick_side(j, c);
    const double *bound = stick_bound(j, c, side);
    const double margin = bound[0] - side * j->force[c][0];
    if (!trial->at_limit[c] && fabs(margin) > trial->tie * capacity) return margin > 0.0;
    expand(r, trial);
    double series[TIE_ORDER];
    for (int k = 0; k < TIE_ORDER; k++)
        series[k] = bound[k] - side * j->force[c][k];
    const double floor = r->tolerances.slip * capacity + rounding_of_time(r, series);
    int zeros = zeros_at_fall(series, floor);
    const int sign = first_sign(series, TIE_ORDER - 1, trial->length, floor, &zeros);
    trial->zeros[c] = (signed char)(sign == 0 && !trial->at_limit[c] ? ALL_ZERO : zeros);
    /* a margin that stays at zero: one that was seen to fall has let go, one that started there holds */
    return sign > 0 || (sign == 0 && !trial->at_limit[c]);
}

/* a closed rigid contact that pushes */
static int closed_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double magnitude;
    trial->zeros[c] = 0;
    if (fabs(fit_slip_rate(r, j, c, &magnitude)) > r->tolerances.margin * magnitude) return 0;
    const double scale = magnitude / j->G[c][c][0];
    if (!trial->at_limit[c] && fabs(j->force[c][0]) > r->tolerances.margin * scale) return j->force[c][0] > 0.0;
    expand(r, trial);
    const double floor = r->tolerances.slip * scale + rounding_of_time(r, j->force[c]);
    int zeros = zeros_at_fall(j->force[c], floor);
    const int sign = first_sign(j->force[c], TIE_ORDER - 1, trial->length, floor, &zeros);
    trial->zeros[c] = (signed char)(sign == 0 ? ALL_ZERO : zeros);
    /* a force that stays at zero: one that was seen to fall has let go, one that started there holds */
    return sign > 0 || (sign == 0 && !trial->at_limit[c]);
}

/* whether a contact may stay at zero slip for good without being held: it carries no force or none that matters, or
   others hold its motion and it gives all that it can */
static int rides(const Run *r, int c)
{
    int others = 0;
    for (int e = 0; e < MODEL_NC; e++)
        others |= e != c && contact_is_held(r->at.state, e);
    return others || r->scratch.force[c][0] == 0.0 || !placement_has_lever(r, c);
}

/* what the terms of the rate of y make of it over the trial's length: of a contact that others hold at rest they cancel,
   and y is what rounding leaves of them */
static double speed_of_forces(const Run *r, const Trial *trial, int c, double magnitude)
{
    double sum = magnitude;
    for (int e = 0; e < MODEL_NC; e++)
        sum += fabs(r->scratch.G[c][e][0]) * largest_term(r->scratch.force[e], 1, TIE_ORDER - 1, trial->length);
    return sum * trial->length;
}

/* a way that turns is what ends the yielding of a bound: its speed, the rate of y, is rounding there, of no terms */
static int way_turns(const Trial *trial, int c) { return contact_yields(c) && trial->at_limit[c]; }

/* a way that turns so soon that what is left to a bound is zero until then, but for rounding */
static int way_is_turning(Run *r, Trial *trial, int c, double sign)
{
    Jets *j = &r->scratch;
    if (!contact_yields(c)) return 0;
    expand(r, trial);
    const double series[3] = {0.0, sign * j->slip[c][1], sign * j->slip[c][2]};
    return zeros_at_fall(series, r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, j, c)) == 2;
}

/* y leaves zero to the side of the sign: slip of friction, rate of the gap of a rigid contact */
static int leaves_zero(Run *r, Trial *trial, int c, double sign)
{
    Jets *j = &r->scratch;
    double magnitude;
    const double rate = sign * fit_slip_rate(r, j, c, &magnitude); /* of what may rest the second derivative */
    const int decides = fabs(rate) > r->tolerances.margin * magnitude && !way_turns(trial, c);
    trial->zeros[c] = (signed char)(1 + contact_may_rest(c));
    if (decides && rate < 0.0 && way_is_turning(r, trial, c, sign)) {
        trial->zeros[c] = 2;
        return 1;
    }
    if (decides && !trial->at_limit[c]) return rate > 0.0;
    expand(r, trial);
    /* what held it has just fallen to its bound. Of a rigid contact a single term can do that: what it leaves is
       rounding */
    const double rest = model_contact_impulsive[c]
                            ? r->tolerances.margin * largest_term(j->slip[c], 2, TIE_ORDER, trial->length)
                                  / trial->length
                            : rounding_of_time(r, j->slip[c] + trial->zeros[c]);
    if (decides && fabs(rate) > rest) return rate > 0.0;
    double series[TIE_ORDER + 1];
    for (int k = 0; k <= TIE_ORDER; k++)
        series[k] = sign * j->slip[c][k];
    int zeros = trial->zeros[c] + 1;
    const double largest = largest_term(series, zeros, TIE_ORDER, trial->length);
    const double terms = fmax(model_slip_magnitude(r->at.p, r->at.d, j, c), speed_of_forces(r, trial, c, magnitude));
    if (rides(r, c) && largest <= r->tolerances.slip * terms) {
        trial->zeros[c] = ALL_ZERO;
        return 1;
    }
    const int leaves = first_sign(series, TIE_ORDER, trial->length, r->tolerances.margin * largest, &zeros);
    trial->zeros[c] = (signed char)zeros;
    return leaves > 0;
}

void cones_follow(Run *r)
{
    for (int c = 0; c < MODEL_NC; c++)
        if (cone_is_whole(c)) r->at.state[c + 1] = r->at.state[c + 2] = r->at.state[c];
}

/* the state that a cone at zero slip has to be in: it sticks within its capacity, else its slip grows */
static signed char cone_wanted_state(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double series[TIE_ORDER + 1];
    const double capacity = j->capacity[c][0];
    if (r->at.state[c] == CONTACT_STICK) {
        trial->zeros[c] = 0;
        if (!(capacity > 0.0)) return CONTACT_SLIP_PLUS;
        cone_margin(j, c, 0, series);
        const double scale = capacity * capacity;
        if (!trial->at_limit[c] && fabs(series[0]) > 2.0 * trial->tie * scale)
            return series[0] > 0.0 ? CONTACT_STICK : CONTACT_SLIP_PLUS;
        expand(r, trial);
        cone_margin(j, c, TIE_ORDER - 1, series);
        const double floor = r->tolerances.slip * scale + rounding_of_time(r, series);
        int zeros = zeros_at_fall(series, floor);
        const int sign = first_sign(series, TIE_ORDER - 1, trial->length, floor, &zeros);
        trial->zeros[c] = (signed char)(sign == 0 && !trial->at_limit[c] ? ALL_ZERO : zeros);
        return sign > 0 || (sign == 0 && !trial->at_limit[c]) ? CONTACT_STICK : CONTACT_SLIP_PLUS;
    }
    const double held = capacity * (j->G[c + 1][c + 1][0] + j->G[c + 2][c + 2][0]);
    const double driven = fabs(j->slip_rate[c + 1][0]) + fabs(j->slip_rate[c + 2][0]);
    int zeros = 1;
    if (trial->at_limit[c] || fabs(j->slip[c][1]) <= r->tolerances.margin * (held + driven)) {
        zeros = 2;
        expand(r, trial);
        const double largest = largest_term(j->slip[c], zeros, TIE_ORDER, trial->length);
        memcpy(series, j->slip[c], sizeof series);
        const int sign = first_sign(series, TIE_ORDER, trial->length, r->tolerances.margin * largest, &zeros);
        trial->zeros[c] = (signed char)zeros;
        return sign > 0 || !(capacity > 0.0) ? CONTACT_SLIP_PLUS : CONTACT_STICK;
    }
    trial->zeros[c] = 1;
    return j->slip[c][1] > 0.0 || !(capacity > 0.0) ? CONTACT_SLIP_PLUS : CONTACT_STICK;
}

int fit_can_stick(const Run *r, int c)
{
    return model_contact_sticks[c] && stick_scale(&r->scratch, c) > 0.0 && r->scratch.G[c][c][0] > 0.0
           && placement_has_lever(r, c);
}

/* slip of the side that a contact goes to which cannot be held: that of its rate, or the one its force has kept it
   from */
static signed char yields_to(Run *r, const Trial *trial, int c)
{
    Jets *j = &r->scratch;
    double magnitude;
    const double rate = fit_slip_rate(r, j, c, &magnitude);
    if (!way_turns(trial, c) && fabs(rate) > r->tolerances.margin * magnitude)
        return rate > 0.0 ? CONTACT_SLIP_PLUS : CONTACT_SLIP_MINUS;
    return stick_side(j, c) > 0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
}

signed char fit_wanted_state(Run *r, Trial *trial, int c)
{
    const signed char state = r->at.state[c];
    if (cone_is_whole(c)) return state == CONTACT_AWAY ? state : cone_wanted_state(r, trial, c);
    if (model_contact_impulsive[c]) {
        const int closed = trial->before[c] == CONTACT_CHATTERING ? CONTACT_CHATTERING : CONTACT_TOUCHING;
        if (contact_is_held(r->at.state, c)) return closed_holds(r, trial, c) ? state : CONTACT_AWAY;
        return (signed char)(leaves_zero(r, trial, c, 1.0) ? state : closed);
    }
    if (state == CONTACT_AWAY) return state; /* with the rigid contact whose friction it is */
    if (state == CONTACT_STICK) return stick_holds(r, trial, c) ? state : yields_to(r, trial, c);
    if (leaves_zero(r, trial, c, r->scratch.sign[c])) return state;
    const int loaded = model_contact_partner[c] >= 0 || fit_can_stick(r, c);
    return (signed char)(loaded && placement_has_lever(r, c) ? CONTACT_STICK : -state);
}
