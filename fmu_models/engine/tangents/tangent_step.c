/*
 * The step in use, no longer than the derivatives keep the tolerance, and the variations of its series.
 */
#include "tangent_step.h"

#include "../step/linear.h"
#include "../step/reach.h"
#include "../step/roots.h"
#include "../step/taylor.h"
#include "indicator_series.h"
#include "linear_variation.h"

/* where the series of the tangents start */
static void load_variations(const Run *r, Tangents *tangents)
{
    for (int k = 0; k < tangents->count; k++) {
        Jets *j = &tangents->list[k].jets;
        const Point *at = &tangents->list[k].at;
        Variation *l = variation_of(tangents, k);
        const int lane = k % PAIR;
        l->t[0][lane] = cimag(at->time) / EPS;
        if (MODEL_NU > 0) flow_load(at, j, r->segment_rooted);
        for (int i = 0; i < MODEL_NU; i++) {
            for (int n = 0; n <= 2 * MODEL_INPUT_DEGREE; n++) {
                l->u[i][n][lane] = cimag(j->u[i][n]) / EPS;
                l->du[i][n][lane] = cimag(j->du[i][n]) / EPS;
            }
        }
        for (int i = 0; i < MODEL_NX; i++)
            l->x[i][0][lane] = cimag(at->x[i]) / EPS;
        for (int c = 0; c < MODEL_NC; c++)
            l->memory[c][lane] = cimag(at->memory[c]) / EPS;
    }
}

/* derivatives of the inverse of the matrix of the held contacts */
static void vary_held(void *of, const Run *r, Variation *l)
{
    Tangents *tangents = of;
    const int first = (int)(l - variation_of(tangents, 0)) * PAIR;
    signed char member[NC];
    for (int c = 0; c < MODEL_NC; c++)
        member[c] = (signed char)contact_is_held(r->at.state, c);
    for (int k = first; k < first + PAIR && k < tangents->count; k++) {
        Point *at = &tangents->list[k].at;
        Jets *j = &tangents->list[k].jets;
        for (int c = 0; c < MODEL_NC; c++) {
            j->capacity[c][0] = r->jets.capacity[c][0] + EPS * l->capacity[c][0][k % PAIR] * _Complex_I;
            if (MODEL_DIRECTED) {
                j->capacity_minus[c][0] = r->jets.capacity_minus[c][0]
                                          + EPS * l->capacity_minus[c][0][k % PAIR] * _Complex_I;
            }
            for (int e = 0; e < MODEL_NC; e++)
                j->G[c][e][0] = r->jets.G[c][e][0] + EPS * l->G[c][e][0][k % PAIR] * _Complex_I;
        }
        contact_factor(at, j, member, at->state, &at->sticking);
        for (int i = 0; i < at->sticking.count; i++)
            for (int e = at->sticking.first[i]; e < at->sticking.last[i]; e++)
                l->inverse[i][e][k % PAIR] = cimag(at->sticking.inverse[i][e]) / EPS;
    }
}

/* the derivatives of series of a tangent */
static void take_series(Real (*own)[MODEL_TERMS + 1], int n, PairSeries *to, int lane)
{
    for (int i = 0; i < n; i++)
        for (int m = 0; m <= MODEL_TERMS; m++)
            to[i][m][lane] = cimag(own[i][m]) / EPS;
}

/* the variations of one tangent where there are cones: their series have no variations of their own, and run in numbers
   with a tangent */
static void follow_series(const Run *r, Tangent *t, Variation *l, int lane)
{
    const int order = r->segment_rests >= 0 ? r->segment_order : taylor_order(r);
    if (r->segment_rests >= 0) {
        flow_load(&t->at, &t->jets, 0);
        flow_field(&t->at, &t->jets, 0, 0);
        t->rest = cone_end(&t->at, &t->jets, r->segment_rests);
    } else if (r->segment_rooted)
        flow_rooted_series(&t->at, &t->jets, order);
    else
        flow_series(&t->at, &t->jets, order);
    take_series(t->jets.x, MODEL_NX, l->x, lane);
    take_series(t->jets.slip, MODEL_NC, l->slip, lane);
    take_series(t->jets.force, MODEL_NC, l->force, lane);
    take_series(t->jets.capacity, MODEL_NC, l->capacity, lane);
    take_series(t->jets.capacity_minus, MODEL_DIRECTED ? MODEL_NC : 0, l->capacity_minus, lane);
    take_series(t->jets.depth, MODEL_NC, l->depth, lane);
    take_series(t->jets.release, MODEL_NC, l->release, lane);
    l->order = r->segment_rooted ? order : variation_order(&r->jets, l, order);
}

/* the variations of the series of the step, or of those in the root of the time that is left */
static void vary_series(const Run *r, Tangents *tangents, double ending)
{
    load_variations(r, tangents);
    for (int k = 0; MODEL_CONES > 0 && k < tangents->count; k++)
        follow_series(r, &tangents->list[k], variation_of(tangents, k), k % PAIR);
    if (MODEL_CONES > 0) return;
    for (int k = 0; k < tangents->count; k += PAIR) {
        Variation *l = variation_of(tangents, k);
        l->ending = ending;
        variation_series(r, l, r->segment_linear ? 1 : taylor_order(r), vary_held, tangents);
        if (r->segment_linear) linear_variation(r, tangents, k, 0);
    }
}

/* of the relative size that a derivative has in its largest part: what is smaller than this in others need not be exact */
static const double NEGLIGIBLE = 1e-6;

/* derivatives are followed to the tolerance of the motion times this: what they miss decides no event, and does not grow
   on the way */
static const double LOOSER = 10.0;

static double state_size(const Run *r, int i) { return fabs(r->at.x[i]) + model_nominal_states[i]; }

/* the largest derivative along a direction, relative to what it is of */
static double relative_size(const Run *r, const Tangent *t)
{
    double largest = t->relative;
    for (int i = 0; i < MODEL_NX; i++)
        largest = fmax(largest, fabs(cimag(t->at.x[i])) / state_size(r, i));
    for (int c = 0; c < MODEL_NC; c++)
        largest = r->at.memory[c] > 0.0 ? fmax(largest, fabs(cimag(t->at.memory[c])) / r->at.memory[c]) : largest;
    return largest / EPS;
}

/* the derivative of state i along tangent k, no smaller at its start than matters */
static void read_series(const Run *r, Tangents *tangents, int k, int i, double *derivative)
{
    const Variation *l = variation_of(tangents, k);
    for (int m = 0; m <= l->order; m++)
        derivative[m] = l->x[i][m][k % PAIR];
    derivative[0] = fmax(fabs(derivative[0]), NEGLIGIBLE * relative_size(r, &tangents->list[k]) * state_size(r, i));
}

/* the length of that */
static double series_length(const Run *r, Tangents *tangents, int k, int i)
{
    const Variation *l = variation_of(tangents, k);
    double derivative[POLYNOMIAL_TERMS];
    read_series(r, tangents, k, i, derivative);
    return taylor_series_length(derivative, l->order, LOOSER * r->tolerances.step);
}

/*
 * How far neighbours are, in parts of the size of the motion. Those far away share the disc with poles and with steps of
 * laws that the motion is not near; near ones tell less of the derivative, and shorten the step by their part to the power
 * of one over the order: 1.3 for each of these.
 */
static const double FIRST_APART = 0x1p-4, NEARER = 0x1p-10;
enum { NEIGHBOURS = 4 };

/* a length of less than this part of the step asks for nearer neighbours */
static const double WORTH = 0.5;

/* whether a parameter that is zero moves: what it weighs is nothing in the motion, and all in the derivative */
static int read_weightless(const Run *r, const Variation *l, int lane, double *weightless)
{
    int moves = 0;
    for (int i = 0; i < MODEL_NP; i++) {
        weightless[i] = r->at.p[i] == 0.0 ? l->p[i][lane] : 0.0;
        moves |= weightless[i] != 0.0;
    }
    return moves;
}

/* the length over which neighbours along tangent k see no more than its series shows, if it is less than h; else h */
static double neighbour_reach(Run *r, Tangents *tangents, int k, double h)
{
    const int order = variation_of(tangents, k)->order;
    StateSeries along[MODEL_ROOM(MODEL_NX)];
    double weightless[MODEL_ROOM(MODEL_NP)];
    const int moves = read_weightless(r, variation_of(tangents, k), k % PAIR, weightless);
    double scale = moves ? FIRST_APART : INFINITY;
    for (int i = 0; i < MODEL_NX; i++) {
        read_series(r, tangents, k, i, along[i]);
        const double size = fmax(fabs(along[i][0]), fabs(along[i][1]) * h);
        scale = size > 0.0 ? fmin(scale, FIRST_APART * state_size(r, i) / size) : scale;
    }
    if (!isfinite(scale) || order < 3) return h;
    double reach = 0.0;
    for (int trial = 0; trial < NEIGHBOURS && reach < WORTH * h; trial++, scale = NEARER) {
        for (int i = 0; i < MODEL_NP; i++)
            weightless[i] *= scale;
        for (int i = 0; i < MODEL_NX; i++)
            for (int m = 0; m <= order; m++)
                along[i][m] *= scale;
        const double least = trial < NEIGHBOURS - 1 ? fmax(reach, WORTH * WORTH * h) : reach;
        const Neighbour neighbour = {(const StateSeries *)along, moves ? weightless : NULL};
        reach = fmax(reach, reach_of_step(r, &neighbour, order, h, least));
    }
    return reach > 0.0 ? reach : h;
}

/* the length over which the derivatives of the states keep the tolerance, if it is less than h; else h */
static double shortest_length(Run *r, Tangents *tangents, double h)
{
    double shortest = h;
    double power = 1.0;
    for (int k = 0; MODEL_REACH && k < tangents->count; k++)
        shortest = neighbour_reach(r, tangents, k, shortest);
    for (int k = 0; k < tangents->count; k++) {
        const Variation *l = variation_of(tangents, k);
        const int sums = r->segment_linear && l->order == LINEAR_ORDER;
        if (k % PAIR == 0) power = sums ? linear_power(r, h) : pow(h, l->order - 1);
        for (int i = 0; i < MODEL_NX; i++) {
            const PairSeries *x = &l->x[i];
            const int lane = k % PAIR;
            const double size = fmax(fabs((*x)[0][lane]), fabs((*x)[1][lane]) * h);
            const double last = fmax(fabs((*x)[l->order - 1][lane]), fabs((*x)[l->order][lane]) * h) * power;
            if (!(last <= LOOSER * r->tolerances.step * size)) {
                const double length = series_length(r, tangents, k, i);
                shortest = length > 0.0 ? fmin(shortest, length) : shortest;
            }
        }
    }
    return shortest;
}

/* whether a force that is not analytic in time lets go at the end of the step */
static int ends_at_root(const Run *r)
{
    int ends = 0;
    for (int c = 0; c < MODEL_NC; c++)
        ends |= model_contact_rooted[c] && r->at.state[c] == CONTACT_TOUCHING && r->falling[c][SLOT_NORMAL];
    return ends;
}

RunStatus tangents_fit_step(Run *r, Tangents *tangents)
{
    if (r->segment_rooted) {
        vary_series(r, tangents, 0.0); /* there is no series in time */
        return RUN_OK;
    }
    taylor_complete(r);
    vary_series(r, tangents, 0.0);
    if (r->segment_rests >= 0) return RUN_OK;
    const double length = shortest_length(r, tangents, r->segment_length);
    if (!(length < r->segment_length) || !ends_at_root(r) || r->at.curved || MODEL_CONES > 0)
        return taylor_shorten(r, length);
    const double ending = variation_ending(r, taylor_order(r), tangents->rate);
    vary_series(r, tangents, ending);
    if (shortest_length(r, tangents, ending) < ending) {
        vary_series(r, tangents, 0.0);
        return taylor_shorten(r, length);
    }
    return RUN_OK;
}

double tangents_slope(const Run *r, Tangents *tangents, int i, double length)
{
    const Variation *l = variation_of(tangents, 0);
    const double s = variation_variable(r, l, length);
    /* series in time know the rates less well than the states, the more so the shorter they are */
    if (l->ending > 0.0) return polynomial_value(tangents->rate[i], taylor_order(r) - 1, s);
    return polynomial_slope(r->jets.x[i], r->segment_order, s);
}

#include "../model/scalar_real.h"
