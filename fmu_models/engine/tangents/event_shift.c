/*
 * By how much an event comes later for a neighbour: the indicator that falls at s in the variable of the series, g, and
 * its variation G make that -G(s)/g'(s).
 */
#include "event_shift.h"

#include "indicator_series.h"

/* of the times of two events at one instant: by so much of themselves their derivatives may differ by rounding */
static const double SAME_RATE = 1e-6;

/* the side on which stick lets go at s */
static int falling_side(const Jets *j, int c, int order, double s)
{
    const double force = polynomial_value(j->force[c], order, s);
    const double plus = MODEL_DIRECTED ? polynomial_value(stick_bound(j, c, 1), order, s) : 0.0;
    const double minus = MODEL_DIRECTED ? polynomial_value(stick_bound(j, c, -1), order, s) : 0.0;
    return nearer_side(force, plus, minus);
}

/* an indicator, up to its sign, if it falls at the end of the step; 0 if it does not */
static int falling_series(const Run *r, const Variation *l, int c, int slot, double s, IndicatorSeries *f)
{
    /* the end of a chatter changes nothing but the name of its state */
    if (!r->falling[c][slot] || (r->at.state[c] == CONTACT_CHATTERING && slot == SLOT_NORMAL)) return 0;
    const int side = indicator_is_margin(r, c, slot) ? falling_side(&r->jets, c, l->order - 1, s) : 1;
    indicator_series(r, l, c, slot, side, f);
    return 1;
}

/* whether a series falls to zero at s with a speed: not within rounding of a double root */
static int falls_with_speed(const Run *r, const IndicatorSeries *f, double s, double slope)
{
    double sizes[POLYNOMIAL_TERMS] = {0.0};
    for (int k = 1; k <= f->order; k++)
        sizes[k - 1] = fabs(f->value[k]);
    const double size = polynomial_value(sizes, f->order > 0 ? f->order - 1 : 0, s);
    return fabs(slope) > r->tolerances.graze * size;
}

/* how fast the indicator falls, in time, and how that changes for a neighbour, whose event is later */
static void note_speed(const Run *r, const IndicatorSeries *f, double s, double slope, double at, Shift *shift)
{
    const Pair along = pair_slope(f->derivative, f->order, at);
    const Pair change = along + indicator_bend(f->value, f->order, s) * shift->later;
    const double sign = slope < 0.0 ? -1.0 : 1.0;
    const double rate = r->segment_rooted ? 2.0 * s : 1.0; /* of time by s */
    const Pair rate_change = r->segment_rooted ? 2.0 * shift->later : PAIR_ZERO;
    shift->speed = sign * slope / rate;
    shift->speed_change = sign * (change - slope / rate * rate_change) / rate;
}

int event_shift(const Run *r, const Variation *l, double s, double at, Shift *shift)
{
    IndicatorSeries f;
    *shift = (Shift){.untimed = 1};
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            if (r->falling[c][slot] && contact_is_settling(r, c)) {
                shift->untimed = 0; /* as much later as the reset before it */
                continue;
            }
            if (!falling_series(r, l, c, slot, s, &f)) continue;
            const double slope = polynomial_slope(f.value, f.order, s);
            const int has_speed = falls_with_speed(r, &f, s, slope);
            const Pair later = -pair_value(f.derivative, f.order, at) / slope;
            if (shift->untimed && !has_speed) return 0;
            if (shift->untimed) {
                shift->untimed = 0;
                shift->later = later;
                note_speed(r, &f, s, slope, at, shift);
                continue;
            }
            for (int n = 0; n < PAIR; n++) {
                const double size = fabs(later[n]) + fabs(shift->later[n]);
                shift->corner[n] |= !has_speed || !(fabs(later[n] - shift->later[n]) <= SAME_RATE * size);
            }
        }
    }
    return 1;
}
