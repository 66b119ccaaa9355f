/*
 * Forces of the contacts at one order of the Taylor series. Slipping contacts have a law; held ones (sticking friction,
 * closed rigid contacts) share whatever keeps their y at rest:
 *
 *     G_ss lambda_s = -(slip_rate_s + G_sl lambda_l)                                             (1)
 *
 * The friction of a closed rigid contact n that slips has lambda_t = -sign mu lambda_n: column n of G_ss is
 * G_sn - sign mu G_st then.
 */
#include "contact_forces.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

/* order k of the product of two series */
static Real KIND(product)(const Real *a, const Real *b, int k)
{
    Real sum = 0.0;
    for (int i = 0; i <= k; i++)
        sum += a[i] * b[k - i];
    return sum;
}

/* order k of G lambda for row c; forces still unknown at this order count as zero */
static Real KIND(transmitted)(const Point *at, const Jets *j, int c, int k)
{
    Real sum = 0.0;
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        /* what is still unknown at this order acts through its lower orders only */
        const int silent = MODEL_CONSTANT_INERTIA && !contact_has_law(at->state, e);
        if (silent || at->state[e] == CONTACT_AWAY || at->state[e] == CONTACT_RELEASED) continue;
        sum += MODEL_CONSTANT_INERTIA ? j->G[c][e][0] * j->force[e][k] : KIND(product)(j->G[c][e], j->force[e], k);
    }
    return sum;
}

/* order k of what follows from the forces of rigid contacts: their slipping friction, and what their friction can
   hold */
static void KIND(friction_of_rigid)(const Point *at, Jets *j, int k)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_impulsive[c] || at->state[c] == CONTACT_AWAY) continue;
        j->capacity[c][k] = model_friction(at->p, at->d, c) * j->force[normal][k];
        stick_mirror(j, c, k);
        if (at->state[c] != CONTACT_STICK) j->force[c][k] = contact_drag(at, at->state, normal) * j->force[normal][k];
    }
}

/* order k of the forces of held contacts, all others known */
static void KIND(hold)(Point *at, Jets *j, int k)
{
    Sticking *s = &at->sticking;
    Real rest[NC];
    for (int i = 0; i < s->count; i++) {
        j->force[s->contact[i]][k] = 0.0;
        rest[i] = j->slip_rate[s->contact[i]][k];
    }
    for (int i = 0; i < s->count; i++)
        rest[i] += KIND(transmitted)(at, j, s->contact[i], k);
    for (int i = 0; i < s->count; i++) {
        Real force = 0.0;
        for (int e = s->first[i]; e < s->last[i]; e++)
            force -= s->inverse[i][e] * rest[e];
        j->force[s->contact[i]][k] = force;
    }
}

void contact_forces(Point *at, Jets *j, int k)
{
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (cone_is_side(c)) continue;
        if (cone_is_whole(c)) {
            any |= cone_forces(at, j, k, c);
        } else if (contact_is_held(at->state, c)) {
            model_stick(at->p, at->d, j, k, c);
            j->force[c][k] = 0.0;
            any = 1;
        } else if (contact_has_law(at->state, c)) {
            model_law(at->p, at->d, j, k, c);
        } else {
            j->force[c][k] = 0.0;
        }
    }
    if (any && k == 0) {
        signed char member[NC];
        for (int c = 0; c < MODEL_NC; c++)
            member[c] = (signed char)contact_is_held(at->state, c);
        contact_factor(at, j, member, at->state, &at->sticking);
    }
    if (!any) at->sticking.count = 0;
    if (any) KIND(hold)(at, j, k);
    for (int c = 0; c < MODEL_NC && MODEL_CONES > 0; c++)
        if (j->rising[c] && cone_rise(at, j, k, c) && any) KIND(hold)(at, j, k);
    if (!any) return;
    if (MODEL_IMPACTS > 0) KIND(friction_of_rigid)(at, j, k);
}

Real contact_rate(const Jets *j, int i, int k)
{
    Real sum = j->a[i][k];
    for (int n = model_acting_first[i]; n < model_acting_first[i + 1]; n++) {
        const int c = model_acting[n];
        sum += MODEL_CONSTANT_INERTIA ? j->W[i][c][0] * j->force[c][k] : KIND(product)(j->W[i][c], j->force[c], k);
    }
    return sum;
}

Real contact_rest_rate(const Point *at, Jets *j, int c)
{
    for (int i = 0; i < MODEL_NV; i++)
        j->x[MODEL_NQ + i][1] = contact_rate(j, i, 0);
    model_slip(at->p, at->d, j, 1);
    return j->slip[c][1];
}

/* what projection brings to zero */
static Real KIND(speed_to_stop)(const Point *at, Jets *j, int c)
{
    return contact_may_rest(c) ? contact_rest_rate(at, j, c) : j->slip[c][0];
}

int contact_project(Point *at, Jets *j, const signed char *member, const signed char *state)
{
    Sticking s;
    contact_factor(at, j, member, state, &s);
    int moved = 0;
    for (int i = 0; i < s.count; i++) {
        const int c = s.contact[i];
        Real impulse = 0.0;
        for (int e = s.first[i]; e < s.last[i]; e++)
            impulse -= s.inverse[i][e] * KIND(speed_to_stop)(at, j, s.contact[e]);
        if (impulse == 0.0) continue;
        moved = 1;
        for (int v = 0; v < MODEL_NV; v++) {
            at->x[MODEL_NQ + v] += j->W[v][c][0] * impulse;
            if (s.drag[i] != 0.0)
                at->x[MODEL_NQ + v] += j->W[v][(int)model_contact_partner[c]][0] * s.drag[i] * impulse;
        }
    }
    return moved;
}

void contact_impulse(const Point *at, const Jets *j, const ImpactPhase *phase, const Real *given, const Real *target,
                     Real *impulse)
{
    Sticking s;
    contact_factor(at, j, phase->held, phase->friction, &s);
    for (int c = 0; c < MODEL_NC; c++)
        impulse[c] = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_impulsive[c] && !phase->held[c] && given[c] != 0.0) {
            impulse[c] = given[c];
            if (model_contact_partner[c] >= 0 && !phase->held[(int)model_contact_partner[c]])
                impulse[(int)model_contact_partner[c]] = contact_drag(at, phase->friction, c) * given[c];
        }
    }
    Real rest[NC] = {0};
    for (int i = 0; i < s.count; i++) {
        const int c = s.contact[i];
        rest[i] = j->slip[c][0] - target[c];
        for (int e = 0; e < MODEL_NC; e++)
            rest[i] += j->G[c][e][0] * impulse[e];
    }
    for (int i = 0; i < s.count; i++) {
        Real sum = 0.0;
        for (int e = s.first[i]; e < s.last[i]; e++)
            sum -= s.inverse[i][e] * rest[e];
        impulse[s.contact[i]] = sum;
        if (s.drag[i] != 0.0) impulse[(int)model_contact_partner[s.contact[i]]] = s.drag[i] * sum;
    }
}

void contact_targets(const Point *at, const Jets *j, int number, const Real *before, Real *given, Real *target)
{
    for (int c = 0; c < MODEL_NC; c++) {
        given[c] = 0.0;
        target[c] = 0.0;
        if (!model_contact_impulsive[c]) continue;
        if (number > 0)
            given[c] = model_restitution(at->p, at->d, c) * before[c];
        else if (!model_contact_poisson[c] && PART(j->slip[c][0]) < 0.0)
            target[c] = -model_restitution(at->p, at->d, c) * j->slip[c][0];
    }
}

void contact_apply(Point *at, Jets *j, const Real *impulse)
{
    for (int v = 0; v < MODEL_NV; v++) {
        for (int c = 0; c < MODEL_NC; c++)
            if (impulse[c] != 0.0) at->x[MODEL_NQ + v] += j->W[v][c][0] * impulse[c];
    }
    for (int c = 0; c < MODEL_NC; c++)
        for (int e = 0; e < MODEL_NC; e++)
            j->slip[c][0] += j->G[c][e][0] * impulse[e];
}
