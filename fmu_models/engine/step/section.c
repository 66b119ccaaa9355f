/*
 * Crossings of a level by a state, located on the polynomial of the step.
 *
 *     side:      of the level on which the state was last seen; unknown where it starts at the level: that is no
 *                crossing
 *     crossing:  p = state - level falls to zero from its side, and goes beyond rounding on the other one before it
 *                returns a state that comes to rest at the level has not crossed it until it leaves to the other side
 *                where an event made the state jump across, the step that begins there begins on the other side:
 *                crossed at once
 *     otherwise  the state touches the level and goes on on its side
 */
#include "section.h"

#include "roots.h"

/* coefficients of p(at + s); those of p where at is zero */
static void shift(const double *p, int order, double at, double *shifted)
{
    memcpy(shifted, p, (size_t)(order + 1) * sizeof *p);
    for (int i = 0; at > 0.0 && i < order; i++)
        for (int k = order - 1; k >= i; k--)
            shifted[k] += at * shifted[k + 1];
}

/* the size below which p is zero but for rounding: of its own terms, and of the forces that hold a body at rest */
static double rounding(const Run *r, double s)
{
    const Jets *j = &r->jets;
    const int i = r->section.state;
    const int v = i - MODEL_NQ;
    double size = fabs(r->section.level);
    double power = 1.0;
    for (int k = 0; k <= r->segment_order; k++) {
        size += fabs(j->x[i][k]) * power;
        power *= s;
    }
    if (v >= 0 && v < MODEL_NV) {
        double rate = fabs(j->a[v][0]);
        for (int c = 0; c < MODEL_NC; c++)
            rate += fabs(j->W[v][c][0] * j->force[c][0]);
        size += rate * (r->segment_rooted ? s * s : s);
    }
    return 4.0 * DBL_EPSILON * size;
}

/* where p falls to zero from a side, seen from a zero at the place given; -1 if it does not before `to` */
static double fall_beyond(const double *p, int order, int side, double zero, double to)
{
    double beyond[POLYNOMIAL_TERMS];
    int known = 1;
    shift(p, order, zero, beyond);
    while (known <= order && beyond[known] == 0.0)
        known++;
    if (known > order) return -1.0;
    const double fall = signed_first_fall(beyond + known, order - known, side, to - zero);
    return fall < 0.0 ? -1.0 : zero + fall;
}

/* the side to which p goes from a zero; 0 if it stays there */
static int side_beyond(const Run *r, const double *p, double zero, double to)
{
    double beyond[POLYNOMIAL_TERMS];
    const double floor = rounding(r, to);
    double power = 1.0;
    shift(p, r->segment_order, zero, beyond);
    for (int k = 1; k <= r->segment_order; k++) {
        power *= to - zero;
        if (fabs(beyond[k]) * power > floor) return beyond[k] > 0.0 ? 1 : -1;
    }
    return 0;
}

/* the next place at which p goes over to the other side, from the place given, where it is zero or positive on its
   side; -1 if none */
static RARE double next_crossing(const Run *r, const double *p, double from, int at_level, double to)
{
    const int order = r->segment_order;
    const int side = r->section.side;
    double root = at_level ? from : -1.0;
    if (!at_level) {
        double ahead[POLYNOMIAL_TERMS];
        shift(p, order, from, ahead);
        const double fall = signed_first_fall(ahead, order, side, to - from);
        root = fall < 0.0 ? -1.0 : from + fall;
    }
    for (int touches = 0; root >= 0.0 && touches <= order; touches++) {
        const double back = fall_beyond(p, order, -side, root, to);
        const double seen = back < 0.0 ? to : 0.5 * (root + back);
        /* where it turns back at once rounding decides, and would do so for ever */
        if (back != root && -side * polynomial_value(p, order, seen) > rounding(r, seen)) return root;
        if (back < 0.0) return -1.0;
        root = fall_beyond(p, order, side, back, to);
    }
    return -1.0;
}

RARE double section_next(Run *r, double to)
{
    Section *q = &r->section;
    double p[POLYNOMIAL_TERMS];
    memcpy(p, r->jets.x[q->state], (size_t)(r->segment_order + 1) * sizeof *p);
    p[0] -= q->level;
    double from = q->searched;
    while (to > from) {
        const double here = polynomial_value(p, r->segment_order, from);
        const int jumped = from == 0.0 && q->side * here < 0.0 && fabs(here) > rounding(r, from);
        const int at_level = fabs(here) <= rounding(r, from) || q->side * here < 0.0;
        if (q->side == 0) q->side = at_level ? side_beyond(r, p, from, to) : here > 0.0 ? 1 : -1;
        const double root = q->side == 0 ? -1.0 : jumped ? from : next_crossing(r, p, from, at_level, to);
        if (root < 0.0) break;
        q->side = -q->side;
        from = root;
        if (q->direction == 0 || q->direction == q->side) {
            q->searched = root;
            q->jumped = jumped;
            return root;
        }
    }
    q->searched = to;
    return -1.0;
}

void section_watch(Run *r, int state, double level, int direction)
{
    const double since = r->segment_valid ? r->at.time - r->segment_start : 0.0;
    r->section = (Section){.watched = 1, .state = state, .level = level, .direction = direction};
    r->section.searched = r->segment_rooted ? sqrt(since) : since;
}
