/*
 * One step of a section.
 *
 *     repeat   advance to the end of the period, to a crossing, or to the event of the contact
 *     then     a strobe: the time goes back to zero, so that a step is a function of the point alone
 *              another section of a forced motion: the time goes back by whole periods
 *
 * Derivatives on the section: of a strobe at a fixed time; where a state crosses a level later for a neighbour, its
 * point is x + x' dt with dt = -dq/q'; at an event the tangent is at its own event. Where nothing forces the motion, the
 * time is no part of the point.
 */
#include "section_step.h"

#include "../events/contact_placement.h"
#include "../events/model_exchange.h"
#include "../events/run.h"
#include "../step/section.h"
#include "growth.h"

/* less than this is left of a difference beside another one: soon there would be rounding alone */
static const double LOST_LENGTH = 1e-6;

static int walk_holds(int c, int state)
{
    return model_contact_impulsive[c]   ? state != CONTACT_AWAY
           : model_contact_compliant[c] ? state == CONTACT_TOUCHING
                                        : state == CONTACT_STICK;
}

void section_step_note(void *context, const ContactEvent *event)
{
    Walk *w = context;
    const int c = event->contact;
    const int before = walk_holds(c, event->before);
    const int after = walk_holds(c, event->after);
    const int begins = model_contact_impulsive[c]      ? !before
                       : (model_contact_resets[c] & 3) ? event->reset
                                                       : after && !before;
    if (before && !after) w->held[c] += event->time - w->contact_since[c];
    if (after && !before) w->contact_since[c] = event->time;
    w->began[c] += begins;
    w->losing |= begins && !model_contact_compliant[c];
    w->met |= c == w->e->contact && (w->e->kind == SECTION_BEGIN ? begins : before && !after);
}

void section_step_start(const Run *r, Walk *w)
{
    w->since = r->at.time;
    for (int c = 0; c < MODEL_NC; c++) {
        w->contact_since[c] = r->at.time;
        w->held[c] = 0.0;
        w->began[c] = 0;
    }
}

void section_step_close_row(const signed char *state, double time, Walk *w)
{
    for (int c = 0; c < MODEL_NC; c++) {
        if (walk_holds(c, state[c])) w->held[c] += time - w->contact_since[c];
        w->contact_since[c] = time;
    }
}

/* the point is of the time as the section has it: back to zero, or by whole periods */
static void walk_wrap(Run *r, Walk *w)
{
    const double period = w->e->periods[w->run];
    double back = 0.0;
    if (w->e->kind == SECTION_STROBE)
        back = r->at.time;
    else if (period > 0.0)
        back = period * floor(r->at.time / period);
    if (back == 0.0) return;
    run_shift_time(r, -back);
    if (w->e->kind == SECTION_STROBE) {
        signed char closed[NC];
        /* where walls are now: rounding of the period would else leave a closed contact in its wall */
        placement_closed_on_walls(r, closed);
    }
    w->since -= back;
    for (int c = 0; c < MODEL_NC; c++)
        w->contact_since[c] -= back;
}

static Outcome walk_check(const Run *r, const Walk *w)
{
    for (int i = 0; i < MODEL_NX; i++)
        if (!(fabs(r->at.x[i]) <= w->e->bound)) return OUTCOME_ESCAPED;
    return OUTCOME_FINISHED;
}

/* the state that crosses is at its level, whatever the rounding of the time makes of it: on the other side of the level a
   step that begins there would cross it once more */
static void walk_on_level(Run *r, const Walk *w)
{
    r->section.watched = 0;
    if (w->crossed && !r->section.jumped) r->at.x[w->state] = w->e->level;
}

/* until when to wait */
static double walk_end(const Run *r, const Walk *w)
{
    if (w->e->kind == SECTION_STROBE) return r->at.time + w->e->periods[w->run];
    return r->at.time + w->e->patience[w->run];
}

static Outcome walk_begin(Run *r, Walk *w)
{
    w->met = w->losing = 0;
    w->since = r->at.time;
    if (w->e->kind == SECTION_LEVEL && !w->crossed) section_watch(r, w->state, w->e->level, w->e->direction);
    /* on from a crossing with its side known: looked for anew, the rounding of its time would let it count once more */
    r->section.watched = w->e->kind == SECTION_LEVEL;
    w->crossed = 0;
    return walk_check(r, w);
}

Outcome section_step(Run *r, Walk *w)
{
    const double end = walk_end(r, w);
    const int by_event = w->e->kind == SECTION_BEGIN || w->e->kind == SECTION_END;
    Outcome outcome = walk_begin(r, w);
    if (outcome != OUTCOME_FINISHED) return outcome;
    r->goal = w->e->kind == SECTION_STROBE ? end : -INFINITY;
    while (1) {
        const RunStatus status = run_advance(r, end, by_event, section_step_note, w);
        /* what goes to infinity in finite time has no series at its end, and is beyond the bound there */
        if (status == RUN_ERROR) return walk_check(r, w) == OUTCOME_ESCAPED ? OUTCOME_ESCAPED : OUTCOME_BROKEN;
        w->crossed = status == RUN_CROSSING;
        if (w->crossed || w->met) break;
        if (status == RUN_EVENT) continue;
        if (w->e->kind == SECTION_STROBE) break;
        outcome = walk_check(r, w);
        return outcome == OUTCOME_FINISHED ? OUTCOME_LOST : outcome;
    }
    walk_on_level(r, w);
    walk_wrap(r, w);
    return walk_check(r, w);
}

/* the next crossing on the step in use, as a time; INFINITY if none */
static double walk_crossing(Run *r, const Walk *w, double until)
{
    if (w->e->kind != SECTION_LEVEL) return INFINITY;
    const double length = (until - r->segment_start) - r->jets.time_rest;
    const double s = section_next(r, r->segment_rooted ? sqrt(length) : length);
    return s < 0.0 ? INFINITY : r->segment_start + (r->segment_rooted ? s * s : s);
}

/* derivatives of the point on the section */
static RunStatus walk_project(Run *r, const Walk *w, Tangents *tangents, int n, double *directions)
{
    double rates[MODEL_ROOM(MODEL_NX)];
    const int forced = w->e->periods[w->run] > 0.0;
    if (w->e->kind == SECTION_STROBE || w->e->kind == SECTION_LEVEL) tangents_hold(tangents);
    if (w->e->kind == SECTION_LEVEL && exchange_derivatives(r, rates) == RUN_ERROR) return RUN_ERROR;
    for (int k = 0; k < n; k++) {
        double *d = directions + (size_t)k * EXTENDED;
        tangents_read(tangents, k, d);
        double *time = &d[MODEL_NX + MODEL_NC];
        if (w->e->kind == SECTION_LEVEL) {
            *time = -d[w->state] / rates[w->state];
            for (int i = 0; i < MODEL_NX; i++)
                d[i] += rates[i] * *time;
            d[w->state] = 0.0;
        }
        for (int c = 0; c < MODEL_NC; c++) {
            /* what a contact remembers counts while it lasts */
            if (!model_contact_remembers[c] || r->at.state[c] == CONTACT_AWAY) d[MODEL_NX + c] = 0.0;
        }
        if (!forced || w->e->kind == SECTION_STROBE) *time = 0.0;
    }
    return RUN_OK;
}

/* take out what lies along the motion: where nothing forces it, that is not seen at its section */
static RunStatus walk_beside_motion(Run *r, const Walk *w, double *d)
{
    double rates[MODEL_ROOM(MODEL_NX)];
    if (w->e->kind == SECTION_STROBE || w->e->periods[w->run] > 0.0) return RUN_OK;
    if (exchange_derivatives(r, rates) == RUN_ERROR) return RUN_ERROR;
    const double square = growth_product(rates, rates, MODEL_NX);
    const double along = square > 0.0 ? growth_product(rates, d, MODEL_NX) / square : 0.0;
    for (int i = 0; i < MODEL_NX; i++)
        d[i] -= along * rates[i];
    return RUN_OK;
}

/* differences of which a long step would leave rounding beside the one that grows most are set at right angles on the
   way; after an event only once all of them are at one time again */
static RunStatus walk_part(Run *r, Walk *w, Tangents *tangents, int n, double *directions, double *grown)
{
    double sizes[EXTENDED], factors[EXTENDED];
    int near = 0;
    for (int k = 0; k < n; k++) {
        double *d = directions + (size_t)k * EXTENDED;
        tangents_read(tangents, k, d);
        if (d[MODEL_NX + MODEL_NC] != 0.0) return RUN_OK;
        sizes[k] = growth_norm(d, EXTENDED);
        factors[k] = 1.0;
        if (walk_beside_motion(r, w, d) == RUN_ERROR) return RUN_ERROR;
    }
    growth_orthonormalize(directions, n, EXTENDED, EXTENDED, w->losing, factors);
    for (int k = 0; k < n; k++)
        near |= factors[k] < LOST_LENGTH * sizes[k];
    if (!near) return RUN_OK;
    w->losing = 0;
    for (int k = 0; k < n; k++) {
        grown[k] *= factors[k];
        tangents_place(r, tangents, k, directions + (size_t)k * EXTENDED);
    }
    return RUN_OK;
}

Outcome section_step_tangents(Run *r, Walk *w, Tangents *tangents, int n, double *directions, double *grown)
{
    const double end = walk_end(r, w);
    Outcome outcome = walk_begin(r, w);
    if (outcome != OUTCOME_FINISHED) return outcome;
    r->goal = w->e->kind == SECTION_STROBE ? end : -INFINITY;
    for (int k = 0; k < n; k++)
        tangents_place(r, tangents, k, directions + (size_t)k * EXTENDED);
    while (r->at.time < end && !w->met) {
        double until;
        const int fresh = !r->segment_valid;
        if (tangents_expand(r, tangents, end, &until) == RUN_ERROR) return OUTCOME_BROKEN;
        if (fresh) r->section.searched = 0.0;
        const double crossing = walk_crossing(r, w, until);
        if (tangents_move(r, tangents, fmin(end, crossing), section_step_note, w) == RUN_ERROR) return OUTCOME_BROKEN;
        w->crossed = crossing < INFINITY;
        w->met |= w->crossed;
        if (grown && !w->met && walk_part(r, w, tangents, n, directions, grown) == RUN_ERROR) return OUTCOME_BROKEN;
    }
    if (!w->met && w->e->kind != SECTION_STROBE) {
        outcome = walk_check(r, w);
        return outcome == OUTCOME_FINISHED ? OUTCOME_LOST : outcome;
    }
    walk_on_level(r, w);
    if (walk_project(r, w, tangents, n, directions) == RUN_ERROR) return OUTCOME_BROKEN;
    walk_wrap(r, w);
    return walk_check(r, w);
}
