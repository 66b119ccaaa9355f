/*
 * States and outputs of a motion at any time within its step, and their derivatives at that very time.
 *
 *     states     x(t) from the series of the run; dx/dp from those of the tangents, two at once, less x'(t) times the
 *                derivative of the time from which the tangent started (an event that came earlier or later)
 *     outputs    each tangent at its own point there: order 0 of what the model makes of time, inputs and states
 */
#include "tangent_output.h"

#include "../step/roots.h"

#include "tangent_step.h"

/* rate of a state within the step, in time */
static double rate_inside(const Run *r, Tangents *tangents, int i, double length)
{
    const double slope = tangents_slope(r, tangents, i, length);
    return r->segment_rooted ? slope / (2.0 * sqrt(length)) : slope;
}

void tangents_rates(const Run *r, Tangents *tangents, double time, double *rates)
{
    for (int i = 0; i < MODEL_NX; i++)
        rates[i] = rate_inside(r, tangents, i, (time - r->segment_start) - r->jets.time_rest);
}

/* states and their derivatives within the step */
static void states_inside(const Run *r, Tangents *tangents, double length)
{
    const double s = r->segment_rooted ? sqrt(length) : length;
    for (int i = 0; i < MODEL_NX; i++) {
        const double rate = rate_inside(r, tangents, i, length);
        tangents->x[i] = polynomial_value(r->jets.x[i], r->segment_order, s);
        for (int k = 0; k < tangents->count; k += PAIR) {
            Variation *l = variation_of(tangents, k);
            const double at = variation_variable(r, l, length);
            l->here[i] = pair_value(l->x[i], l->order, at) - rate * l->t[0];
        }
    }
}

static void evaluate_outputs(Tangents *tangents, int k, double length)
{
    Tangent *t = &tangents->list[k];
    Jets *j = &tangents->scratch;
    const Variation *l = variation_of(tangents, k);
    const Real since = since_start(t, length);
    Point at = t->at;
    for (int i = 0; i < MODEL_NX; i++)
        at.x[i] = tangents->x[i] + EPS * l->here[i][k % PAIR] * _Complex_I;
    inputs_move(&at, since);
    at.time += since;
    if (length > 0.0) memset(at.known, 0, sizeof at.known);
    flow_load(&at, j, 0);
    model_inertia(at.p, at.d, j, 0);
    flow_field(&at, j, 0, 0);
    model_outputs(at.p, at.d, j, 0);
    for (int i = 0; i < MODEL_NY; i++)
        t->y[i] = j->y[i][0];
}

void tangents_evaluate(const Run *r, Tangents *tangents, double time, int outputs)
{
    const int inside = time > r->at.time;
    const double length = inside ? (time - r->segment_start) - r->jets.time_rest : 0.0;
    if (inside) {
        states_inside(r, tangents, length);
    } else {
        for (int i = 0; i < MODEL_NX; i++) {
            tangents->x[i] = r->at.x[i];
            for (int k = 0; k < tangents->count; k++)
                variation_of(tangents, k)->here[i][k % PAIR] = cimag(tangents->list[k].at.x[i]) / EPS;
        }
    }
    for (int k = 0; outputs && k < tangents->count; k++)
        evaluate_outputs(tangents, k, length);
}

double tangents_value(const Tangents *tangents, Of what, int index)
{
    const Tangent *first = &tangents->list[0];
    return what == OF_OUTPUT   ? creal(first->y[index])
           : what == OF_MEMORY ? creal(first->at.memory[index])
                               : tangents->x[index];
}

double tangents_derivative(Tangents *tangents, int k, Of what, int index)
{
    const Tangent *t = &tangents->list[k];
    return what == OF_OUTPUT   ? cimag(t->y[index]) / EPS
           : what == OF_MEMORY ? cimag(t->at.memory[index]) / EPS
                               : variation_of(tangents, k)->here[index][k % PAIR];
}

#include "../model/scalar_real.h"
