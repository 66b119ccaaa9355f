/*
 * The reach of a step. A Taylor series says nothing of what is flat where it is expanded: the tail of a Gauss curve, of
 * tanh, a high power. Here the rates and the functions that decide events are bounded over discs |t| <= H of complex time:
 *
 *     states:      polynomials P, so that |P - P(0)| <= sum |P_k| H^k
 *     functions g: radius B(H) of the image of g(P(t)), operation by operation (model/discs.h, generated)
 *     Cauchy:      g(P(t)) has no term of order p or higher above B (h/H)^p at a length h
 *     therefore    B (h/H)^p <= REACH tolerance S,  S: the size of what g adds to,  for some H, for every g
 *
 * P is known, and so is its image: no bound of the motion itself is needed. Where all rates of P are those of P to
 * within d, the motion differs from P by no more than h d times its own growth over a step.
 *
 *     H = h (REACH tolerance w)^(-1/p), w of the ladder below: then the condition is B w <= S
 *     of derivatives:  neighbours P + V, V the series of a derivative scaled to a part of the size of the motion, for
 *                      which S is the size of V: a function of P and V is bounded with what it makes of V (Cauchy, once
 *                      more)
 *     where it is not met by a factor s, these H prove h s^(-1/p); a shorter h, with its smaller discs, may prove more
 *
 * Source: Cauchy's estimate; Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009), chapter 9 (automatic
 * bounds of the terms of Taylor series).
 */
#include "reach.h"

#include "contact_forces.h"

#if MODEL_REACH

#include "../model/discs.h"
#include "../model_discs.c"

/* in parts of the step's tolerance: bounds by discs are some powers of ten above what they bound */
static const double REACH = 1e4;

/* w, and log2 of its first and of the parts from one to the next: small discs for poles that are near, large ones for what
   grows everywhere */
static const double WEIGHT[DISCS] = {0x1p12, 0x1p6, 1.0, 0x1p-6};
static const double LADDER = 12.0, RUNG = -6.0;

/* the length tried next, of the one before: discs that small may be free of the poles of larger ones */
static const double SHORTER = 0.3;

/* what moves by less than this, of whatever unit, does not move; the largest disc in parts of it is a number */
static const double NOTHING = 1e-140;

typedef struct {
    Run *r;
    const Jets *j;            /* of the step */
    const StateSeries *along; /* a difference between neighbours, or NULL */
    Jets *b;                  /* radii */
    int order;
    double h;           /* the length tried, in the variable of the series */
    double gain[DISCS]; /* H/h */
    double shortage;    /* the largest B w/S so far */
} Reach;

/* sum of |x_k| h^k up to an order */
static double size_over(const double *x, int order, double h)
{
    double size = 0.0;
    for (int k = order; k > 0; k--)
        size = (size + fabs(x[k])) * h;
    return size + fabs(x[0]);
}

/* a sum whose first terms mostly tell */
enum { FIRST = 6 };

static double first_size(const double *x, int order, double h)
{
    return size_over(x, order < FIRST ? order : FIRST, h);
}

/* sum of |x_k| H^k without k = 0, for all H; four terms at a time, which do not wait for each other */
static void radii_of(const double *x, int order, const double *H, double *radius)
{
    double sum[DISCS] = {0.0};
    int k = order;
    for (; k % 4 != 0; k--)
        for (int m = 0; m < DISCS; m++)
            sum[m] = (sum[m] + fabs(x[k])) * H[m];
    for (; k > 0; k -= 4) {
        const double one = fabs(x[k - 3]), two = fabs(x[k - 2]), three = fabs(x[k - 1]), four = fabs(x[k]);
        for (int m = 0; m < DISCS; m++) {
            const double square = H[m] * H[m];
            sum[m] = (sum[m] + four) * (square * square) + (one + two * H[m] + three * square) * H[m];
        }
    }
    for (int m = 0; m < DISCS; m++)
        radius[m] = disc_bounded(sum[m]);
}

/* beyond this a bound may be made of the largest, which is none */
static const double BOUND = 1e100;

/* a motion this far out goes to infinity; discs of whole steps around it still have a bound */
static const double BEYOND = 1e85;

/* the smallest B w of a bound; infinite, if there is none */
static double least_tail(const double *bound)
{
    double least = bound[0] * WEIGHT[0];
    for (int m = 1; m < DISCS; m++) {
        const double tail = bound[m] * WEIGHT[m];
        least = tail < least ? tail : least;
    }
    return least < BOUND ? least : INFINITY;
}

static void require(Reach *a, double tail, double size) { a->shortage = fmax(a->shortage, tail / fmax(size, NOTHING)); }

/* a function with a size of its own; higher: orders that it is known beyond the rates */
static void require_series(Reach *a, const double *bound, const double *x, int order, int higher)
{
    const double tail = least_tail(bound) / (higher ? a->gain[0] : 1.0);
    if (tail > first_size(x, order, a->h)) require(a, tail, size_over(x, order, a->h));
}

/* the rate of state i, from what adds up to it at the start */
static void require_rate(Reach *a, const double *bound, int i, double parts)
{
    const double *x = a->along ? a->along[i] : a->j->x[i];
    const int power = time_power(a->r->segment_rooted);
    const double tail = least_tail(bound) / (a->order + power);
    if (a->along)
        parts = 0.0; /* of the motion */
    else if (tail <= parts)
        return;
    const double time = power == 2 ? 0.5 * a->h * a->h : a->h;
    if (tail > first_size(x, a->order, a->h) / time) require(a, tail, fmax(size_over(x, a->order, a->h) / time, parts));
}

/* of the force of each contact: radii that its law gives; of held ones what they stand up to */
static void law_discs(Reach *a)
{
    const Run *r = a->r;
    for (int c = 0; c < MODEL_NC; c++) {
        disc_zero(a->b->force[c]);
        if (contact_is_held(r->at.state, c))
            model_stick_disc(r->at.p, r->at.d, a->j, a->b, c);
        else if (contact_has_law(r->at.state, c) && !cone_is_side(c))
            model_law_disc(r->at.p, r->at.d, a->j, a->b, c);
    }
    double H[DISCS], turned[DISCS];
    for (int m = 0; m < DISCS; m++)
        H[m] = a->h * a->gain[m];
    for (int s = 0; s < MODEL_NC; s++) {
        if (!cone_is_side(s) || !contact_has_law(r->at.state, s)) continue;
        const double *unit = a->j->unit[s], *force = a->b->force[s + 1 - model_contact_cone[s]];
        radii_of(unit, a->order - 1, H, turned);
        for (int m = 0; m < DISCS; m++)
            a->b->force[s][m] = disc_bounded(force[m] * disc_bounded(fabs(unit[0]) + turned[m]));
    }
}

/* what row c of the held contacts must stand up to; G itself moves where inertia does */
static void transmitted_discs(const Reach *a, int c, double *rest)
{
    const Jets *j = a->j;
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        if (contact_has_law(a->r->at.state, e)) disc_add(rest, fabs(j->G[c][e][0]), a->b->force[e]);
        for (int m = 0; !MODEL_CONSTANT_INERTIA && m < DISCS; m++) {
            const double entry = (&a->b->G[c][e][0])[m];
            rest[m] = disc_bounded(rest[m] + entry * disc_bounded(fabs(j->force[e][0]) + a->b->force[e][m]));
        }
    }
}

/* |inverse| |dG| x of the held contacts, disc m; a friction that slips on a rigid contact goes with its force */
static void held_changes(const Reach *a, const double *x, int m, double *change)
{
    const Sticking *s = &a->r->at.sticking;
    double moved[NC];
    for (int i = 0; i < s->count; i++) {
        moved[i] = 0.0;
        for (int e = s->first[i]; !MODEL_CONSTANT_INERTIA && e < s->last[i]; e++) {
            const int partner = model_contact_partner[s->contact[e]];
            const double dragged = s->drag[e] != 0.0 ? (&a->b->G[s->contact[i]][partner][0])[m] * fabs(s->drag[e])
                                                     : 0.0;
            moved[i] += disc_bounded(((&a->b->G[s->contact[i]][s->contact[e]][0])[m] + dragged) * x[e]);
        }
    }
    for (int i = 0; i < s->count; i++) {
        change[i] = 0.0;
        for (int e = s->first[i]; e < s->last[i]; e++)
            change[i] = disc_bounded(change[i] + fabs(s->inverse[i][e]) * disc_bounded(moved[e]));
    }
}

/* the forces of held contacts, and of the friction of rigid ones */
static void held_discs(Reach *a)
{
    const Run *r = a->r;
    const Sticking *s = &r->at.sticking;
    double rest[NC][DISCS];
    int count = 0;
    for (int c = 0; c < MODEL_NC; c++)
        count += contact_is_held(r->at.state, c);
    if (count == 0) return;
    for (int i = 0; i < s->count; i++) {
        disc_multiple(rest[i], 1.0, a->b->slip_rate[s->contact[i]]);
        transmitted_discs(a, s->contact[i], rest[i]);
    }
    for (int m = 0; m < DISCS; m++) {
        double base[NC], change[NC], radius[NC];
        for (int i = 0; i < s->count; i++) {
            base[i] = 0.0;
            for (int e = s->first[i]; e < s->last[i]; e++)
                base[i] = disc_bounded(base[i] + fabs(s->inverse[i][e]) * rest[e][m]);
        }
        double ratio = 1.0;
        for (int trial = 1; ratio > 0.75 && trial <= DISC_TRIALS; trial++) {
            held_changes(a, base, m, change);
            ratio = disc_ratio(base, change, s->count, trial < DISC_TRIALS);
        }
        disc_solution(base, ratio, s->count, radius, 1);
        for (int i = 0; i < s->count; i++)
            a->b->force[s->contact[i]][m] = radius[i];
    }
    for (int c = 0; MODEL_IMPACTS > 0 && c < MODEL_NC; c++) {
        const int normal = model_contact_partner[c];
        if (normal < 0 || model_contact_impulsive[c] || r->at.state[c] == CONTACT_AWAY) continue;
        disc_multiple(a->b->capacity[c], fabs(model_friction(r->at.p, r->at.d, c)), a->b->force[normal]);
        memcpy(a->b->capacity_minus[MODEL_DIRECTED ? c : 0], a->b->capacity[c],
               sizeof(double) * DISCS * MODEL_DIRECTED);
        if (r->at.state[c] != CONTACT_STICK)
            disc_multiple(a->b->force[c], fabs(contact_drag(&r->at, r->at.state, normal)), a->b->force[normal]);
    }
}

static void require_rates(Reach *a)
{
    const Jets *j = a->j;
    for (int i = 0; i < MODEL_NV; i++) {
        double parts = fabs(j->a[i][0]);
        double *bound = a->b->a[i];
        for (int n = model_acting_first[i]; n < model_acting_first[i + 1]; n++) {
            const int c = model_acting[n];
            const double lever = fabs(j->W[i][c][0]);
            parts += lever * fabs(j->force[c][0]);
            disc_add(bound, lever, a->b->force[c]);
            for (int m = 0; !MODEL_CONSTANT_INERTIA && m < DISCS; m++) {
                const double force = disc_bounded(fabs(j->force[c][0]) + a->b->force[c][m]);
                bound[m] = disc_bounded(bound[m] + (&a->b->W[i][c][0])[m] * force);
            }
        }
        require_rate(a, bound, MODEL_NQ + i, parts);
    }
    for (int i = 0; i < MODEL_NZ - MODEL_NE; i++)
        require_rate(a, a->b->zrate[i], MODEL_NQ + MODEL_NV + i, fabs(j->zrate[i][0]));
}

static void require_held(Reach *a, int c)
{
    const Jets *j = a->j;
    double bound[DISCS];
    const double *force = j->force[c];
    if (contact_is_closed(a->r, c)) {
        require_series(a, a->b->force[c], force, a->order - 1, 0);
        return;
    }
    disc_multiple(bound, 1.0, a->b->force[c]);
    disc_add(bound, 1.0, a->b->capacity[c]);
    if (MODEL_DIRECTED) disc_add(bound, 1.0, a->b->capacity_minus[c]);
    const double size = size_over(j->capacity[c], a->order - 1, a->h);
    require(a, least_tail(bound), size + size_over(force, a->order - 1, a->h));
}

static void require_contacts(Reach *a)
{
    const Run *r = a->r;
    const Jets *j = a->j;
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_slip_unseen[c] && slip_decides(r, &r->jets, c))
            require_series(a, a->b->slip[c], j->slip[c], a->order, 1);
        if (model_depth_unseen[c] && model_contact_bounded[c] && !contact_is_closed(r, c))
            require_series(a, a->b->depth[c], j->depth[c], a->order, 1);
        if (contact_is_held(r->at.state, c)) require_held(a, c);
        if (model_release_unseen[c] && contact_may_release(r->at.state, c)) {
            model_release_disc(r->at.p, r->at.d, j, a->b, c);
            require_series(a, a->b->release[c], j->release[c], a->order, 1);
        }
    }
}

/* whether there is anything unseen in this state of the contacts */
static int has_unseen(const Run *r)
{
    int any = MODEL_RATES_UNSEEN;
    for (int c = 0; c < MODEL_NC; c++) {
        any |= model_slip_unseen[c] && slip_decides(r, &r->jets, c);
        any |= model_depth_unseen[c] && model_contact_bounded[c] && !contact_is_closed(r, c);
        any |= model_law_unseen[c] && contact_has_law(r->at.state, c);
        any |= model_stick_unseen[c] && contact_is_held(r->at.state, c);
        any |= model_release_unseen[c] && contact_may_release(r->at.state, c);
    }
    return any;
}

static int is_far(const Run *r)
{
    int far = 0;
    for (int i = 0; i < MODEL_NX; i++)
        far |= model_disc_states[i] && !(fabs(r->at.x[i]) < BEYOND);
    return far;
}

/* by how much an input and its rate change by what it has beyond its rate, within times of these sizes */
static void add_curves(const double *bend, const double *t, double *u, double *du)
{
    for (int m = 0; m < DISCS; m++) {
        double term = 1.0; /* t^(n-1)/(n-1)! */
        for (int n = 2; n <= MODEL_INPUT_DEGREE; n++) {
            term *= t[m] / (n - 1);
            du[m] += fabs(bend[n - 2]) * term;
            u[m] += fabs(bend[n - 2]) * term * t[m] / n;
        }
    }
}

/* of the forces of arrays: their free elements move alike */
static void pile_discs(Reach *a, const double *H)
{
    const Jets *j = a->j;
    for (int c = 0; c < MODEL_NC; c++) {
        const int next = contact_is_array(c) ? j->next[c] : -1;
        double *radius = a->b->pile[c], along[DISCS] = {0.0};
        disc_zero(radius);
        if (next >= 0) radii_of(j->x[next], a->order, H, radius);
        if (next >= 0 && a->along) radii_of(a->along[next], a->order, H, along);
        for (int m = 0; m < DISCS; m++)
            radius[m] = fabs(j->moving[c]) * (radius[m] + along[m]);
        for (int i = 0; a->along && i < model_contact_elements[c]; i++) {
            const double apart = element_stiffness(a->r->at.d, c)[i] * a->along[model_contact_first[c] + i][0];
            for (int m = 0; m < DISCS; m++)
                radius[m] += fabs(apart);
        }
    }
}

/* how far a length is beyond what the discs allow: 1 if not, else the power p of that */
static double shortage_of(Reach *a, double h)
{
    Run *r = a->r;
    const Jets *j = a->j;
    double H[DISCS];
    a->h = h;
    a->shortage = 1.0;
    for (int m = 0; m < DISCS; m++) {
        H[m] = h * a->gain[m];
        a->b->t[m] = r->segment_rooted ? H[m] * H[m] : H[m];
    }
    for (int i = 0; i < MODEL_NU; i++) {
        disc_zero(a->b->du[i]);
        disc_multiple(a->b->u[i], fabs(r->at.du[i]), a->b->t);
        if (r->at.curved) add_curves(r->at.bend[i], a->b->t, a->b->u[i], a->b->du[i]);
    }
    for (int i = 0; i < MODEL_NX; i++) {
        if (model_disc_states[i]) radii_of(j->x[i], a->order, H, a->b->x[i]);
        if (model_disc_states[i] && a->along) {
            double radius[DISCS];
            radii_of(a->along[i], a->order, H, radius);
            disc_add(a->b->x[i], 1.0, radius);
            for (int m = 0; m < DISCS; m++)
                a->b->x[i][m] += fabs(a->along[i][0]);
        }
    }
    if (MODEL_NE > 0) pile_discs(a, H);
    model_slip_disc(r->at.p, r->at.d, j, a->b);
    for (int c = 0; c < MODEL_NC; c++)
        if (cone_is_whole(c)) radii_of(j->slip[c], a->order, H, a->b->slip[c]);
    model_depth_disc(r->at.p, r->at.d, j, a->b);
#if !MODEL_CONSTANT_INERTIA
    model_inertia_disc(r->at.p, r->at.d, j, a->b);
#endif
    model_acceleration_disc(r->at.p, r->at.d, j, a->b);
    law_discs(a);
    held_discs(a);
    model_internal_disc(r->at.p, r->at.d, j, a->b);
    require_rates(a);
    if (!a->along) require_contacts(a);
    /* series of an instant take the orders above the rate for zero */
    disc_zero(a->b->t);
    for (int i = 0; i < MODEL_NU; i++) {
        disc_zero(a->b->u[i]);
        disc_zero(a->b->du[i]);
    }
    return a->shortage;
}

static double proven_length(Run *r, const StateSeries *along, int order, double h, double least)
{
    if (!has_unseen(r) || !(h > 0.0)) return h;
    if (is_far(r)) return 0.0;
    const double log_error = rough_log2(REACH * r->tolerances.step);
    Reach a = {.r = r, .j = &r->jets, .along = along, .b = &r->scratch, .order = order};
    const double rung = rough_exp2(-RUNG / order);
    a.gain[0] = rough_exp2(-(log_error + LADDER) / order);
    for (int m = 1; m < DISCS; m++)
        a.gain[m] = a.gain[m - 1] * rung;
    double proven = least;
    for (double shorter = h; shorter > proven; shorter *= SHORTER) {
        const double shortage = shortage_of(&a, shorter);
        if (shortage <= 1.0) return shorter;
        if (isfinite(shortage)) proven = fmax(proven, shorter * rough_exp2(-rough_log2(shortage) / order));
    }
    return proven > least ? proven : 0.0;
}

double reach_of_step(Run *r, const Neighbour *neighbour, int order, double h, double least)
{
    if (neighbour == NULL || neighbour->weightless == NULL)
        return proven_length(r, neighbour ? neighbour->along : NULL, order, h, least);
    double p[MODEL_ROOM(MODEL_NP)], d[MODEL_ROOM(MODEL_ND)];
    memcpy(p, r->at.p, sizeof p);
    memcpy(d, r->at.d, sizeof d);
    for (int i = 0; i < MODEL_NP; i++)
        r->at.p[i] += neighbour->weightless[i];
    model_prepare(r->at.p, r->at.d);
    const double length = proven_length(r, neighbour->along, order, h, least);
    memcpy(r->at.p, p, sizeof p);
    memcpy(r->at.d, d, sizeof d);
    return length;
}

#else

double reach_of_step(Run *r, const Neighbour *neighbour, int order, double h, double least)
{
    (void)r, (void)neighbour, (void)order, (void)least;
    return h;
}

#endif
