/* How far start values, or an importer that integrates by itself, may be off at the wall of a rigid contact. */
#include "gap_tolerance.h"

#include "../step/flow.h"
#include "../step/taylor.h"

void gap_measure_nominal(Run *r)
{
    const double PART = 1e-6; /* of what is no rigid contact, and needs it only where all terms of its gap are zero */
    Jets *j = &r->scratch;
    memset(r->nominal_gap, 0, sizeof r->nominal_gap);
    if (!MODEL_BOUNDED) return;
    taylor_load(r, j);
    model_slip(r->at.p, r->at.d, j, 0);
    model_depth(r->at.p, r->at.d, j, 0);
    j->t[1] = 0.0;
    for (int i = 0; i < MODEL_NU; i++)
        j->u[i][1] = 0.0;
    for (int k = 0; k < MODEL_NQ; k++) {
        for (int i = 0; i < MODEL_NX; i++)
            j->x[i][1] = i == k ? model_nominal_states[k] : 0.0;
        model_slip(r->at.p, r->at.d, j, 1);
        model_depth(r->at.p, r->at.d, j, 1);
        for (int c = 0; c < MODEL_NC; c++)
            r->nominal_gap[c] +=
                model_contact_bounded[c] ? (model_contact_impulsive[c] ? 1.0 : PART) * fabs(j->depth[c][1]) : 0.0;
    }
}

double gap_shift(const Run *r, const Jets *j, int c)
{
    return r->tolerances.importer * (model_depth_magnitude(r->at.p, r->at.d, j, c) + r->nominal_gap[c]);
}

double gap_resolution(const Run *r, const Jets *j, int c)
{
    return r->tolerances.drift * (model_depth_magnitude(r->at.p, r->at.d, j, c) + r->nominal_gap[c]);
}

/* by how much the depth at a point differs from the one given, in a step that is not in use; 0 where there is none */
static double depth_change(Run *r, Point *at, int c, double depth)
{
    Jets *j = &r->jets;
    model_prepare(at->p, at->d);
    flow_load(at, j, 0);
    model_slip(at->p, at->d, j, 0);
    model_depth(at->p, at->d, j, 0);
    const double change = fabs(j->depth[c][0] - depth);
    return isfinite(change) ? change : 0.0;
}

/* how far the gap goes over the time in which its motion changes: terms that are zero at one phase have their size */
static double gap_reach(Run *r, int c)
{
    enum { ORDER = 8 };
    const double LAST_TERM = 1e-3; /* in parts of the first ones */
    const double *depth = r->jets.depth[c];
    double largest = 0.0, power = 1.0;
    taylor_series(r, &r->jets, ORDER, INFINITY);
    const double length = taylor_series_length(depth, ORDER, LAST_TERM);
    /* a parabola, as free fall is: until it is back */
    const double time = isfinite(length) ? length : fabs(depth[2]) > 0.0 ? fabs(depth[1] / depth[2]) : 0.0;
    for (int k = 1; k <= ORDER; k++) {
        power *= time;
        largest = fmax(largest, fabs(depth[k]) * power);
    }
    return isfinite(largest) ? largest : 0.0;
}

double gap_rounding(Run *r, int c)
{
    /* so many last digits, that the rounding of the depth itself does not count; and so many times what one makes */
    enum { DIGITS = 64, ROUNDINGS = 4 };
    const double moved = 1.0 + DIGITS * DBL_EPSILON;
    const double depth = r->scratch.depth[c][0];
    Point at = r->at;
    double sum = 0.0;
    for (int i = 0; i < MODEL_NP; i++) {
        at.p[i] = r->at.p[i] * moved;
        sum += depth_change(r, &at, c, depth);
        at.p[i] = r->at.p[i];
    }
    for (int i = 0; i < MODEL_NU; i++) {
        at.u[i] = r->at.u[i] * moved;
        sum += depth_change(r, &at, c, depth);
        at.u[i] = r->at.u[i];
    }
    at.time = r->at.time * moved;
    sum += depth_change(r, &at, c, depth);
    return ROUNDINGS * (sum / DIGITS + DBL_EPSILON * gap_reach(r, c));
}
