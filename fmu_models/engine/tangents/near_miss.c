/*
 * Where a pending indicator comes nearest to zero without an event: the minima of its series on a step.
 *
 *     its slope at MISS_SAMPLES + 1 places: from below zero to above  -> bracket, halved to rounding
 *     there the indicator's slope vanishes, so that its derivative at a fixed time is that of the minimum
 */
#include "near_miss.h"

#include "../step/event_location.h"
#include "indicator_series.h"
#include "tangent_series.h"

enum { MISS_SAMPLES = 8, MISS_BISECTIONS = 200 };

static double bracketed_minimum(const IndicatorSeries *f, double sign, double low, double high)
{
    for (int i = 0; i < MISS_BISECTIONS; i++) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) {
            break;
        }
        *(sign * indicator_slope(f->value, f->order, middle) < 0.0 ? &low : &high) = middle;
    }
    return high;
}

/* a minimum at s in the variable of the series */
static void keep_miss(const Run *r, Tangents *tangents, int c, int slot, int side, double sign, double s,
                      NearMiss *miss, NearMisses *misses)
{
    const double length = r->segment_rooted ? s * s : s;
    const int64_t row = misses->count++;
    if (row >= misses->capacity) {
        return;
    }
    IndicatorSeries f;
    miss->time = r->segment_start + length;
    for (int k = 0; k < tangents->count; k++) {
        const Variation *l = variation_of(tangents, k);
        indicator_series(r, l, k % PAIR, c, slot, side, &f);
        const double at = variation_variable(r, l, length);
        misses->derivatives[row * tangents->count + k] = sign * polynomial_value(f.derivative, f.order, at);
        miss->value = sign * polynomial_value(f.value, f.order, s);
    }
    misses->list[row] = *miss;
}

static void search_misses(const Run *r, Tangents *tangents, int c, int slot, int side, double end, NearMisses *misses)
{
    IndicatorSeries f;
    const double sign = side != 0 ? 1.0 : (double)location_indicator(r, c, (Slot)slot);
    NearMiss miss = {.contact = c, .slot = slot, .side = side, .state = r->at.state[c]};
    indicator_series(r, variation_of(tangents, 0), 0, c, slot, side, &f);
    double low = 0.0;
    /* what has just fallen, or begun at zero, has a slope there that is rounding */
    double slope = r->at.known[c][slot] ? 0.0 : sign * indicator_slope(f.value, f.order, 0.0);
    for (int i = 1; i <= MISS_SAMPLES; i++) {
        const double high = end * i / MISS_SAMPLES;
        const double next = sign * indicator_slope(f.value, f.order, high);
        if (slope < 0.0 && next >= 0.0) {
            keep_miss(r, tangents, c, slot, side, sign, bracketed_minimum(&f, sign, low, high), &miss, misses);
        }
        low = high;
        slope = next;
    }
}

void near_misses_note(const Run *r, Tangents *tangents, double until, NearMisses *misses)
{
    const double length = fmin(until - r->segment_start, r->segment_length);
    const double end = r->segment_rooted ? sqrt(length) : length;
    if (!(length > 0.0)) {
        return;
    }
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            if (location_indicator(r, c, (Slot)slot) == 0 || r->at.state[c] == CONTACT_CHATTERING) {
                continue;
            }
            if (indicator_is_margin(r, c, slot)) {
                search_misses(r, tangents, c, slot, 1, end, misses);
                search_misses(r, tangents, c, slot, -1, end, misses);
            } else {
                search_misses(r, tangents, c, slot, 0, end, misses);
            }
        }
    }
}

#include "../model/scalar_real.h"
