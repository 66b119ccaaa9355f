/*
 * The flow of step/flow.c and the forces of step/contact_forces.c, differentiated, on top of the series of a step:
 *
 *     in time:               X[k+1] = RATE[k]/(k+1)
 *     in s = sqrt(time):     X[k+2] = 2 RATE[k]/(k+2), X[1] = 0
 *     held contacts:         f = -S r,  F = -S R - dS r,  r: what their forces must stand up to, S: inverse of G
 *
 * Decisions are those of the step: states of contacts, orders, what counts as zero.
 */
#include "variation.h"

#include "pair_jets.h"

#include "../model_variation.c"

/* order k of the variation of the product of two series, from the order `first` of b on */
static Pair variation_product(const double *a, const Pair *A, const double *b, const Pair *B, int k, int first)
{
    Pair sum = PAIR_ZERO;
    for (int i = first; i <= k; i++) {
        sum += a[k - i] * B[i] + A[k - i] * b[i];
    }
    return sum;
}

/* whether a force takes part in G lambda at all, and whether its order k is known before it is solved for */
static int is_transmitted(const Run *r, int e)
{
    const int silent = MODEL_CONSTANT_INERTIA && !contact_has_law(r->at.state, e);
    return !silent && r->at.state[e] != CONTACT_AWAY && r->at.state[e] != CONTACT_RELEASED;
}

static int first_unknown(const Run *r, int e) { return contact_has_law(r->at.state, e) ? 0 : 1; }

/* order k of what row c of the held contacts must stand up to, in numbers of the run */
static double variation_rest(const Run *r, int c, int k)
{
    const Jets *j = &r->jets;
    double sum = j->slip_rate[c][k];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        for (int i = 0; is_transmitted(r, e) && i <= (MODEL_CONSTANT_INERTIA ? 0 : k - first_unknown(r, e)); i++) {
            sum += j->G[c][e][i] * j->force[e][k - i];
        }
    }
    return sum;
}

/* the same, differentiated */
static Pair variation_rest_pair(const Run *r, const Variation *l, int c, int k)
{
    const Jets *j = &r->jets;
    Pair sum = l->slip_rate[c][k];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        if (!is_transmitted(r, e)) {
            continue;
        }
        if (MODEL_CONSTANT_INERTIA) {
            sum += j->G[c][e][0] * l->force[e][k] + l->G[c][e][0] * j->force[e][k];
        } else {
            sum += variation_product(j->force[e], l->force[e], j->G[c][e], l->G[c][e], k, first_unknown(r, e));
        }
    }
    return sum;
}

/* order k of what follows from the forces of rigid contacts */
static void variation_friction(const Run *r, Variation *l, int k)
{
    const Jets *j = &r->jets;
    for (int c = 0; c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_is_impact[c] || r->at.state[c] == CONTACT_AWAY) {
            continue;
        }
        const double friction = model_friction(r->at.p, r->at.d, c);
        l->capacity[c][k] = friction * l->force[normal][k] + l->friction[c] * j->force[normal][k];
        if (r->at.state[c] != CONTACT_STICK) {
            const double sign = r->at.state[c] == CONTACT_SLIP_PLUS    ? -1.0
                                : r->at.state[c] == CONTACT_SLIP_MINUS ? 1.0
                                                                       : 0.0;
            l->force[c][k] = sign * l->capacity[c][k];
        }
    }
}

static void variation_forces(const Run *r, Variation *l, int k)
{
    const Point *at = &r->at;
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (contact_is_held(at->state, c)) {
            model_stick_variation(at->p, at->d, &r->jets, l, k, c);
            l->force[c][k] = PAIR_ZERO;
            any = 1;
        } else if (contact_has_law(at->state, c)) {
            model_law_variation(at->p, at->d, &r->jets, l, k, c);
        } else {
            l->force[c][k] = PAIR_ZERO;
        }
    }
    if (!any) {
        return;
    }
    const Sticking *s = &at->sticking;
    double rest[NC];
    Pair rests[NC];
    for (int i = 0; i < s->count; i++) {
        rest[i] = l->bends ? variation_rest(r, s->contact[i], k) : 0.0;
        rests[i] = variation_rest_pair(r, l, s->contact[i], k);
    }
    for (int i = 0; i < s->count; i++) {
        Pair force = PAIR_ZERO;
        for (int e = s->first[i]; e < s->last[i]; e++) {
            force -= s->inverse[i][e] * rests[e];
            if (l->bends) {
                force -= l->inverse[i][e] * rest[e];
            }
        }
        l->force[s->contact[i]][k] = force;
    }
    if (MODEL_IMPACTS > 0) {
        variation_friction(r, l, k);
    }
}

/* order k of the rate of v[i] */
static Pair variation_rate(const Run *r, const Variation *l, int i, int k)
{
    const Jets *j = &r->jets;
    Pair sum = l->a[i][k];
    for (int n = model_acting_first[i]; n < model_acting_first[i + 1]; n++) {
        const int c = model_acting[n];
        if (MODEL_CONSTANT_INERTIA) {
            sum += j->W[i][c][0] * l->force[c][k] + l->W[i][c][0] * j->force[c][k];
        } else {
            sum += variation_product(j->W[i][c], l->W[i][c], j->force[c], l->force[c], k, 0);
        }
    }
    return sum;
}

static void variation_extend(const Run *r, Variation *l, int n, int rooted)
{
    const int k = n - time_power(rooted);
    const double f = (double)time_power(rooted) / n;
    for (int i = 0; i < MODEL_NQ; i++) {
        l->x[i][n] = k < 0 ? PAIR_ZERO : f * l->x[MODEL_NQ + i][k];
    }
    for (int i = 0; i < MODEL_NV; i++) {
        l->x[MODEL_NQ + i][n] = k < 0 ? PAIR_ZERO : f * variation_rate(r, l, i, k);
    }
    for (int i = 0; i < MODEL_NZ; i++) {
        l->x[MODEL_NQ + MODEL_NV + i][n] = k < 0 ? PAIR_ZERO : f * l->zrate[i][k];
    }
}

/* order k of the rates of slip, which are left out where no contact touches */
static void variation_slip(const Run *r, Variation *l, int k)
{
    if (k < 2 || !r->jets.apart) {
        model_slip_variation(r->at.p, r->at.d, &r->jets, l, k);
    }
}

static void variation_depth(const Run *r, Variation *l, int k, int rooted)
{
    model_depth_variation(r->at.p, r->at.d, &r->jets, l, k);
    for (int c = 0; rooted && c < MODEL_NC; c++) {
        if (r->at.state[c] == CONTACT_TOUCHING && k < 2 * r->at.known[c][SLOT_NORMAL]) {
            l->depth[c][k] = PAIR_ZERO;
        }
    }
}

/* the matrix of the held contacts depends on a direction only by masses, levers and, where it has several solutions,
   capacities */
static int matrix_varies(const Run *r, const Variation *l)
{
    int varies = !MODEL_CONSTANT_INERTIA || l->moved;
    for (int i = 0; i < r->at.sticking.count; i++) {
        varies |= r->at.sticking.last[i] - r->at.sticking.first[i] > 1;
    }
    return varies;
}

void variation_series(const Run *r, Variation *l, int order, HeldVariation held, void *of)
{
    const Point *at = &r->at;
    const Jets *j = &r->jets;
    const int rooted = r->segment_rooted;
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        any |= contact_is_held(at->state, c);
    }
    if (rooted) {
        variation_extend(r, l, 1, 1);
        variation_depth(r, l, 0, 1);
    }
    for (int k = 0; k < order; k++) {
        variation_slip(r, l, k);
        if (MODEL_BOUNDED) {
            variation_depth(r, l, k + rooted, rooted);
        }
        if (!MODEL_CONSTANT_INERTIA) {
            model_inertia_variation(at->p, at->d, j, l, k);
        }
        model_acceleration_variation(at->p, at->d, j, l, k);
        if (k == 0 && any) {
            for (int c = 0; c < MODEL_NC; c++) {
                if (contact_is_held(at->state, c)) {
                    model_stick_variation(at->p, at->d, j, l, 0, c);
                }
            }
            l->bends = matrix_varies(r, l);
            if (l->bends) {
                held(of, r, l);
            }
        }
        variation_forces(r, l, k);
        if (MODEL_NZ > 0) {
            model_internal_variation(at->p, at->d, j, l, k);
        }
        if (k + time_power(rooted) <= order + rooted) {
            variation_extend(r, l, k + time_power(rooted), rooted);
        }
    }
    variation_slip(r, l, order);
    if (MODEL_BOUNDED && !rooted) {
        variation_depth(r, l, order, 0);
    }
    for (int c = 0; c < MODEL_NC; c++) {
        const int inside = at->state[c] == CONTACT_TOUCHING || at->state[c] == CONTACT_RELEASED;
        for (int k = 0; model_contact_releases[c] && inside && k <= order; k++) {
            model_release_variation(at->p, at->d, j, l, k, c);
        }
    }
}
