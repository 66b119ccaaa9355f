/*
 * By how much an event comes later for a neighbour: the indicator that falls at s in the variable of the series, g, and
 * its variation G make that -G(s)/g'(s).
 */
#include "event_shift.h"

#include "../step/roots.h"

/* of the times of two events at one instant: by so much of themselves their derivatives may differ by rounding */
static const double SAME_RATE = 1e-6;

/* the series of an indicator and of its derivative along one direction */
typedef struct {
    int order; /* to which they are known; -1: it does not fall */
    double value[POLYNOMIAL_TERMS];
    double derivative[POLYNOMIAL_TERMS];
} Falling;

/* the side on which stick lets go at s */
static int falling_side(const Jets *j, int c, int order, double s)
{
    const double force = polynomial_value(j->force[c], order, s);
    const double plus = MODEL_DIRECTED ? polynomial_value(stick_bound(j, c, 1), order, s) : 0.0;
    const double minus = MODEL_DIRECTED ? polynomial_value(stick_bound(j, c, -1), order, s) : 0.0;
    return nearer_side(force, plus, minus);
}

/* an indicator, up to its sign, if it falls at the end of the step */
static void falling_series(const Run *r, const Variation *l, int lane, int c, int slot, double s, Falling *f)
{
    const Jets *j = &r->jets;
    f->order = -1;
    /* the end of a chatter changes nothing but the name of its state */
    if (!r->falling[c][slot] || (r->at.state[c] == CONTACT_CHATTERING && slot == SLOT_NORMAL)) {
        return;
    }
    const int closed = model_contact_is_impact[c] && r->at.state[c] != CONTACT_AWAY;
    const int margin = slot == SLOT_TANGENTIAL && r->at.state[c] == CONTACT_STICK;
    const int released = slot == SLOT_TANGENTIAL && model_contact_is_stop[c];
    const int normal = slot == SLOT_NORMAL;
    const double *value = closed ? j->force[c] : normal ? j->depth[c] : released ? j->release[c] : j->slip[c];
    const Pair *pairs = closed ? l->force[c] : normal ? l->depth[c] : released ? l->release[c] : l->slip[c];
    f->order = l->order - (margin || closed);
    const int side = margin ? falling_side(j, c, l->order - 1, s) : 1;
    const double *bound = stick_bound(j, c, side);
    const Pair *moved = MODEL_DIRECTED && side < 0 ? l->capacity_minus[c] : l->capacity[c];
    for (int k = 0; k <= f->order; k++) {
        f->value[k] = margin ? bound[k] - side * j->force[c][k] : value[k];
        f->derivative[k] = margin ? moved[k][lane] - side * l->force[c][k][lane] : pairs[k][lane];
    }
}

/* whether a series falls to zero at s with a speed: not within rounding of a double root */
static int falls_with_speed(const Run *r, const Falling *f, double s, double slope)
{
    double size = 0.0;
    for (int k = f->order; k > 0; k--) {
        size = size * s + fabs(f->value[k]);
    }
    return fabs(slope) > r->tolerances.graze * size;
}

int event_shift(const Run *r, const Variation *l, int lane, double s, double at, Shift *shift)
{
    Falling f;
    *shift = (Shift){.untimed = 1};
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            falling_series(r, l, lane, c, slot, s, &f);
            if (f.order < 0) {
                continue;
            }
            double slope = 0.0;
            for (int k = f.order; k > 0; k--) {
                slope = slope * s + k * f.value[k];
            }
            const int has_speed = falls_with_speed(r, &f, s, slope);
            const double later = -polynomial_value(f.derivative, f.order, at) / slope;
            if (shift->untimed && !has_speed) {
                return 0;
            }
            if (shift->untimed) {
                shift->untimed = 0;
                shift->later = later;
            } else if (!has_speed || !(fabs(later - shift->later) <= SAME_RATE * (fabs(later) + fabs(shift->later)))) {
                shift->corner = 1;
            }
        }
    }
    return 1;
}
