/*
 * Events that accumulate at one time.
 *
 *     pauses like a geometric sequence:  of crossings of bounds of regions, when half as many events as an instant may
 *                    have have not moved time, or some have gone no farther than rounding of the place sees: the body
 *                    is put to rest where they accumulate, on the bounds and without slip of the contacts whose slip
 *                    came to zero again and again. What it touches there decides whether it stays; if not, an error
 *                    says where. Impacts have their own end (chatter.c).
 *                    of switches, one of which knows of its own sign only in the second derivative: there it and its
 *                    rate are zero, and all that switched slide from then on, if they can hold it (second-order sliding)
 *     pauses like 1/n:  an error, as soon as so many events are to be expected that they would take hours
 */
#include "accumulation.h"

#include "../step/contact_forces.h"
#include "contact_placement.h"

/* whether events accumulate at a time; asked once per event */
static int accumulate(Run *r)
{
    r->longest_pause = fmax(r->longest_pause, r->at.time - r->last_event);
    r->last_event = r->at.time;
    if (r->at.time - r->accumulation_start > r->tolerances.accumulation_span * r->longest_pause) {
        r->accumulation_start = r->at.time;
        r->accumulated_events = 0;
    }
    return ++r->accumulated_events > 10 * r->tolerances.max_iterations;
}

/*
 * Whether events speed up without end; asked once per event that is no impact. Pauses that shrink like 1/n double the
 * number of events in equal times: bodies that come to rest between two regions, each of which pushes them into the
 * other. A steady pace takes twice as long for twice as many, and is begun anew.
 */
RunStatus accumulation_check_pace(Run *r, int c)
{
    const double STEADY = 1.5;
    if (++r->paced_events < r->paced_at) return RUN_OK;
    const double span = r->at.time - r->paced_time;
    const int steady = span > STEADY * r->paced_span;
    const double left = r->goal - r->at.time;
    r->paced_time = r->at.time;
    r->paced_span = steady ? INFINITY : span;
    r->paced_events = steady ? 0 : r->paced_events;
    r->paced_at = steady ? PACED_FIRST : 2 * r->paced_at;
    if (r->paced_events < r->tolerances.paced_least
        || !(log2((double)r->paced_events) * span + left > log2(r->tolerances.most_events) * span)) {
        return RUN_OK;
    }
    return run_fail(r,
                    "contact '%s' switches ever faster at t = %.10g: %ld events, twice as many with every %.2g s, and "
                    "%g s still to come: ask for a shorter time, or change what drives it over its bound from both "
                    "sides",
                    model_contact_names[c], r->at.time, r->paced_events, span, left);
}

/* whether the last step went no farther from the bound of region c than rounding of the place sees */
static int is_unseen(const Run *r, int c)
{
    const double h = r->segment_rooted ? sqrt(r->segment_length) : r->segment_length;
    const double *depth = r->jets.depth[c];
    const double way = (fabs(depth[1]) + fabs(depth[2]) * h) * h;
    return way <= r->tolerances.slip * model_depth_magnitude(r->at.p, r->at.d, &r->jets, c);
}

int accumulation_note(Run *r)
{
    int bounds = 0;
    for (int c = 0; c < MODEL_NC; c++)
        if (model_contact_tangential[c] && r->falling[c][SLOT_NORMAL]) r->unseen = is_unseen(r, c) ? r->unseen + 1 : 0;
    if (r->stalled == 0 && r->unseen == 0) memset(r->stalls, 0, sizeof r->stalls);
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++)
            r->stalls[c][slot] |= r->falling[c][slot];
        bounds |= model_contact_tangential[c] && r->stalls[c][SLOT_NORMAL];
    }
    return bounds;
}

int accumulation_ends(const Run *r)
{
    enum { UNSEEN = 16 };
    return r->stalled == r->tolerances.max_iterations / 2 || r->unseen == UNSEEN;
}

/* what a correction leaves of a number that it takes is rounding */
static void drop_rounding(const Run *r, const double *before, double *x, int from, int to)
{
    for (int i = from; i < to; i++)
        x[i] = fabs(x[i]) <= r->tolerances.slip * fabs(before[i]) ? 0.0 : x[i];
}

/* move the coordinates by this much along what the force of c moves */
static void shift_along(Run *r, int c, double way)
{
    for (int i = 0; i < MODEL_NQ; i++)
        r->at.x[i] += r->scratch.W[i][c][0] * way;
    placement_load(r);
}

/* move the coordinates onto the end of a region, from so near that they see it straight */
static void place_on_bound(Run *r, int c)
{
    double before[MODEL_ROOM(MODEL_NX)];
    const double depth = r->scratch.depth[c][0];
    memcpy(before, r->at.x, sizeof before);
    shift_along(r, c, depth);
    const double change = r->scratch.depth[c][0] - depth;
    const double way = change != 0.0 ? -depth * depth / change - depth : -depth;
    shift_along(r, c, way);
    drop_rounding(r, before, r->at.x, 0, MODEL_NQ);
    placement_load(r);
}

void accumulation_place(Run *r)
{
    signed char held[NC];
    double before[MODEL_ROOM(MODEL_NX)];
    memcpy(before, r->at.x, sizeof before);
    placement_load(r);
    placement_load_inertia(r);
    for (int c = 0; c < MODEL_NC; c++) {
        const int region = model_contact_tangential[c];
        held[c] = (signed char)(region && r->stalls[c][SLOT_TANGENTIAL] && placement_has_lever(r, c));
        if (region && r->stalls[c][SLOT_NORMAL] && r->scratch.depth[c][0] != 0.0) place_on_bound(r, c);
    }
    contact_project(&r->at, &r->scratch, held, NULL);
    drop_rounding(r, before, r->at.x, MODEL_NQ, MODEL_NQ + MODEL_NV);
    run_touched(r);
}

int accumulation_rest(Run *r)
{
    enum { STALLED = 16 };
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++)
        any |= contact_may_rest(c) && r->stalls[c][SLOT_TANGENTIAL];
    if (!any || r->stalled != STALLED) return 0;
    placement_note_slips(r);
    for (int c = 0; c < MODEL_NC; c++)
        if (model_contact_sticks[c] && r->stalls[c][SLOT_TANGENTIAL]) r->at.state[c] = CONTACT_STICK;
    return 1;
}

RunStatus accumulation_check(Run *r, int last, int bounds)
{
    if (accumulate(r)) {
        return run_fail(
            r, "contact '%s' switches ever faster at t = %.17g: %d events since t = %.17g, without an end in sight",
            model_contact_names[last], r->at.time, r->accumulated_events, r->accumulation_start);
    }
    if (++r->stalled <= r->tolerances.max_iterations && r->unseen <= r->tolerances.max_iterations) return RUN_OK;
    if (bounds) {
        return run_fail(r,
                        "contact '%s' switches ever faster up to t = %.17g: the pauses between its crossings shrink to "
                        "nothing there, and the body cannot rest where they end: change what drives it over its bound "
                        "from both sides",
                        model_contact_names[last], r->at.time);
    }
    return run_fail(r,
                    "contact '%s' keeps switching at t = %.17g: after %d events without progress the motion there is "
                    "not determined by the model, or rounding hides how it goes on",
                    model_contact_names[last], r->at.time, r->stalled);
}
