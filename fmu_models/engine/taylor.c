/*
 * One step by Taylor series with dense output.
 *
 *     series:   for k = 0, 1, ...: field(k) from x[0..k];  x[k+1] = rate[k]/(k+1)
 *               stop at the order that the tolerance asks for, or where the terms vanish within the horizon
 *     length:   the last two terms stay below the tolerance times the larger of the first two, so that the result
 *               depends neither on units nor on the steps before; slip speeds count like states, since just after
 *               a release they are far smaller than the velocities they come from
 *     events:   first fall of each indicator's own polynomial, its known zeros divided out; the earliest ends the step
 *
 * Sources: Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order Taylor
 * methods, Experimental Mathematics 14 (2005): order and step from the tolerance.
 */
#include "engine.h"

#include <math.h>

/* order per digit of tolerance: measured optimum of cost per time on the stick-slip of the disc rig */
static const double ORDER_PER_LOG = 0.72;

int taylor_order(const Run *r)
{
    const double order = ceil(-ORDER_PER_LOG * log(r->tolerances.step));
    return order < 8 ? 8 : order > MODEL_MAX_ORDER ? MODEL_MAX_ORDER : (int)order;
}

void taylor_load(const Run *r, Jets *j)
{
    j->t[0] = r->time;
    j->t[1] = 1.0;
    for (int i = 0; i < MODEL_NU; i++) {
        j->u[i][0] = r->u[i];
        j->u[i][1] = r->du[i];
    }
    for (int i = 0; i < MODEL_NX; i++) {
        j->x[i][0] = r->x[i];
    }
    for (int c = 0; c < MODEL_NC; c++) {
        j->sign[c] = r->state[c] == CONTACT_SLIP_PLUS ? 1.0 : r->state[c] == CONTACT_SLIP_MINUS ? -1.0 : 0.0;
    }
}

void taylor_field(Run *r, Jets *j, int k)
{
    r->evaluations++;
    model_slip(r->p, r->d, j, k);
    model_acceleration(r->p, r->d, j, k);
    if (!MODEL_CONSTANT_INERTIA) {
        model_inertia(r->p, r->d, j, k);
    }
    contact_forces(r, j, k);
    if (MODEL_NZ > 0) {
        model_internal(r->p, r->d, j, k);
    }
}

/* order k + 1 of the states */
static void extend(Jets *j, int k)
{
    const double n = 1.0 / (k + 1);
    for (int i = 0; i < MODEL_NQ; i++) {
        j->x[i][k + 1] = n * j->x[MODEL_NQ + i][k];
        j->x[MODEL_NQ + i][k + 1] = n * contact_acceleration(j, i, k);
    }
    for (int i = 0; i < MODEL_NZ; i++) {
        j->x[2 * MODEL_NQ + i][k + 1] = n * j->zrate[i][k];
    }
}

/*
 * whether the terms of order k are below the tolerance over the given length, for every state, and those of order k - 1
 * for every force in stick: in stick the states may be polynomials while the force, which decides the release, is not
 */
static int vanishes(const Run *r, const Jets *j, int k, double power, double length)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (r->state[c] == CONTACT_STICK
            && fabs(j->force[c][k - 1]) * power > 0.01 * r->tolerances.step * j->capacity[c][0] * length) {
            return 0;
        }
    }
    for (int i = 0; i < MODEL_NX; i++) {
        const double size = fmax(fabs(j->x[i][0]), fabs(j->x[i][1]) * length);
        if (fabs(j->x[i][k]) * power > 0.01 * r->tolerances.step * size) {
            return 0;
        }
    }
    return 1;
}

int taylor_series(Run *r, Jets *j, int order, double limit)
{
    taylor_load(r, j);
    double power = limit;
    int vanished = 0;
    for (int k = 0; k < order; k++) {
        taylor_field(r, j, k);
        extend(j, k);
        if (k + 1 >= 3 && isfinite(limit)) {
            vanished = vanishes(r, j, k + 1, power, limit) ? vanished + 1 : 0;
            if (vanished == 2) {
                order = k + 1;
            }
        }
        power *= limit;
    }
    model_slip(r->p, r->d, j, order);
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

double taylor_time_scale(const Run *r, const Jets *j, int order)
{
    const double length = exp2(state_length(j, order, log2(r->tolerances.step)));
    return isfinite(length) ? length : 1.0;
}

/* the same for slip speeds too, where they matter to a force, and for the forces in stick */
static double taylor_length(const Run *r, const Jets *j, int order)
{
    const double log_tolerance = log2(r->tolerances.step);
    double length = state_length(j, order, log_tolerance);
    for (int c = 0; c < MODEL_NC; c++) {
        if (j->sign[c] != 0.0 && j->force[c][0] != 0.0) {
            length = shorter_length(length, j->slip[c], r->known[c], order, log_tolerance);
        }
        if (r->state[c] == CONTACT_STICK) {
            length = shorter_length(length, j->force[c], 0, order - 1, log_tolerance);
        }
    }
    return exp2(length);
}

/* time to the first fall of contact c's indicator within h, or -1 */
static double fall_of_contact(const Run *r, const Jets *j, int c, int order, double h)
{
    const int known = r->known[c];
    if (known >= order) {
        return -1.0; /* all its terms vanish over this step */
    }
    double indicator[POLYNOMIAL_TERMS];
    if (r->state[c] != CONTACT_STICK) {
        for (int k = known; k <= order; k++) {
            indicator[k - known] = j->sign[c] * j->slip[c][k];
        }
        return first_fall(indicator, order - known, h);
    }
    double first = -1.0;
    for (int side = -1; side <= 1; side += 2) {
        /* a margin that starts at zero does so on one side only */
        const int zeros = side * j->force[c][0] > 0.0 ? known : 0;
        for (int k = zeros; k < order; k++) {
            indicator[k - zeros] = j->capacity[c][k] - side * j->force[c][k];
        }
        const double fall = first_fall(indicator, order - 1 - zeros, h);
        if (fall >= 0.0 && (first < 0.0 || fall < first)) {
            first = fall;
        }
    }
    return first;
}

RunStatus taylor_step(Run *r, double limit)
{
    Jets *j = &r->jets;
    const int order = taylor_series(r, j, taylor_order(r), limit);
    double h = fmin(order < taylor_order(r) ? limit : taylor_length(r, j, order), limit);
    if (!(h > 0.0) || !isfinite(h) || !(r->time + h > r->time)) {
        return run_fail(r, "the motion cannot be continued beyond t = %.17g: its Taylor series has no usable length there "
                           "(a state that is not finite, or a singular law)", r->time);
    }
    double falls[NC];
    r->segment_event = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        falls[c] = r->state[c] == CONTACT_AWAY ? -1.0 : fall_of_contact(r, j, c, order, h);
        if (falls[c] >= 0.0) {
            h = falls[c];
            r->segment_event = 1;
        }
    }
    for (int c = 0; c < MODEL_NC; c++) {
        r->falling[c] = falls[c] >= 0.0 && falls[c] <= h;
    }
    r->segment_order = order;
    r->segment_start = r->time;
    r->segment_length = h;
    r->segment_valid = 1;
    r->steps++;
    return RUN_OK;
}
