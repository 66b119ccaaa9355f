/*
 * The flow of step/flow.c and the forces of step/contact_forces.c, differentiated, on top of the series of a step:
 *
 *     in time:               X[k+1] = RATE[k]/(k+1)
 *     in s = sqrt(time):     X[k+2] = 2 RATE[k]/(k+2), X[1] = 0
 *     in s = s0 - sqrt(end - time), s0 = sqrt(end):
 *                            X[k+1] = 2 (s0 RATE[k] - RATE[k-1])/(k+1)
 *     held contacts:         f = -S r,  F = -S R - dS r,  r: what their forces must stand up to, S: inverse of G
 *
 * A force like depth^(3/2) lets go at a depth of zero, about which it is analytic in the root of the time that is left.
 * That hardly matters to the motion, but to its derivatives, whose force goes with the root of the depth: those of a
 * step that ends so run in that root.
 *
 * Decisions are those of the step: states of contacts, orders, what counts as zero.
 */
#include "variation.h"

#include "../step/flow.h"
#include "pair_jets.h"

#include "../step/contact_forces.h"

/* order k of pile and y of array c */
static CALLED void elements_variation(const double *d, const Jets *j, Variation *l, int c, int k)
{
    const int first = model_contact_first[c], next = j->next[c];
    const double *stiffness = element_stiffness(d, c);
    const Pair *D = l->d + (element_bound(d, c) - d), *K = D - MODEL_NE;
    const double side = j->sign[c - 1];
    l->pile[c][k] = l->slip[c][k] = PAIR_ZERO;
    if (k == 0) l->moving[c] = PAIR_ZERO;
    for (int i = 0; k == 0 && i < model_contact_elements[c]; i++) {
        l->pile[c][0] += stiffness[i] * l->x[first + i][0] + K[i] * j->x[first + i][0];
        if (!element_is_held(j, c, first + i)) l->moving[c] += K[i];
    }
    if (next < 0) return;
    l->slip[c][k] = -side * l->x[next][k];
    if (k == 0)
        l->slip[c][0] += D[next - first];
    else
        l->pile[c][k] = j->moving[c] * l->x[next][k] + l->moving[c] * j->x[next][k];
}

#include "../model_variation.c"

/* order k of the variation of the product of two series, from the order `first` of b on */
static Pair variation_product(const double *a, const Pair *A, const double *b, const Pair *B, int k, int first)
{
    Pair sum = PAIR_ZERO;
    for (int i = first; i <= k; i++)
        sum += a[k - i] * B[i] + A[k - i] * b[i];
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
static double variation_rest(const Run *r, const Jets *j, int c, int k)
{
    double sum = j->slip_rate[c][k];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        for (int i = first_unknown(r, e); is_transmitted(r, e) && i <= (MODEL_CONSTANT_INERTIA ? 0 : k); i++)
            sum += j->G[c][e][i] * j->force[e][k - i];
    }
    return sum;
}

/* the same, differentiated */
static Pair variation_rest_pair(const Run *r, const Jets *j, const Variation *l, int c, int k)
{
    Pair sum = l->slip_rate[c][k];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        if (!is_transmitted(r, e)) continue;
        if (MODEL_CONSTANT_INERTIA) {
            sum += j->G[c][e][0] * l->force[e][k];
            if (l->moved) sum += l->G[c][e][0] * j->force[e][k];
        } else {
            sum += variation_product(j->force[e], l->force[e], j->G[c][e], l->G[c][e], k, first_unknown(r, e));
        }
    }
    return sum;
}

/* order k of what follows from the forces of rigid contacts */
static void variation_friction(const Run *r, const Jets *j, Variation *l, int k)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_impulsive[c] || r->at.state[c] == CONTACT_AWAY) continue;
        const double friction = model_friction(r->at.p, r->at.d, c);
        l->capacity[c][k] = friction * l->force[normal][k] + l->friction[c] * j->force[normal][k];
        if (MODEL_DIRECTED) l->capacity_minus[c][k] = l->capacity[c][k];
        if (r->at.state[c] != CONTACT_STICK) {
            const double sign = r->at.state[c] == CONTACT_SLIP_PLUS    ? -1.0
                                : r->at.state[c] == CONTACT_SLIP_MINUS ? 1.0
                                                                       : 0.0;
            l->force[c][k] = sign * l->capacity[c][k];
        }
    }
}

static void variation_forces(const Run *r, const Jets *j, Variation *l, int k)
{
    const Point *at = &r->at;
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (contact_is_held(at->state, c)) {
            model_stick_variation(at->p, at->d, j, l, k, c);
            l->force[c][k] = PAIR_ZERO;
            any = 1;
        } else if (contact_has_law(at->state, c)) {
            model_law_variation(at->p, at->d, j, l, k, c);
        } else {
            l->force[c][k] = PAIR_ZERO;
        }
    }
    if (!any) return;
    const Sticking *s = &at->sticking;
    double rest[NC];
    Pair rests[NC];
    for (int i = 0; i < s->count; i++) {
        rest[i] = l->bends ? variation_rest(r, j, s->contact[i], k) : 0.0;
        rests[i] = variation_rest_pair(r, j, l, s->contact[i], k);
    }
    for (int i = 0; i < s->count; i++) {
        Pair force = PAIR_ZERO;
        for (int e = s->first[i]; e < s->last[i]; e++) {
            force -= s->inverse[i][e] * rests[e];
            if (l->bends) force -= l->inverse[i][e] * rest[e];
        }
        l->force[s->contact[i]][k] = force;
    }
    if (MODEL_IMPACTS > 0) variation_friction(r, j, l, k);
}

/* order k of the rate of state i */
static Pair variation_rate(const Run *r, const Jets *j, const Variation *l, int i, int k)
{
    if (i < MODEL_NQ) return l->x[MODEL_NQ + i][k];
    const int v = i - MODEL_NQ, n = v - MODEL_NV;
    if (n >= MODEL_NZ - MODEL_NE) return element_is_held(j, array_of(i), i) ? PAIR_ZERO : l->slip[array_of(i) - 1][k];
    if (n >= 0) return l->zrate[n][k];
    Pair sum = l->a[v][k];
    for (int n = model_acting_first[v]; (!MODEL_BOUNDED || l->pushed) && n < model_acting_first[v + 1]; n++) {
        const int c = model_acting[n];
        if (MODEL_BOUNDED && r->at.state[c] == CONTACT_AWAY) continue;
        if (MODEL_CONSTANT_INERTIA) {
            sum += j->W[v][c][0] * l->force[c][k];
            if (l->moved) sum += l->W[v][c][0] * j->force[c][k];
        } else {
            sum += variation_product(j->W[v][c], l->W[v][c], j->force[c], l->force[c], k, 0);
        }
    }
    return sum;
}

/* order n of the states from their rates */
static void variation_extend(const Run *r, const Jets *j, Variation *l, int n)
{
    const int k = n - time_power(r->segment_rooted);
    const double ending = l->ending;
    const double f = (double)time_power(r->segment_rooted || ending > 0.0) / n;
    for (int i = 0; i < MODEL_NX; i++) {
        Pair rate = k < 0 ? PAIR_ZERO : variation_rate(r, j, l, i, k);
        if (ending > 0.0) rate = ending * rate - (k < 1 ? PAIR_ZERO : variation_rate(r, j, l, i, k - 1));
        l->x[i][n] = f * rate;
    }
}

/* order k of the rates of slip, which are left out where no contact touches */
static void variation_slip(const Run *r, const Jets *j, Variation *l, int k)
{
    if (k < 2 || !j->apart) model_slip_variation(r->at.p, r->at.d, j, l, k);
}

static void variation_depth(const Run *r, const Jets *j, Variation *l, int k, int rooted)
{
    model_depth_variation(r->at.p, r->at.d, j, l, k);
    for (int c = 0; rooted && c < MODEL_NC; c++)
        if (r->at.state[c] == CONTACT_TOUCHING && k < 2 * r->at.known[c][SLOT_NORMAL]) l->depth[c][k] = PAIR_ZERO;
}

/* whether the inverse of the matrix of the held contacts depends on a direction: by masses, levers and drag, and where
   several contacts share the load by their capacities */
static int matrix_varies(const Run *r, const Variation *l)
{
    const Sticking *s = &r->at.sticking;
    int varies = !MODEL_CONSTANT_INERTIA || l->moved;
    for (int i = 0; i < s->count; i++) {
        const int c = s->contact[i];
        const int shares = s->last[i] - s->first[i] > 1 && model_contact_partner[c] < 0;
        varies |= shares && !pair_is_zero(l->capacity[c][0]);
        varies |= MODEL_DIRECTED && shares && !pair_is_zero(l->capacity_minus[c][0]);
    }
    return varies;
}

int variation_order(const Jets *j, const Variation *l, int order)
{
    while (order > 0) {
        int finite = 1;
        for (int i = 0; i < MODEL_NX; i++)
            finite &= isfinite(j->x[i][order]) && isfinite(l->x[i][order][0]) && isfinite(l->x[i][order][1]);
        if (finite) return order;
        order--;
    }
    return order;
}

void variation_series(const Run *r, Variation *l, int order, HeldVariation held, void *of)
{
    const Point *at = &r->at;
    const Jets *j = l->ending > 0.0 ? &r->scratch : &r->jets;
    const int rooted = r->segment_rooted;
    int any = 0;
    for (int i = 0; l->ending > 0.0 && i < MODEL_NU; i++) {
        l->u[i][1] = 2.0 * l->ending * l->du[i][0];
        l->u[i][2] = -l->du[i][0];
    }
    l->pushed = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        any |= contact_is_held(at->state, c);
        l->pushed |= at->state[c] != CONTACT_AWAY;
    }
    if (rooted) {
        variation_extend(r, j, l, 1);
        variation_depth(r, j, l, 0, 1);
    }
    for (int k = 0; k < order; k++) {
        variation_slip(r, j, l, k);
        if (MODEL_BOUNDED) variation_depth(r, j, l, k + rooted, rooted);
        if (!MODEL_CONSTANT_INERTIA) model_inertia_variation(at->p, at->d, j, l, k);
        model_acceleration_variation(at->p, at->d, j, l, k);
        if (k == 0 && any) {
            for (int c = 0; c < MODEL_NC; c++)
                if (contact_is_held(at->state, c)) model_stick_variation(at->p, at->d, j, l, 0, c);
            l->bends = matrix_varies(r, l);
            if (l->bends) held(of, r, l);
        }
        variation_forces(r, j, l, k);
        if (MODEL_NZ > 0) model_internal_variation(at->p, at->d, j, l, k);
        if (k + time_power(rooted) <= order + rooted) variation_extend(r, j, l, k + time_power(rooted));
    }
    variation_slip(r, j, l, order);
    if (MODEL_BOUNDED && !rooted) variation_depth(r, j, l, order, 0);
    for (int c = 0; c < MODEL_NC; c++) {
        const int inside = at->state[c] == CONTACT_TOUCHING || at->state[c] == CONTACT_RELEASED;
        for (int k = 0; model_contact_releases[c] && inside && k <= order; k++)
            model_release_variation(at->p, at->d, j, l, k, c);
    }
    l->order = rooted ? order : variation_order(j, l, order);
}

/* order k of the rate of a state of the motion itself */
static double motion_rate(const Jets *j, int i, int k)
{
    return i < MODEL_NQ              ? j->x[MODEL_NQ + i][k]
           : i - MODEL_NQ < MODEL_NV ? contact_rate(j, i - MODEL_NQ, k)
                                     : internal_rate(j, i - MODEL_NQ - MODEL_NV, k);
}

double variation_ending(Run *r, int order, double (*rate)[MODEL_TERMS + 1])
{
    Jets *j = &r->scratch;
    const double s0 = sqrt(r->segment_length);
    flow_load(&r->at, j, 0);
    j->t[1] = 2.0 * s0;
    j->t[2] = -1.0;
    for (int i = 0; i < MODEL_NU; i++) {
        j->u[i][1] = 2.0 * s0 * r->at.du[i];
        j->u[i][2] = -r->at.du[i];
    }
    for (int k = 0; k < order; k++) {
        flow_field(&r->at, j, k, 0);
        for (int i = 0; i < MODEL_NX; i++) {
            rate[i][k] = motion_rate(j, i, k);
            j->x[i][k + 1] = 2.0 / (k + 1) * (s0 * rate[i][k] - (k > 0 ? rate[i][k - 1] : 0.0));
        }
    }
    flow_finish(&r->at, j, order);
    return s0;
}

double variation_variable(const Run *r, const Variation *l, double length)
{
    if (l->ending > 0.0) return l->ending - sqrt(fmax(r->segment_length - length, 0.0));
    return r->segment_rooted ? sqrt(length) : length;
}
