/*
 * Which friction contacts stick and which slip, from one instant on.
 *
 *     choose:     of all assignments {stick, slip+, slip-} to the candidates, most sticking first, the first in which
 *                     every sticking candidate    has margin = capacity - |force| > 0, and its slip stays at rest
 *                     every slipping candidate    has sign * (rate of slip) > 0
 *                 a quantity that is zero within its tolerance is a tie: it is decided by the first coefficient of its
 *                 Taylor series that is not. That number of zeros is remembered, so that the search for the next event
 *                 does not find the one just resolved (a release has zero slip and zero rate of slip).
 *     project:    velocities onto zero slip of the contacts that stick, or that leave zero slip on its wrong side
 *
 * No assignment fits only if rounding decides; then every candidate keeps its state.
 */
#include "engine.h"

enum { TIE_ORDER = 8, MAX_CANDIDATES = 7, ALL_ZERO = MODEL_TERMS };

typedef struct {
    int count;
    int contact[NC];
    const signed char *at_limit; /* sticking contacts whose margin is zero by construction, whatever rounding says */
    signed char before[NC];
    int series_order;            /* orders of the trial's series in r->scratch, 0 if only order 0 is there */
    double length;
    signed char zeros[NC];       /* leading zeros of the indicator of each candidate in this trial */
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

/* the sign of the first coefficient of c[from..order] whose term over length exceeds floor, 0 if none does; from moves to it */
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
    if (r->at.state[c] != CONTACT_STICK) {
        model_stick(r->at.p, r->at.d, j, 0, c);
    }
    double sum = j->slip_rate[c][0];
    *magnitude = fabs(sum);
    for (int e = 0; e < MODEL_NC; e++) {
        const double term = j->G[c][e][0] * j->force[e][0];
        sum += term;
        *magnitude += fabs(term);
    }
    return sum;
}

static int stick_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    const double capacity = j->capacity[c][0];
    const double tolerance = r->tolerances.margin;
    double magnitude;
    trial->zeros[c] = 0;
    /* without load nothing holds; where the force would drive the slip away from zero nothing holds for long */
    if (!(capacity > 0.0) || !(j->G[c][c][0] > 0.0)) {
        return 0;
    }
    /* contacts that constrain the same motion in different ways cannot all stick */
    if (fabs(slip_acceleration(r, j, c, &magnitude)) > tolerance * magnitude) {
        return 0;
    }
    const double margin = capacity - fabs(j->force[c][0]);
    if (!trial->at_limit[c] && fabs(margin) > tolerance * capacity) {
        return margin > 0.0;
    }
    expand(r, trial);
    const double side = j->force[c][0] > 0.0 ? 1.0 : -1.0;
    double series[TIE_ORDER];
    for (int k = 0; k < TIE_ORDER; k++) {
        series[k] = j->capacity[c][k] - side * j->force[c][k];
    }
    int zeros = 1;
    const int sign = first_sign(series, TIE_ORDER - 1, trial->length, r->tolerances.slip * capacity, &zeros);
    trial->zeros[c] = (signed char)zeros;
    /* a margin that stays at zero: one that was seen to fall has let go, one that started there holds */
    return sign > 0 || (sign == 0 && !trial->at_limit[c]);
}

static int slip_holds(Run *r, Trial *trial, int c)
{
    Jets *j = &r->scratch;
    const double sign = j->sign[c];
    double magnitude;
    const double rate = sign * slip_acceleration(r, j, c, &magnitude);
    trial->zeros[c] = 1;
    if (fabs(rate) > r->tolerances.margin * magnitude) {
        return rate > 0.0;
    }
    expand(r, trial);
    double series[TIE_ORDER + 1];
    for (int k = 0; k <= TIE_ORDER; k++) {
        series[k] = sign * j->slip[c][k];
    }
    int zeros = 2;
    const double largest = largest_term(series, zeros, TIE_ORDER, trial->length);
    if (j->force[c][0] == 0.0
        && largest <= r->tolerances.slip * model_slip_magnitude(r->at.p, r->at.d, j, c)) {
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
        if (!(r->at.state[c] == CONTACT_STICK ? stick_holds(r, trial, c) : slip_holds(r, trial, c))) {
            return 0;
        }
    }
    return 1;
}

/* write assignment number code into r's states; the number of contacts that stick, or -1 where the law forbids it */
static int assign(Run *r, const Trial *trial, int code)
{
    int sticking = 0;
    for (int i = 0; i < trial->count; i++) {
        const int c = trial->contact[i];
        /* the sign a contact had comes before the other: where both fit, nothing changes */
        const int sign = trial->before[c] == CONTACT_SLIP_MINUS ? -1 : 1;
        const int state = code % 3 == 0 ? CONTACT_STICK : code % 3 == 1 ? sign : -sign;
        code /= 3;
        if (state == CONTACT_STICK) {
            if (!model_contact_sticks[c]) {
                return -1;
            }
            sticking++;
        }
        r->at.state[c] = (signed char)state;
    }
    return sticking;
}

static int search(Run *r, Trial *trial)
{
    int codes = 1;
    for (int i = 0; i < trial->count; i++) {
        codes *= 3;
    }
    for (int sticking = trial->count; sticking >= 0; sticking--) {
        for (int code = 0; code < codes; code++) {
            if (assign(r, trial, code) == sticking && holds(r, trial)) {
                return 1;
            }
        }
    }
    return 0;
}

/* sticking candidates, and those on the wrong side of zero slip, are moved to it */
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
        member[c] = r->scratch.G[c][c][0] != 0.0
                    && (r->at.state[c] == CONTACT_STICK || r->scratch.sign[c] * slip < 0.0);
        any |= member[c];
        if (r->at.state[c] != CONTACT_STICK) {
            r->scratch.capacity[c][0] = 0.0; /* no weight of its own where the law has no capacity */
        }
    }
    memcpy(r->projected, member, sizeof member);
    return any && contact_project(&r->at, &r->scratch, member);
}

void choice_make(Run *r, const signed char *candidate, const signed char *at_limit, int *moved)
{
    Trial trial = {.count = 0, .at_limit = at_limit};
    memcpy(trial.before, r->at.state, sizeof trial.before);
    for (int c = 0; c < MODEL_NC; c++) {
        if (candidate[c] && trial.count < MAX_CANDIDATES) {
            trial.contact[trial.count++] = c;
        }
    }
    if (trial.count == 0) {
        return;
    }
    if (!search(r, &trial)) {
        memcpy(r->at.state, trial.before, sizeof trial.before);
        for (int i = 0; i < trial.count; i++) {
            trial.zeros[trial.contact[i]] = 1;
        }
    }
    for (int i = 0; i < trial.count; i++) {
        r->at.known[trial.contact[i]][SLOT_TANGENTIAL] = trial.zeros[trial.contact[i]];
    }
    *moved |= project(r, &trial);
}
