/*
 * The flow as series, to any order: load a point, then order by order rates from states and states from rates. Included
 * once per kind of number; decisions (order, length, events) are not made here but in taylor.c, for real numbers.
 *
 * In time:                 x[k+1] = rate[k]/(k+1)
 * In s = sqrt(time):       x[k+2] = 2 rate[k]/(k+2), x[1] = 0
 * A force like depth^(3/2) is analytic in s at the moment of entry, where depth = s^2 P(s). Rates reach the states one
 * order later there, so that all states, and the depths, are known one order ahead of the forces.
 */
#include "flow.h"

#include "contact_forces.h"

/* value + rate * time as a series */
static void KIND(load_line)(Real *series, Real value, Real rate, int rooted)
{
    series[0] = value;
    series[1] = 0.0;
    series[2] = 0.0;
    series[time_power(rooted)] = rate;
}

/* what is left of the inputs beyond their rates */
static void KIND(load_curves)(const Point *at, Jets *j, int rooted)
{
    const int power = time_power(rooted);
    for (int i = 0; i < MODEL_NU; i++) {
        double factorial = 1.0;
        for (int k = 3; k <= 2 * MODEL_INPUT_DEGREE; k++)
            j->u[i][k] = j->du[i][k] = 0.0;
        for (int n = 2; at->curved && n <= MODEL_INPUT_DEGREE; n++) {
            j->du[i][(n - 1) * power] = at->bend[i][n - 2] / factorial;
            factorial *= n;
            j->u[i][n * power] = at->bend[i][n - 2] / factorial;
        }
    }
    j->curved = at->curved;
}

void flow_load(const Point *at, Jets *j, int rooted)
{
    KIND(load_line)(j->t, at->time, 1.0, rooted);
    j->time_rest = at->time_rest;
    j->apart = 0;
    for (int i = 0; i < MODEL_NU; i++) {
        KIND(load_line)(j->u[i], at->u[i], at->du[i], rooted);
        KIND(load_line)(j->du[i], at->du[i], 0.0, rooted);
    }
    if (at->curved || j->curved) KIND(load_curves)(at, j, rooted);
    for (int i = 0; i < MODEL_NX; i++)
        j->x[i][0] = at->x[i];
    for (int c = 0; c < MODEL_NC; c++) {
        j->sign[c] = at->state[c] == CONTACT_SLIP_PLUS ? 1.0 : at->state[c] == CONTACT_SLIP_MINUS ? -1.0 : 0.0;
        j->memory[c] = at->memory[c];
        if (cone_is_side(c)) j->sign[c] = 0.0;
        j->rising[c] = cone_is_whole(c) && j->sign[c] != 0.0 && at->known[c][SLOT_TANGENTIAL] > 0;
    }
    if (MODEL_NE > 0) memcpy(j->held, at->held, sizeof j->held);
}

/* order k of the depths in the root of time; a contact just entered has none of the rounding that its position
   carries */
static void KIND(rooted_depths)(const Point *at, Jets *j, int k)
{
    model_depth(at->p, at->d, j, k);
    for (int c = 0; c < MODEL_NC; c++)
        if (at->state[c] == CONTACT_TOUCHING && k < 2 * at->known[c][SLOT_NORMAL]) j->depth[c][k] = 0.0;
}

/* order k of the release indicators of touching and released stops */
static void KIND(flow_releases)(const Point *at, Jets *j, int k)
{
    for (int c = 0; c < MODEL_NC; c++)
        if (contact_may_release(at->state, c)) model_release(at->p, at->d, j, k, c);
}

void flow_field(Point *at, Jets *j, int k, int rooted)
{
    if (k < 2 || !j->apart) model_slip(at->p, at->d, j, k);
    if (MODEL_BOUNDED && !rooted) model_depth(at->p, at->d, j, k);
    if (!MODEL_CONSTANT_INERTIA) model_inertia(at->p, at->d, j, k);
    model_acceleration(at->p, at->d, j, k);
    contact_forces(at, j, k);
    KIND(flow_releases)(at, j, k);
    if (MODEL_NZ > 0) model_internal(at->p, at->d, j, k);
}

/* order n of the states from their rates: x' = rate in time, x' = 2 s rate in its root */
void flow_extend(Jets *j, int n, int rooted)
{
    const int k = n - time_power(rooted);
    const double f = (double)time_power(rooted) / n;
    for (int i = 0; i < MODEL_NQ; i++)
        j->x[i][n] = k < 0 ? 0.0 : f * j->x[MODEL_NQ + i][k];
    for (int i = 0; i < MODEL_NV; i++)
        j->x[MODEL_NQ + i][n] = k < 0 ? 0.0 : f * contact_rate(j, i, k);
    for (int i = 0; i < MODEL_NZ - MODEL_NE; i++)
        j->x[MODEL_NQ + MODEL_NV + i][n] = k < 0 ? 0.0 : f * j->zrate[i][k];
    /* of all free elements of an array the one that is next; the others follow in elements_spread */
    for (int c = 0; MODEL_NE > 0 && c < MODEL_NC; c++)
        if (contact_is_array(c) && j->next[c] >= 0) j->x[j->next[c]][n] = k < 0 ? 0.0 : f * j->slip[c - 1][k];
}

/* the states, and all that the search for events reads, in the root of time; to the order given */
void flow_rooted_series(Point *at, Jets *j, int order)
{
    flow_load(at, j, 1);
    flow_extend(j, 1, 1);
    model_slip(at->p, at->d, j, 0);
    KIND(rooted_depths)(at, j, 0);
    for (int k = 0; k < order; k++) {
        KIND(rooted_depths)(at, j, k + 1);
        flow_field(at, j, k, 1);
        if (k + 2 <= order + 1) flow_extend(j, k + 2, 1);
    }
    model_slip(at->p, at->d, j, order);
    KIND(flow_releases)(at, j, order);
    KIND(elements_spread)(j, order);
}

/* the same in time */
void flow_series(Point *at, Jets *j, int order)
{
    flow_load(at, j, 0);
    for (int k = 0; k < order; k++) {
        flow_field(at, j, k, 0);
        flow_extend(j, k + 1, 0);
    }
    flow_finish(at, j, order);
}

void flow_finish(const Point *at, Jets *j, int order)
{
    if (!j->apart) model_slip(at->p, at->d, j, order);
    if (MODEL_BOUNDED) model_depth(at->p, at->d, j, order);
    KIND(flow_releases)(at, j, order);
    KIND(elements_spread)(j, order);
}
