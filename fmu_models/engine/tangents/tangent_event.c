/*
 * What the run has done to its contacts and states at one instant, repeated in numbers with a tangent.
 */
#include "tangent_event.h"

#include "../step/contact_forces.h"
#include "../step/flow.h"

/* derivatives below here count as zero: what they lead to would lose its digits below the least number there is */
static const double SMALLEST = 1e-150;

/* a number of the run with the derivative that the tangent has */
static Real joined(double value, Real own)
{
    const double derivative = cimag(own);
    return value + (fabs(derivative) < SMALLEST * EPS ? 0.0 : derivative) * _Complex_I;
}

void tangent_rejoin(const Run *r, Tangent *t)
{
    for (int i = 0; i < MODEL_NX; i++)
        t->at.x[i] = joined(r->at.x[i], t->at.x[i]);
    for (int i = 0; i < MODEL_NU; i++) {
        t->at.u[i] = joined(r->at.u[i], t->at.u[i]);
        t->at.du[i] = joined(r->at.du[i], t->at.du[i]);
        for (int n = 2; r->at.curved && n <= MODEL_INPUT_DEGREE; n++)
            t->at.bend[i][n - 2] = joined(r->at.bend[i][n - 2], t->at.bend[i][n - 2]);
    }
    memcpy(t->at.cycle, r->at.cycle, sizeof t->at.cycle);
    memcpy(t->at.piece, r->at.piece, sizeof t->at.piece);
    for (int c = 0; c < MODEL_NC; c++)
        t->at.memory[c] = joined(r->at.memory[c], t->at.memory[c]);
    t->at.time = joined(r->at.time, t->at.time);
    t->at.time_rest = r->at.time_rest;
    memcpy(t->at.state, r->at.state, sizeof t->at.state);
    memcpy(t->at.held, r->at.held, sizeof t->at.held);
    memcpy(t->at.settles, r->at.settles, sizeof t->at.settles);
    memcpy(t->at.known, r->at.known, sizeof t->at.known);
}

void tangent_load_signals(const Run *r, Tangent *t)
{
    memcpy(t->at.cycle, r->at.cycle, sizeof t->at.cycle);
    memcpy(t->at.piece, r->at.piece, sizeof t->at.piece);
    signals_load(&t->at);
}

/* the impact with the impulses that the run has found to fit */
static void repeat_impact(const Run *r, Tangent *t)
{
    Jets *j = &t->jets;
    Real impulse[NC] = {0.0};
    Real given[NC];
    Real target[NC];
    if (!MODEL_CONSTANT_INERTIA) model_inertia(t->at.p, t->at.d, j, 0);
    for (int number = 0; number < r->impact_phases; number++) {
        contact_targets(&t->at, j, number, impulse, given, target);
        contact_impulse(&t->at, j, &r->impact[number], given, target, impulse);
        contact_apply(&t->at, j, impulse);
    }
}

void tangent_project(const Run *r, Tangent *t, const signed char *member)
{
    Jets *j = &t->jets;
    flow_load(&t->at, j, 0);
    flow_field(&t->at, j, 0, 0);
    for (int c = 0; c < MODEL_NC; c++)
        if (r->at.state[c] != CONTACT_STICK) stick_unweighted(j, c);
    contact_project(&t->at, j, member, t->at.state);
}

void tangent_repeat_event(const Run *r, Tangent *t)
{
    Jets *j = &t->jets;
    int any = 0;
    flow_load(&t->at, j, 0);
    model_slip(t->at.p, t->at.d, j, 0);
    for (int c = 0; c < MODEL_NC; c++) {
        if (r->entered[c]) t->at.memory[c] = creal(j->slip[c][0]) < 0.0 ? -j->slip[c][0] : j->slip[c][0];
        if (r->jumped[c] && contact_is_array(c))
            KIND(elements_hold)(t->at.d, c, r->at.held, t->at.x);
        else if (r->jumped[c])
            model_reset(t->at.p, t->at.d, j, c, t->at.x);
        any |= r->projected[c];
    }
    repeat_impact(r, t);
    memcpy(t->at.state, r->at.state, sizeof t->at.state);
    if (any) tangent_project(r, t, r->projected);
    tangent_rejoin(r, t);
}

#include "../model/scalar_real.h"
