/*
 * Where indicators fall to zero on a step: first fall of each indicator's own polynomial, its known zeros divided out.
 */
#include "event_location.h"

#include "cone_rest.h"
#include "roots.h"

int location_indicator(const Run *r, int c, Slot slot)
{
    const int state = r->at.state[c];
    if (slot == SLOT_NORMAL) {
        if (!model_contact_bounded[c]) return 0;
        return state == CONTACT_AWAY ? -1 : 1;
    }
    if (model_contact_impulsive[c] || cone_is_side(c)) return 0;
    if (model_contact_compliant[c])
        return !model_contact_releases[c] || state == CONTACT_AWAY ? 0 : state == CONTACT_TOUCHING ? 1 : -1;
    return state == CONTACT_AWAY ? 0 : state == CONTACT_SLIP_MINUS ? -1 : 1;
}

/* first fall of sign * series to zero within h, its first known coefficients taken as zero; -1 if none, or none that
   matters beside one of another at `first` */
static double fall_of(const double *series, double sign, int known, int order, double h, double first)
{
    const double BEYOND = 1.0 + 0x1p-20; /* at the same instant, but for rounding */
    if (known >= order) return -1.0;     /* all its terms vanish over this step */
    return fall_until(series + known, order - known, sign, h, fmin(BEYOND * first, h));
}

/* the same for a function of a body at a bound: what starts at rest there has more zeros than the event knows */
static double fall_from_bound(const double *series, double sign, int known, int order, double h, double first)
{
    while (known < order && series[known] == 0.0)
        known++;
    return fall_of(series, sign, known, order, h, first);
}

/*
 * the gap of an open rigid contact. Beyond `exact` its series is known roughly only, to within the last two of its
 * terms: where the gap may be that small the step has to end; nothing falls yet.
 */
static double fall_of_gap(const Jets *j, int c, int known, int order, double h, double exact, double *end)
{
    while (known < order && j->depth[c][known] == 0.0)
        known++;
    if (h > exact && known < order) {
        /* divided by s^known, like the series */
        const double error = (fabs(j->depth[c][order]) * h + fabs(j->depth[c][order - 1])) * pow(h, order - 1 - known);
        const double safe = safe_length(j->depth[c] + known, order - known, -1.0, h, error);
        if (safe > exact) {
            *end = fmin(*end, safe);
            return -1.0;
        }
        *end = fmin(*end, exact);
    }
    return fall_of(j->depth[c], -1.0, known, order, fmin(h, exact), *end);
}

/* the sum of the terms of a series over h */
static double sum_of_terms(const double *series, int order, double h)
{
    double sum = 0.0;
    for (int k = order; k >= 0; k--)
        sum = sum * h + fabs(series[k]);
    return sum;
}

/* whether a way comes no farther, over this step, than the rounding of what is left of it to a bound */
static int way_rests(const Run *r, const Jets *j, int c, int order, double h)
{
    const int held = r->at.state[c] == CONTACT_STICK;
    const double time = r->segment_rooted ? h * h : h;
    const double way = held ? sum_of_terms(j->force[c], order - 1, h) * time : sum_of_terms(j->slip[c], order, h);
    return way <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, j, c);
}

/* first fall of the margin of a sticking contact */
static double fall_of_margin(const Run *r, const Jets *j, int c, int known, int order, double h, double end)
{
    /* the load of a rigid contact that is about to push starts at zero, and so do both margins */
    const int both = model_contact_partner[c] >= 0 && r->at.known[(int)model_contact_partner[c]][SLOT_NORMAL] > 0;
    double first = -1.0;
    if (cone_is_whole(c)) {
        double margin[POLYNOMIAL_TERMS];
        cone_margin(j, c, order - 1, margin);
        return fall_of(margin, 1.0, known, order - 1, h, end);
    }
    for (int side = -1; side <= 1; side += 2) {
        double margin[POLYNOMIAL_TERMS];
        for (int k = 0; k < order; k++)
            margin[k] = stick_bound(j, c, side)[k] - side * j->force[c][k];
        /* a margin that starts at zero does so on one side only */
        const double fall = fall_of(margin, 1.0, both || side == stick_side(j, c) ? known : 0, order - 1, h, end);
        if (fall >= 0.0 && (first < 0.0 || fall < first)) first = fall;
    }
    return first;
}

/* whether a slip is no more than the rounding of the forces that others hold at rest: none of what it does is an event */
static int rests_by_others(const Run *r, const Jets *j, int c, int order, double h)
{
    int others = 0;
    double rate = 0.0;
    for (int e = 0; e < MODEL_NC; e++) {
        others |= e != c && contact_is_held(r->at.state, e);
        rate += fabs(j->G[c][e][0] * j->force[e][0]);
    }
    const double time = r->segment_rooted ? h * h : h;
    return others && sum_of_terms(j->slip[c], order, h) <= r->tolerances.slip * rate * time;
}

/* the end of a chatter */
static double settling(const Run *r, int c, double h)
{
    const double wait = fmax(r->at.settles[c] - r->at.time, 0.0);
    const double end = r->segment_rooted ? sqrt(wait) : wait;
    return end <= h ? end : -1.0;
}

static double fall_in_slot(const Run *r, const Jets *j, int c, Slot slot, int order, double h, double exact,
                           double *end)
{
    const int sign = location_indicator(r, c, slot);
    const int known = r->at.known[c][slot] * time_power(r->segment_rooted);
    if (sign == 0) return -1.0;
    if (slot == SLOT_NORMAL && contact_is_closed(r, c)) {
        if (r->at.state[c] == CONTACT_CHATTERING) return settling(r, c, h);
        return fall_from_bound(j->force[c], sign, known, order - 1, h, *end);
    }
    if (slot == SLOT_NORMAL) {
        return contact_is_open(r, c) ? fall_of_gap(j, c, known, order, h, exact, end)
                                     : fall_from_bound(j->depth[c], sign, known, order, h, *end);
    }
    if (contact_is_settling(r, c)) return settling(r, c, h);
    if (model_contact_compliant[c]) return fall_from_bound(j->release[c], sign, known, order, h, *end);
    const int held = r->at.state[c] == CONTACT_STICK;
    const double fall = held ? fall_of_margin(r, j, c, known, order, h, *end)
                             : fall_of(j->slip[c], sign, known, order, h, *end);
    if (fall < 0.0) return -1.0;
    const int rests = (contact_yields(c) && way_rests(r, j, c, order, h))
                      || (!held && rests_by_others(r, j, c, order, h));
    return rests ? -1.0 : fall;
}

double location_cut(Run *r, int order, double h, double exact)
{
    double falls[MODEL_ROOM(MODEL_NC)][SLOTS];
    double first = h;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = SLOTS - 1; slot >= 0; slot--) { /* a stop lets go before it is left */
            /* over the whole step: cut at another's fall, one at the same instant could hide behind its rounding */
            falls[c][slot] = fall_in_slot(r, &r->jets, c, (Slot)slot, order, h, exact, &first);
            if (falls[c][slot] >= 0.0) first = fmin(first, falls[c][slot]);
        }
    }
    h = first;
    r->segment_event = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            r->falling[c][slot] = falls[c][slot] >= 0.0 && falls[c][slot] <= h * (1.0 + 4.0 * DBL_EPSILON);
            r->segment_event |= r->falling[c][slot];
        }
    }
    return h;
}
