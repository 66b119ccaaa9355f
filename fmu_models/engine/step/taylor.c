/*
 * One step by Taylor series with dense output.
 *
 *     series:   for k = 0, 1, ...: field(k) from x[0..k];  x[k+1] = rate[k]/(k+1)
 *               by sums where the mode is linear with constant factors (linear.c); else
 *               stop at the order that the tolerance asks for, or where the terms vanish within the horizon
 *     length:   the last two terms stay below the tolerance times the larger of the first two, so that the result
 *               depends neither on units nor on the steps before; slip speeds count like states, since just after
 *               a release they are far smaller than the velocities they come from; so do switching functions
 *     root:     a law with half-integer powers of the depth is not analytic in time where its contact is entered; that
 *               step runs in the square root of time, where it is
 *     events:   event_location.c; the earliest ends the step
 *     impacts:  far from a wall its gap needs to be known roughly only; near it a short step is exact
 *
 * Sources: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor
 * methods, Experimental Mathematics 14 (2005): order and step from the tolerance.
 */
#include "taylor.h"

#include "../model/rough.h"
#include "cone_rest.h"
#include "event_location.h"
#include "flight.h"
#include "flow.h"
#include "linear.h"
#include "reach.h"

/* order per digit of tolerance: measured optimum of cost per time on the stick-slip of the disc rig */
static const double ORDER_PER_LOG = 0.72;

enum { LEAST_ORDER = 8 };

/* the shortest step, in last digits of the time, whose rest the point keeps: late runs go as close to a singular instant
   as early ones */
static const double LEAST_STEP = 0x1p-40;

/*
 * log2 of the error of a gap that is far from zero, relative to its size. Most of a flight needs to be known only as
 * far as nothing is hit; near a wall a short step follows, which is exact. Measured optimum for a ball on a shaking
 * table.
 */
static const double LOG_FAR = -14.0;

static const double LOG_2 = 0.69314718055994530942;

int taylor_order(const Run *r)
{
    const double order = ceil(-ORDER_PER_LOG * LOG_2 * rough_log2(r->tolerances.step));
    return order < LEAST_ORDER ? LEAST_ORDER : order > MODEL_MAX_ORDER ? MODEL_MAX_ORDER : (int)order;
}

void taylor_load(const Run *r, Jets *j)
{
    flow_load(&r->at, j, 0);
    for (int c = 0; MODEL_CONES > 0 && r->tolerances.drift > 0.0 && c < MODEL_NC; c++)
        if (r->young[c] && j->sign[c] != 0.0 && !j->rising[c]) j->rising[c] = 2;
}

void taylor_field(Run *r, Jets *j, int k)
{
    r->evaluations++;
    flow_field(&r->at, j, k, 0);
}

/*
 * whether the terms of order k are below the tolerance over the given length, for every state, and those of order k - 1
 * for every force in stick and what it may be, of depths and of switching functions: the states may be polynomials while
 * what decides an event is not
 */
static int vanishes(const Run *r, const Jets *j, int k, double power, double length)
{
    for (int i = 0; i < MODEL_NX - MODEL_NE; i++) { /* elements of arrays go with their way */
        const double size = fmax(fabs(j->x[i][0]), fabs(j->x[i][1]) * length);
        if (!(fabs(j->x[i][k]) * power <= 0.01 * r->tolerances.step * size)) /* not a number does not vanish */
            return 0;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        const double plus = fabs(j->capacity[c][k - 1]);
        const double own = MODEL_DIRECTED ? fmax(plus, fabs(j->capacity_minus[c][k - 1])) : plus;
        const double larger = fmax(fabs(j->force[c][k - 1]), model_contact_partner[c] < 0 ? own : 0.0);
        if (r->at.state[c] == CONTACT_STICK && larger * power > 0.01 * r->tolerances.step * stick_scale(j, c) * length)
            return 0;
        if (contact_is_closed(r, c)) {
            const double force = fmax(fabs(j->force[c][0]), fabs(j->force[c][1]) * length);
            if (fabs(j->force[c][k - 1]) * power > 0.01 * r->tolerances.step * force * length) return 0;
            continue;
        }
        const double depth = fmax(fabs(j->depth[c][0]), fabs(j->depth[c][1]) * length);
        if (model_contact_bounded[c] && fabs(j->depth[c][k - 1]) * power > 0.01 * r->tolerances.step * depth * length)
            return 0;
        const double function = fmax(fabs(j->slip[c][0]), fabs(j->slip[c][1]) * length);
        if (slip_decides(r, j, c) && fabs(j->slip[c][k - 1]) * power > 0.01 * r->tolerances.step * function * length)
            return 0;
        const double release = fmax(fabs(j->release[c][0]), fabs(j->release[c][1]) * length);
        if (MODEL_REACH && contact_may_release(r->at.state, c)
            && fabs(j->release[c][k - 1]) * power > 0.01 * r->tolerances.step * release * length) {
            return 0;
        }
    }
    return 1;
}

/* about when the first open rigid contact closes, by the parabola that its gap starts with; infinity if that never
   falls */
static double likely_impact(const Run *r, const Jets *j)
{
    double first = INFINITY;
    for (int c = 0; c < MODEL_NC; c++) {
        if (!contact_is_open(r, c)) continue;
        const double gap = r->at.known[c][SLOT_NORMAL] > 0 ? 0.0 : -j->depth[c][0];
        const double speed = j->depth[c][1];
        const double bend = j->depth[c][2];
        const double root = sqrt(fmax(speed * speed + 4.0 * gap * bend, 0.0));
        /* the larger root is stable where the body approaches slowly, the smaller one is not */
        const double fall = speed > 0.0 ? 2.0 * gap / (speed + root) : bend > 0.0 ? (root - speed) / (2.0 * bend) : 0.0;
        if (fall > 0.0) first = fmin(first, fall);
    }
    return first;
}

/* whether all contacts are rigid ones, or their friction, and open */
static int all_open(const Run *r)
{
    int open = MODEL_IMPACTS > 0;
    for (int c = 0; c < MODEL_NC; c++)
        open &= r->at.state[c] == CONTACT_AWAY && (model_contact_impulsive[c] || model_contact_partner[c] >= 0);
    return open;
}

/* a limit; where an impact is near, no further than a little beyond it */
static double before_impact(const Run *r, const Jets *j, double limit)
{
    const double BEYOND = 1.5;
    const double least = 16.0 * DBL_EPSILON * fabs(r->at.time); /* time has to move */
    if (MODEL_IMPACTS == 0 || !isfinite(limit)) return limit;
    return fmin(limit, fmax(BEYOND * likely_impact(r, j), least));
}

/* the series, as far as a limit, which comes nearer where an impact is */
static int series_to(Run *r, Jets *j, int order, double *limit)
{
    const int told = r->at.curved ? MODEL_INPUT_DEGREE + 2 : 3; /* before, terms may vanish that are not the last */
    flow_load(&r->at, j, 0);
    double power = *limit;
    int vanished = 0;
    j->apart = isfinite(*limit) && all_open(r);
    for (int k = 0; k < order; k++) {
        taylor_field(r, j, k);
        flow_extend(j, k + 1, 0);
        if (k + 1 >= told && isfinite(*limit)) {
            vanished = vanishes(r, j, k + 1, power, *limit) ? vanished + 1 : 0;
            if (vanished == 2) order = k + 1;
        }
        if (MODEL_IMPACTS > 0 && k == 2 && isfinite(*limit)) {
            *limit = before_impact(r, j, *limit);
            power = *limit * *limit * *limit;
        }
        power *= *limit;
    }
    flow_finish(&r->at, j, order);
    return order;
}

int taylor_series(Run *r, Jets *j, int order, double limit) { return series_to(r, j, order, &limit); }

/* the last terms of a series of which some may vanish: a force like depth to the power 3/2 leaves every fifth power of the
   root of time, one like x^4 every fifth of time */
enum { LAST_TERMS = 5 };

/* what makes a length short enough: the last two terms, or one before them where both vanish; in the root of time all of
   the last, of which others than every fifth are there but small */
typedef struct {
    double log_tolerance;
    int all;
} Ask;

/* log2 of what is nothing, of whatever unit: the far end of a chain that a wave has not come to takes no short steps */
static const double LOG_NOTHING = -332.0;

static Ask ask_for(const Run *r, double log_tolerance) { return (Ask){log_tolerance, r->segment_rooted}; }

/* the shorter of a log2 of a length and that at which the last terms are tolerance times the larger of the first two
   terms, from term m, that are not zero; what has none but last terms, as the rounding of a speed held at zero, tells
   nothing */
static double shorter_length(double length, const double *x, int m, int order, Ask ask)
{
    int first = m;
    while (first < order && x[first] == 0.0)
        first++;
    int second = first + 1;
    while (second < order && x[second] == 0.0)
        second++;
    const double one = first < order ? ask.log_tolerance + rough_log2(x[first]) : 0.0;
    const double two = second < order ? ask.log_tolerance + rough_log2(x[second]) : 0.0;
    int told = 0;
    for (int k = order; k > order - LAST_TERMS && k > 0 && (ask.all || k >= order - 1 || !told); k--) {
        if (!isfinite(x[k])) return -INFINITY; /* beyond the range of numbers: no length is short enough */
        if (x[k] == 0.0 || k <= first || first > order - LAST_TERMS) continue;
        told = 1;
        const double term = rough_log2(x[k]);
        double longest = (one - term) / (k - first);
        if (k > second) {
            const double other = (two - term) / (k - second);
            longest = other > longest ? other : longest;
        }
        if (longest >= length) continue;
        const double nothing = (ask.log_tolerance + LOG_NOTHING - term) / k;
        longest = nothing > longest ? nothing : longest;
        length = longest < length ? longest : length;
    }
    return length;
}

/* log2 of the length over which the states keep the tolerance */
static double state_length(const Jets *j, int order, Ask ask)
{
    double length = INFINITY;
    for (int i = 0; i < MODEL_NX - MODEL_NE; i++)
        length = shorter_length(length, j->x[i], 0, order, ask);
    return length;
}

double taylor_series_length(const double *x, int order, double tolerance)
{
    return rough_exp2(shorter_length(INFINITY, x, 0, order, (Ask){rough_log2(tolerance), 0}));
}

double taylor_time_scale(const Run *r, const Jets *j, int order)
{
    const Ask ask = ask_for(r, rough_log2(r->tolerances.step));
    double length = state_length(j, order, ask);
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++)
        if (model_contact_impulsive[c])
            length = shorter_length(length, j->slip[c], 0, order, ask); /* walls that move change faster than states */
    length = rough_exp2(length);
    return isfinite(length) ? length : 1.0;
}

/* the same for slip speeds too, where they matter to a force, for the forces in stick and what they may be, for depths
   and switching functions */
static double taylor_length(const Run *r, const Jets *j, int order, double *exact)
{
    const Ask ask = ask_for(r, rough_log2(r->tolerances.step));
    double length = state_length(j, order, ask);
    double near = INFINITY;
    for (int c = 0; c < MODEL_NC; c++) {
        if (slip_decides(r, j, c)) {
            length = shorter_length(length, j->slip[c], r->at.known[c][SLOT_TANGENTIAL] * time_power(r->segment_rooted),
                                    order, ask);
        }
        if (r->at.state[c] == CONTACT_STICK) {
            length = shorter_length(length, j->force[c], 0, order - 1, ask);
            if (model_contact_partner[c] < 0) { /* what a rigid contact's friction may be goes with its force */
                length = shorter_length(length, j->capacity[c], 0, order - 1, ask);
                if (MODEL_DIRECTED) length = shorter_length(length, j->capacity_minus[c], 0, order - 1, ask);
            }
        }
        if (contact_is_closed(r, c)) {
            length = shorter_length(length, j->force[c], r->at.known[c][SLOT_NORMAL] * time_power(r->segment_rooted),
                                    order - 1, ask);
        } else if (model_contact_bounded[c]) {
            const int known = r->at.known[c][SLOT_NORMAL] * time_power(r->segment_rooted);
            if (contact_is_open(r, c) && !r->segment_linear) {
                near = shorter_length(near, j->depth[c], known, order, ask);
                length = shorter_length(length, j->depth[c], known, order, ask_for(r, LOG_FAR));
            } else {
                length = shorter_length(length, j->depth[c], known, order, ask);
            }
        }
        if (MODEL_REACH && contact_may_release(r->at.state, c)) /* otherwise it is a sum of what is kept */
            length = shorter_length(length, j->release[c], 0, order, ask);
    }
    *exact = rough_exp2(near);
    return rough_exp2(length);
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

/* whether the function of a switch is zero, as where it has just passed that; exactly so from then on, where others have
   moved it by rounding */
static int starts_at_zero(Run *r, int c)
{
    taylor_load(r, &r->scratch);
    model_slip(r->at.p, r->at.d, &r->scratch, 0);
    if (r->scratch.sign[c] * r->scratch.slip[c][0] > 0.0) return 0;
    model_reset(r->at.p, r->at.d, &r->scratch, c, r->at.x);
    return 1;
}

int taylor_starts_rooted(Run *r)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_rooted[c] && model_contact_tangential[c] && starts_at_zero(r, c)) return 1;
        if (!model_contact_rooted[c] || r->at.state[c] != CONTACT_TOUCHING) continue;
        if (r->at.known[c][SLOT_NORMAL] == 0 && enters(r, c)) r->at.known[c][SLOT_NORMAL] = 1;
        if (r->at.known[c][SLOT_NORMAL] > 0) return 1;
    }
    return 0;
}

static double shortest_step(const Run *r) { return LEAST_STEP * DBL_EPSILON * fabs(r->at.time); }

static RunStatus no_length(Run *r)
{
    return run_fail(r,
                    "the motion cannot be continued beyond t = %.17g: its Taylor series has no usable length there "
                    "(a state that goes to infinity, or a singular law)",
                    r->at.time);
}

/* the series to the full order, from that where terms that vanish have ended them */
static void complete(Run *r, int order, int full)
{
    for (int k = order; k < full; k++) {
        taylor_field(r, &r->jets, k);
        flow_extend(&r->jets, k + 1, 0);
    }
    flow_finish(&r->at, &r->jets, full);
}

/* the step ends without an event */
static void clear_events(Run *r)
{
    r->segment_event = 0;
    memset(r->falling, 0, sizeof r->falling);
}

/*
 * The reach of a step that an end or an event may have cut to h. What has just left zero, as a slip at a release, is too
 * small there for what the discs bound, and not far on: what a longer step shows, a shorter one does.
 */
static double cut_reach(Run *r, int order, double h, double natural)
{
    static const double LONGER = 16.0, LONGEST = 0x1p32; /* natural may have no bound */
    double reach = reach_of_step(r, NULL, order, h, 0.0);
    for (double length = LONGER * h; reach < h && length <= fmin(natural, LONGEST * h); length *= LONGER)
        reach = reach_of_step(r, NULL, order, length, 0.99 * length) > 0.0 ? h : reach;
    return reach;
}

RunStatus taylor_step(Run *r, double limit, int flies)
{
    const int full = taylor_order(r);
    r->jets.wave = r->scratch.wave; /* what an event was resolved with */
    const int rooted = r->segment_rooted = taylor_starts_rooted(r);
    r->segment_linear = 0;
    int order = full;
    if (MODEL_CONES > 0 && cone_rests_at_once(r, limit)) return RUN_OK;
    for (int c = 0; rooted && c < MODEL_NC; c++) {
        if (cone_is_whole(c) && r->at.known[c][SLOT_TANGENTIAL] > 0 && r->at.state[c] == CONTACT_SLIP_PLUS) {
            return run_fail(r,
                            "'%s' begins to slip at t = %.17g, where a stop with a root of its depth is entered: such "
                            "a start in two directions has no series here. Move a start value a little",
                            model_contact_names[c], r->at.time);
        }
    }
    if (rooted) {
        flow_rooted_series(&r->at, &r->jets, full);
        r->evaluations += full;
    } else if ((r->segment_linear = linear_series(r, &r->jets, full))) {
        r->segment_rests = -1;
        r->segment_valid = flies && flight_step(r, limit);
        r->steps += r->segment_valid;
        if (r->segment_valid) return RUN_OK;
        order = LINEAR_ORDER;
        limit = before_impact(r, &r->jets, limit);
    } else {
        order = series_to(r, &r->jets, full, &limit);
    }
    r->segment_rests = -1;
    const double end = rooted ? sqrt(limit) : limit;
    double h = 0.0, reach = 0.0;
    for (int ended = order < full;; ended = 0) {
        double exact = INFINITY;
        h = r->segment_linear ? linear_length(r) : 0.0;
        if (h == 0.0) h = ended ? end : taylor_length(r, &r->jets, order, &exact);
        /* very fast motions leave the range of numbers at high orders; the lower ones are still good */
        while (!(h > 0.0) && order > LEAST_ORDER)
            h = taylor_length(r, &r->jets, --order, &exact);
        const double natural = h;
        h = fmin(h, end);
        if (!(h > 0.0) || !isfinite(h) || !((rooted ? h * h : h) > shortest_step(r)))
            return run_check_mass(r, &r->jets) == RUN_ERROR ? RUN_ERROR : no_length(r);
        h = location_cut(r, order, h, exact);
        reach = cut_reach(r, order, h, natural);
        if (!ended || reach == h) break;
        /* there is more to come than the terms that did not vanish tell */
        complete(r, order, full);
        order = full;
    }
    if (reach < h) {
        h = reach;
        clear_events(r);
        if (!((rooted ? h * h : h) > shortest_step(r))) return no_length(r);
    }
    r->segment_order = order;
    r->segment_start = r->at.time;
    r->segment_length = rooted ? h * h : h;
    r->segment_valid = 1;
    r->steps++;
    return RUN_OK;
}

void taylor_complete(Run *r)
{
    const int full = taylor_order(r);
    if (r->segment_order == full || r->segment_rests >= 0 || r->segment_linear) return;
    complete(r, r->segment_order, full);
}

RunStatus taylor_shorten(Run *r, double length)
{
    if (!(length < r->segment_length)) return RUN_OK;
    if (!(length > shortest_step(r))) return no_length(r);
    r->segment_length = length;
    clear_events(r);
    return RUN_OK;
}
