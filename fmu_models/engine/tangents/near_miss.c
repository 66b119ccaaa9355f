/*
 * Where a pending indicator comes nearest to zero without an event: the minima of its series on a step.
 *
 *     its slope at MISS_SAMPLES + 1 places: from below zero to above  -> bracket, halved to rounding
 *     between them where the slope is extreme, too
 *     there the indicator's slope vanishes, so that its derivative at a fixed time is that of the minimum
 *     an event of another contact may turn it too: then the time of that event moves the minimum along
 *     after an impact without rebound the force that holds the contact, or the acceleration at which it leaves its wall
 *     after a slip that has begun at an event the acceleration, in stick the margins: none where one becomes the other
 */
#include "near_miss.h"

#include "../step/event_location.h"
#include "indicator_series.h"
#include "linear_variation.h"
#include "tangent_series.h"

enum { MISS_SAMPLES = 8, MISS_BISECTIONS = 200 };

static double bracketed_minimum(const IndicatorSeries *f, double sign, double low, double high)
{
    for (int i = 0; i < MISS_BISECTIONS; i++) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        *(sign * polynomial_slope(f->value, f->order, middle) < 0.0 ? &low : &high) = middle;
    }
    return high;
}

/* where the slope is extreme between two places, if it rises at one of them and falls at the other; else the second */
static double extreme_slope(const IndicatorSeries *f, double low, double high)
{
    const double end = high, bend = indicator_bend(f->value, f->order, low);
    if (!(bend * indicator_bend(f->value, f->order, high) < 0.0)) return end;
    for (int i = 0; i < MISS_BISECTIONS; i++) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high) break;
        *(bend * indicator_bend(f->value, f->order, middle) > 0.0 ? &low : &high) = middle;
    }
    return high;
}

/* a minimum at s in the variable of the series */
static void keep_miss(const Run *r, Tangents *tangents, int c, int slot, int side, double sign, double s,
                      NearMiss *miss, NearMisses *misses)
{
    const double length = r->segment_rooted ? s * s : s;
    const int64_t row = misses->count++;
    if (row >= misses->capacity) return;
    IndicatorSeries f;
    miss->time = r->segment_start + length;
    for (int k = 0; k < tangents->count; k++) {
        const Variation *l = variation_of(tangents, k);
        indicator_series(r, l, c, slot, side, &f);
        const double at = variation_variable(r, l, length);
        misses->derivatives[row * tangents->count + k] = sign * pair_value(f.derivative, f.order, at)[k % PAIR];
        miss->value = sign * polynomial_value(f.value, f.order, s);
    }
    misses->list[row] = *miss;
}

static void search_misses(const Run *r, Tangents *tangents, int c, int slot, int side, double end, NearMisses *misses)
{
    IndicatorSeries f;
    const double sign = side != 0 ? 1.0 : (double)location_indicator(r, c, (Slot)slot);
    NearMiss miss = {.contact = c, .slot = slot, .side = side, .state = r->at.state[c]};
    indicator_series(r, variation_of(tangents, 0), c, slot, side, &f);
    double low = 0.0;
    /* coefficients of what has just fallen, or begun at zero, are rounding where they are known to be zero */
    const int zeros = r->at.known[c][slot] * (r->segment_rooted ? 2 : 1);
    for (int k = 0; k < zeros && k <= f.order; k++)
        f.value[k] = 0.0;
    double slope = zeros ? 0.0 : sign * polynomial_slope(f.value, f.order, 0.0);
    for (int i = 1; i <= MISS_SAMPLES; i++) {
        const double sample = end * i / MISS_SAMPLES;
        while (low < sample) {
            const double high = extreme_slope(&f, low, sample);
            const double next = sign * polynomial_slope(f.value, f.order, high);
            if (slope < 0.0 && next >= 0.0)
                keep_miss(r, tangents, c, slot, side, sign, bracketed_minimum(&f, sign, low, high), &miss, misses);
            low = high;
            slope = next;
        }
    }
}

/* slope in time of an indicator at s in the variable of the series, up to its sign */
static double slope_in_time(const Run *r, const IndicatorSeries *f, double s)
{
    return polynomial_slope(f->value, f->order, s) / (r->segment_rooted ? 2.0 * s : 1.0);
}

/* what falls where the step ends in an event of others */
static void keep_falling(const Run *r, Tangents *tangents, int c, int slot, int side, double end, NearMisses *misses)
{
    IndicatorSeries f;
    const double sign = side != 0 ? 1.0 : (double)location_indicator(r, c, (Slot)slot);
    const int64_t row = misses->count + misses->pending;
    indicator_series(r, variation_of(tangents, 0), c, slot, side, &f);
    const double slope = sign * slope_in_time(r, &f, end);
    if (r->falling[c][slot] || !(slope < 0.0) || row >= misses->capacity) return;
    misses->list[row] = (NearMiss){.time = r->segment_start + r->segment_length,
                                   .value = sign * polynomial_value(f.value, f.order, end),
                                   .slope = slope,
                                   .contact = c,
                                   .slot = slot,
                                   .side = side,
                                   .state = r->at.state[c]};
    for (int k = 0; k < tangents->count; k++) {
        const Variation *l = variation_of(tangents, k);
        indicator_series(r, l, c, slot, side, &f);
        const double at = variation_variable(r, l, r->segment_length);
        misses->derivatives[row * tangents->count + k] = sign * pair_value(f.derivative, f.order, at)[k % PAIR]
                                                         - slope * l->t[0][k % PAIR];
    }
    misses->pending++;
}

/* whether what fell before the event does not after it, or not from where it was: a force has jumped */
static int turned(const Run *r, Tangents *tangents, const NearMiss *miss)
{
    IndicatorSeries f;
    if (r->segment_rooted) return 0;
    if (r->at.state[miss->contact] != miss->state) return miss->state == CONTACT_STICK;
    const double sign = miss->side != 0 ? 1.0 : (double)location_indicator(r, miss->contact, (Slot)miss->slot);
    indicator_series(r, variation_of(tangents, 0), miss->contact, miss->slot, miss->side, &f);
    const double rise = sign * f.value[0] - miss->value;
    return sign * slope_in_time(r, &f, 0.0) > 1e-9 * miss->slope
           || rise > 1e-6 * (fabs(f.value[0]) + fabs(miss->value));
}

/* what the event has turned; the rest is forgotten */
static void settle_pending(const Run *r, Tangents *tangents, NearMisses *misses)
{
    const int n = tangents->count;
    const int64_t first = misses->count;
    for (int64_t from = first; from < first + misses->pending; from++) {
        const NearMiss miss = misses->list[from];
        if (!turned(r, tangents, &miss) || isnan(tangents_event(tangents, 0))) continue;
        const int64_t row = misses->count++;
        misses->list[row] = miss;
        for (int k = 0; k < n; k++) {
            misses->derivatives[row * n + k] = misses->derivatives[from * n + k]
                                               + miss.slope * tangents_event(tangents, k);
        }
    }
    misses->pending = 0;
}

/* the coefficient of an indicator after an event, so many times */
static void keep_beginning(const Run *r, Tangents *tangents, int c, Slot slot, int side, int order, double times,
                           NearMisses *misses)
{
    const int n = tangents->count;
    const int64_t row = misses->count++;
    if (row >= misses->capacity) return;
    misses->list[row] = (NearMiss){
        .time = r->segment_start, .contact = c, .slot = slot, .side = side, .state = r->at.state[c], .begins = 1};
    for (int k = 0; k < n; k++) {
        IndicatorSeries f;
        indicator_series(r, variation_of(tangents, k), c, slot, side, &f);
        misses->derivatives[row * n + k] = times * f.derivative[order][k % PAIR];
        misses->list[row].value = times * f.value[order];
    }
}

/*
 * What an impact without rebound leaves behind is decided by the force with which the contact would be held: it stays
 * while that pushes, and leaves its wall otherwise, at an acceleration that is none where the force is none. So does
 * what sticks after an event slip beyond, where its margin is none, at an acceleration that is none.
 */
static void note_beginnings(const Run *r, Tangents *tangents, NearMisses *misses)
{
    for (int c = 0; c < MODEL_NC; c++) {
        const int state = r->at.state[c];
        const int slips = state == CONTACT_SLIP_MINUS || state == CONTACT_SLIP_PLUS;
        if (model_contact_impulsive[c]) {
            const int leaves = state == CONTACT_AWAY && r->at.known[c][SLOT_NORMAL] == 2;
            const double times = location_indicator(r, c, SLOT_NORMAL) * (leaves ? 2.0 : 1.0);
            if (!r->struck[c] || !(leaves || state == CONTACT_TOUCHING)) continue;
            keep_beginning(r, tangents, c, SLOT_NORMAL, 0, leaves ? 2 : 0, times, misses);
        } else if (model_contact_tangential[c] && state == CONTACT_STICK) {
            keep_beginning(r, tangents, c, SLOT_TANGENTIAL, 1, 0, 1.0, misses);
            keep_beginning(r, tangents, c, SLOT_TANGENTIAL, -1, 0, 1.0, misses);
        } else if (model_contact_tangential[c] && slips && r->at.known[c][SLOT_TANGENTIAL] == 1) {
            keep_beginning(r, tangents, c, SLOT_TANGENTIAL, 0, 1, location_indicator(r, c, SLOT_TANGENTIAL), misses);
        }
    }
}

typedef void (*OfIndicator)(const Run *r, Tangents *tangents, int c, int slot, int side, double end,
                            NearMisses *misses);

static void each_pending_indicator(const Run *r, Tangents *tangents, double end, NearMisses *misses, OfIndicator visit)
{
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            const int settles = r->at.state[c] == CONTACT_CHATTERING || contact_is_settling(r, c);
            if (location_indicator(r, c, (Slot)slot) == 0 || settles) continue;
            if (indicator_is_margin(r, c, slot)) {
                visit(r, tangents, c, slot, 1, end, misses);
                visit(r, tangents, c, slot, -1, end, misses);
            } else {
                visit(r, tangents, c, slot, 0, end, misses);
            }
        }
    }
}

void near_misses_note(const Run *r, Tangents *tangents, double until, NearMisses *misses)
{
    const double length = fmin(until - r->segment_start, r->segment_length);
    const double end = r->segment_rooted ? sqrt(length) : length;
    if (!(length > 0.0)) return;
    for (int k = 0; r->segment_linear && k < tangents->count; k += PAIR)
        linear_variation(r, tangents, k, 1);
    settle_pending(r, tangents, misses);
    if (misses->events != r->events && !r->segment_rooted) note_beginnings(r, tangents, misses);
    misses->events = r->events;
    each_pending_indicator(r, tangents, end, misses, search_misses);
    if (r->segment_event && length >= r->segment_length) each_pending_indicator(r, tangents, end, misses, keep_falling);
}

#include "../model/scalar_real.h"
