/*
 * One step by Taylor series with dense output.
 *
 *     series:   for k = 0, 1, ...: field(k) from x[0..k];  x[k+1] = rate[k]/(k+1)
 *               stop at the order that the tolerance asks for, or where the terms vanish within the horizon
 *     length:   the last two terms stay below the tolerance times the larger of the first two, so that the result
 *               depends neither on units nor on the steps before; slip speeds count like states, since just after
 *               a release they are far smaller than the velocities they come from; so do switching functions
 *     root:     a law with half-integer powers of the depth is not analytic in time where its contact is entered; that
 *               step runs in the square root of time, where it is
 *     events:   first fall of each indicator's own polynomial, its known zeros divided out; the earliest ends the step
 *
 * Sources: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor
 * methods, Experimental Mathematics 14 (2005): order and step from the tolerance.
 */
#include "engine.h"

#include <math.h>

/* order per digit of tolerance: measured optimum of cost per time on the stick-slip of the disc rig */
static const double ORDER_PER_LOG = 0.72;

enum { LEAST_ORDER = 8 };

int taylor_order(const Run *r)
{
    const double order = ceil(-ORDER_PER_LOG * log(r->tolerances.step));
    return order < LEAST_ORDER ? LEAST_ORDER : order > MODEL_MAX_ORDER ? MODEL_MAX_ORDER : (int)order;
}

void taylor_load(const Run *r, Jets *j)
{
    flow_load(&r->at, j, 0);
}

void taylor_field(Run *r, Jets *j, int k)
{
    r->evaluations++;
    flow_field(&r->at, j, k, 0);
}

/*
 * a switching function may be any function of states and time, and decides events of its own accord
 */
static int watches_function(const Run *r, int c)
{
    return MODEL_NQ == 0 && r->at.state[c] != CONTACT_STICK;
}

/* a rigid contact whose force decides, and whose gap is zero */
static int is_closed(const Run *r, int c)
{
    return MODEL_IMPACTS > 0 && model_contact_is_impact[c] && r->at.state[c] != CONTACT_AWAY;
}

/*
 * whether the terms of order k are below the tolerance over the given length, for every state, and those of order k - 1
 * for every force in stick, of depths and of switching functions: the states may be polynomials while what decides an
 * event is not
 */
static int vanishes(const Run *r, const Jets *j, int k, double power, double length)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (r->at.state[c] == CONTACT_STICK
            && fabs(j->force[c][k - 1]) * power > 0.01 * r->tolerances.step * j->capacity[c][0] * length) {
            return 0;
        }
        if (is_closed(r, c)) {
            const double force = fmax(fabs(j->force[c][0]), fabs(j->force[c][1]) * length);
            if (fabs(j->force[c][k - 1]) * power > 0.01 * r->tolerances.step * force * length) {
                return 0;
            }
            continue;
        }
        const double depth = fmax(fabs(j->depth[c][0]), fabs(j->depth[c][1]) * length);
        if (model_contact_bounded[c]
            && fabs(j->depth[c][k - 1]) * power > 0.01 * r->tolerances.step * depth * length) {
            return 0;
        }
        const double function = fmax(fabs(j->slip[c][0]), fabs(j->slip[c][1]) * length);
        if (watches_function(r, c)
            && fabs(j->slip[c][k - 1]) * power > 0.01 * r->tolerances.step * function * length) {
            return 0;
        }
    }
    for (int i = 0; i < MODEL_NX; i++) {
        const double size = fmax(fabs(j->x[i][0]), fabs(j->x[i][1]) * length);
        if (!(fabs(j->x[i][k]) * power <= 0.01 * r->tolerances.step * size)) { /* not a number does not vanish */
            return 0;
        }
    }
    return 1;
}

int taylor_series(Run *r, Jets *j, int order, double limit)
{
    flow_load(&r->at, j, 0);
    double power = limit;
    int vanished = 0;
    for (int k = 0; k < order; k++) {
        taylor_field(r, j, k);
        flow_extend(j, k + 1, 0);
        if (k + 1 >= 3 && isfinite(limit)) {
            vanished = vanishes(r, j, k + 1, power, limit) ? vanished + 1 : 0;
            if (vanished == 2) {
                order = k + 1;
            }
        }
        power *= limit;
    }
    flow_finish(&r->at, j, order);
    return order;
}

/* log2 of the length at which term k is tolerance times the larger of the first two terms, from term m, that are not zero */
static double log_length(const double *x, int m, int k, double log_tolerance)
{
    const double term = log2(fabs(x[k]));
    double longest = -INFINITY;
    int found = 0;
    for (; m < k && found < 2; m++) {
        if (x[m] != 0.0) {
            longest = fmax(longest, (log_tolerance + log2(fabs(x[m])) - term) / (k - m));
            found++;
        }
    }
    return found > 0 ? longest : INFINITY;
}

static double shorter_length(double length, const double *x, int m, int order, double log_tolerance)
{
    for (int k = order - 1; k <= order; k++) {
        if (!isfinite(x[k])) {
            return -INFINITY; /* beyond the range of numbers: no length is short enough */
        }
        if (x[k] != 0.0) {
            length = fmin(length, log_length(x, m, k, log_tolerance));
        }
    }
    return length;
}

/* log2 of the length over which the states keep the tolerance */
static double state_length(const Jets *j, int order, double log_tolerance)
{
    double length = INFINITY;
    for (int i = 0; i < MODEL_NX; i++) {
        length = shorter_length(length, j->x[i], 0, order, log_tolerance);
    }
    return length;
}

double taylor_series_length(const double *x, int order, double tolerance)
{
    return exp2(shorter_length(INFINITY, x, 0, order, log2(tolerance)));
}

double taylor_time_scale(const Run *r, const Jets *j, int order)
{
    const double log_tolerance = log2(r->tolerances.step);
    double length = state_length(j, order, log_tolerance);
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        if (model_contact_is_impact[c]) {
            length = shorter_length(length, j->slip[c], 0, order, log_tolerance); /* walls that move change faster than states */
        }
    }
    length = exp2(length);
    return isfinite(length) ? length : 1.0;
}

/* the same for slip speeds too, where they matter to a force, for the forces in stick, for depths and switching functions */
static double taylor_length(const Run *r, const Jets *j, int order)
{
    const double log_tolerance = log2(r->tolerances.step);
    double length = state_length(j, order, log_tolerance);
    for (int c = 0; c < MODEL_NC; c++) {
        if ((j->sign[c] != 0.0 && j->force[c][0] != 0.0) || watches_function(r, c)) {
            length = shorter_length(length, j->slip[c], r->at.known[c][SLOT_TANGENTIAL] * time_power(r->segment_rooted), order,
                                    log_tolerance);
        }
        if (r->at.state[c] == CONTACT_STICK) {
            length = shorter_length(length, j->force[c], 0, order - 1, log_tolerance);
        }
        if (is_closed(r, c)) {
            length = shorter_length(length, j->force[c], r->at.known[c][SLOT_NORMAL] * time_power(r->segment_rooted), order - 1,
                                    log_tolerance);
        } else if (model_contact_bounded[c]) {
            const int known = r->at.known[c][SLOT_NORMAL] * time_power(r->segment_rooted);
            length = shorter_length(length, j->depth[c], known, order, log_tolerance);
        }
    }
    return exp2(length);
}

int taylor_indicator(const Run *r, int c, Slot slot)
{
    const int state = r->at.state[c];
    if (slot == SLOT_NORMAL) {
        if (!model_contact_bounded[c]) {
            return 0;
        }
        return state == CONTACT_AWAY ? -1 : 1;
    }
    if (model_contact_is_impact[c]) {
        return 0;
    }
    if (model_contact_is_stop[c]) {
        return !model_contact_releases[c] || state == CONTACT_AWAY ? 0 : state == CONTACT_TOUCHING ? 1 : -1;
    }
    return state == CONTACT_AWAY ? 0 : state == CONTACT_SLIP_MINUS ? -1 : 1;
}

/* first fall of sign * series to zero within h, its first known coefficients taken as zero; -1 if none */
static double fall_of(const double *series, double sign, int known, int order, double h)
{
    double indicator[POLYNOMIAL_TERMS];
    if (known >= order) {
        return -1.0; /* all its terms vanish over this step */
    }
    for (int k = known; k <= order; k++) {
        indicator[k - known] = sign * series[k];
    }
    return first_fall(indicator, order - known, h);
}

/* the same for a function of a body at a bound: what starts at rest there has more zeros than the event knows */
static double fall_from_bound(const double *series, double sign, int known, int order, double h)
{
    while (known < order && series[known] == 0.0) {
        known++;
    }
    return fall_of(series, sign, known, order, h);
}

/* first fall of the margin of a sticking contact */
static double fall_of_margin(const Run *r, const Jets *j, int c, int known, int order, double h)
{
    /* the load of a rigid contact that is about to push starts at zero, and so do both margins */
    const int both = model_contact_partner[c] >= 0 && r->at.known[(int)model_contact_partner[c]][SLOT_NORMAL] > 0;
    double first = -1.0;
    for (int side = -1; side <= 1; side += 2) {
        double margin[POLYNOMIAL_TERMS];
        for (int k = 0; k < order; k++) {
            margin[k] = j->capacity[c][k] - side * j->force[c][k];
        }
        /* a margin that starts at zero does so on one side only */
        const double fall = fall_of(margin, 1.0, both || side * j->force[c][0] > 0.0 ? known : 0, order - 1, h);
        if (fall >= 0.0 && (first < 0.0 || fall < first)) {
            first = fall;
        }
    }
    return first;
}

static double fall_in_slot(const Run *r, const Jets *j, int c, Slot slot, int order, double h)
{
    const int sign = taylor_indicator(r, c, slot);
    const int known = r->at.known[c][slot] * time_power(r->segment_rooted);
    if (sign == 0) {
        return -1.0;
    }
    if (slot == SLOT_NORMAL && is_closed(r, c)) {
        if (r->at.state[c] == CONTACT_CHATTERING) {
            const double wait = r->at.settles[c] - r->at.time;
            const double end = r->segment_rooted ? sqrt(wait) : wait;
            return end <= h ? end : -1.0;
        }
        return fall_from_bound(j->force[c], sign, known, order - 1, h);
    }
    if (slot == SLOT_NORMAL) {
        return fall_from_bound(j->depth[c], sign, known, order, h);
    }
    if (model_contact_is_stop[c]) {
        return fall_from_bound(j->release[c], sign, known, order, h);
    }
    return r->at.state[c] == CONTACT_STICK ? fall_of_margin(r, j, c, known, order, h)
                                        : fall_of(j->slip[c], sign, known, order, h);
}

/* cut a step of length h at the first fall of an indicator and note all that fall there */
static double cut(Run *r, int order, double h)
{
    double falls[MODEL_ROOM(MODEL_NC)][SLOTS];
    double first = h;
    r->segment_event = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            /* over the whole step: cut at another's fall, one at the same instant could hide behind its rounding */
            falls[c][slot] = fall_in_slot(r, &r->jets, c, (Slot)slot, order, h);
            if (falls[c][slot] >= 0.0) {
                first = fmin(first, falls[c][slot]);
                r->segment_event = 1;
            }
        }
    }
    h = first;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            r->falling[c][slot] = falls[c][slot] >= 0.0 && falls[c][slot] <= h * (1.0 + 4.0 * DBL_EPSILON);
        }
    }
    return h;
}

/* a contact just entered whose depth is still lost in the rounding of the position is at zero depth, on its way in */
static int enters(Run *r, int c)
{
    Jets *j = &r->scratch;
    taylor_load(r, j);
    model_slip(r->at.p, r->at.d, j, 0);
    model_depth(r->at.p, r->at.d, j, 0);
    return j->depth[c][0] <= 0.0 && j->slip[c][0] > 0.0;
}

/* whether a law with half-integer powers of its depth starts at zero depth */
static int starts_rooted(Run *r)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (!model_contact_rooted[c] || r->at.state[c] != CONTACT_TOUCHING) {
            continue;
        }
        if (r->at.known[c][SLOT_NORMAL] == 0 && enters(r, c)) {
            r->at.known[c][SLOT_NORMAL] = 1;
        }
        if (r->at.known[c][SLOT_NORMAL] > 0) {
            return 1;
        }
    }
    return 0;
}

RunStatus taylor_step(Run *r, double limit)
{
    const int full = taylor_order(r);
    const int rooted = r->segment_rooted = starts_rooted(r);
    int order = full;
    if (rooted) {
        flow_rooted_series(&r->at, &r->jets, full);
        r->evaluations += full;
    } else {
        order = taylor_series(r, &r->jets, full, limit);
    }
    const double end = rooted ? sqrt(limit) : limit;
    double h = order < full ? end : taylor_length(r, &r->jets, order);
    /* very fast motions leave the range of numbers at high orders; the lower ones are still good */
    while (!(h > 0.0) && order > LEAST_ORDER) {
        h = taylor_length(r, &r->jets, --order);
    }
    h = fmin(h, end);
    if (!(h > 0.0) || !isfinite(h) || !(r->at.time + (rooted ? h * h : h) > r->at.time)) {
        return run_fail(r, "the motion cannot be continued beyond t = %.17g: its Taylor series has no usable length there "
                           "(a state that is not finite, or a singular law)", r->at.time);
    }
    h = cut(r, order, h);
    r->segment_order = order;
    r->segment_start = r->at.time;
    r->segment_length = rooted ? h * h : h;
    r->segment_valid = 1;
    r->steps++;
    return RUN_OK;
}
