/*
 * Model Exchange: evaluations at single instants, for importers that integrate by themselves.
 *
 *     indicator:  a continuous residual that is positive while a contact keeps its state, shifted by a small part of
 *                 its scale: it is positive right after an event, so that an importer does not see a second one
 *     event:      closed rigid contacts are brought back to their walls, and what is held to zero slip, which the
 *                 importer's own integration drifts off
 *                 a rigid contact that has passed its wall met it a little earlier: the motion goes back to there
 *                 by its series, the impact is resolved, and the engine itself goes on to the present time. So neither
 *                 the shift nor the place where the importer stopped changes the energy, and bounces shorter than both
 *                 are not lost
 *                 everything else is resolved where it is
 */
#include "model_exchange.h"

#include "../step/contact_forces.h"
#include "../step/event_location.h"
#include "../step/roots.h"
#include "../step/taylor.h"
#include "contact_fit.h"
#include "contact_placement.h"
#include "gap_tolerance.h"
#include "run.h"
#include "transition.h"

RunStatus exchange_derivatives(Run *r, double *dx)
{
    Jets *j = &r->scratch;
    taylor_load(r, j);
    taylor_field(r, j, 0);
    for (int i = 0; i < MODEL_NQ; i++)
        dx[i] = j->x[MODEL_NQ + i][0];
    for (int i = 0; i < MODEL_NV; i++)
        dx[MODEL_NQ + i] = contact_rate(j, i, 0);
    for (int i = 0; i < MODEL_NZ; i++)
        dx[MODEL_NQ + MODEL_NV + i] = internal_rate(j, i, 0);
    return run_check_finite(r, "derivative of state", dx, MODEL_NX);
}

/* where the slip of a cone counts as zero, in parts of that of all others */
static const double CONE_LANDING = 16.0;

/* by how much the indicator of a force that holds a contact is shifted */
static double force_shift(const Run *r, const Jets *j, int c)
{
    const double scale = model_rate_magnitude(r->at.p, r->at.d, j, c) / j->G[c][c][0];
    return r->tolerances.importer * (isfinite(scale) ? scale : 0.0);
}

/*
 * The leeway of an open contact while it leaves its wall. It is taken away once the contact comes back, by more than an
 * importer's errors in its speed: it meets its wall where that is, be the hop lower than the leeway or not.
 */
static double leeway(const Run *r, const Jets *j, int c)
{
    enum { ERRORS = 4 };
    const double speed = j->slip[c][0];
    if (r->leeway[c] == 0.0 || speed >= 0.0) return r->leeway[c];
    const double least = ERRORS * r->tolerances.importer * model_slip_magnitude(r->at.p, r->at.d, j, c);
    return speed > -least ? r->leeway[c] * (1.0 + speed / least) : 0.0;
}

/* the same of a cone: its slip less a small part of a typical one, once it has come to that since it was zero */
static double watched_cone(Run *r, const Jets *j, int c)
{
    const double shift = r->tolerances.importer, slip = j->slip[c][0],
                 small = CONE_LANDING * shift * r->typical_slip[c];
    if (r->at.state[c] == CONTACT_STICK)
        return j->capacity[c][0] * (1.0 + shift)
               - sqrt(j->force[c + 1][0] * j->force[c + 1][0] + j->force[c + 2][0] * j->force[c + 2][0]);
    r->young[c] = r->young[c] && slip <= sqrt(shift) * r->typical_slip[c];
    return r->young[c] ? slip + small : slip - small;
}

/* what an importer watches in a slot of contact c: positive while the contact keeps its state; scratch holds order 0 */
static double watched(Run *r, int c, Slot slot)
{
    const Jets *j = &r->scratch;
    const int sign = location_indicator(r, c, slot);
    if (sign == 0) return 1.0;
    if (model_contact_impulsive[c] && r->at.state[c] != CONTACT_AWAY) {
        return r->at.state[c] == CONTACT_CHATTERING ? r->at.settles[c] - r->at.time
                                                    : j->force[c][0] + force_shift(r, j, c);
    }
    if (slot == SLOT_NORMAL) return sign * j->depth[c][0] + gap_shift(r, j, c) + leeway(r, j, c);
    if (model_contact_compliant[c]) return sign * j->release[c][0];
    if (contact_is_settling(r, c)) return r->at.settles[c] - r->at.time;
    const double shift = r->tolerances.importer;
    if (cone_is_whole(c)) return watched_cone(r, j, c);
    if (r->at.state[c] == CONTACT_STICK) {
        const double unloaded = model_contact_partner[c] >= 0 ? force_shift(r, j, c) : 0.0;
        const int side = stick_side(j, c);
        const double bound = stick_bound(j, c, side)[0], scale = stick_scale(j, c);
        return (MODEL_DIRECTED ? bound + shift * scale : bound * (1.0 + shift)) - side * j->force[c][0] + unloaded;
    }
    return sign * j->slip[c][0] + shift * model_slip_magnitude(r->at.p, r->at.d, j, c);
}

/* order 0 of all that indicators read, in scratch */
static void load_indicators(Run *r)
{
    taylor_load(r, &r->scratch);
    taylor_field(r, &r->scratch, 0);
    for (int c = 0; c < MODEL_NC; c++)
        if (model_contact_releases[c]) model_release(r->at.p, r->at.d, &r->scratch, 0, c);
}

RunStatus exchange_indicators(Run *r, double *z)
{
    int i = 0;
    load_indicators(r);
    for (int c = 0; c < MODEL_NC; c++) {
        if (model_contact_bounded[c]) z[i++] = watched(r, c, SLOT_NORMAL);
        if (!model_contact_impulsive[c] && !cone_is_side(c)
            && (!model_contact_compliant[c] || model_contact_releases[c]))
            z[i++] = watched(r, c, SLOT_TANGENTIAL);
    }
    return run_check_finite(r, "event indicator", z, MODEL_NI);
}

/* the same for a rigid contact: passed by an open one, no longer pushing, over */
static int rigid_has_fallen(const Run *r, int c, double value)
{
    const Jets *j = &r->scratch;
    switch (r->at.state[c]) {
    case CONTACT_AWAY: return value <= 0.0 || (j->depth[c][0] >= 0.0 && j->slip[c][0] < 0.0);
    case CONTACT_CHATTERING: return value <= 4.0 * DBL_EPSILON * fabs(r->at.time);
    default: return value <= 2.0 * force_shift(r, j, c);
    }
}

/* whether the importer has located a fall of the indicator in a slot */
static int has_fallen(Run *r, int c, Slot slot)
{
    const Jets *j = &r->scratch;
    const double shift = r->tolerances.importer;
    const double value = watched(r, c, slot);
    if (slot == SLOT_NORMAL)
        return model_contact_impulsive[c] ? rigid_has_fallen(r, c, value) : value <= gap_shift(r, j, c);
    if (contact_is_settling(r, c)) return value <= 4.0 * DBL_EPSILON * fabs(r->at.time);
    if (r->at.state[c] == CONTACT_STICK) return 0; /* a candidate anyway; whether it holds is for its force to say */
    if (cone_is_whole(c)) return value <= 0.0;
    return value <= (model_contact_compliant[c] ? 0.0 : shift * model_slip_magnitude(r->at.p, r->at.d, j, c));
}

/* how far below zero an importer that locates events leaves the indicator in a slot, at most; 0 if that is unknown */
static double landing(const Run *r, const Jets *j, int c, Slot slot)
{
    const double shift = r->tolerances.importer;
    if (model_contact_impulsive[c] && r->at.state[c] != CONTACT_AWAY) return force_shift(r, j, c);
    if (slot == SLOT_NORMAL) return gap_shift(r, j, c) + gap_resolution(r, j, c);
    if (model_contact_compliant[c]) return 0.0;
    return shift * (r->at.state[c] == CONTACT_STICK ? stick_scale(j, c) : model_slip_magnitude(r->at.p, r->at.d, j, c));
}

/* the contact whose indicator has fallen furthest, in multiples of where importers land; scratch holds order 0 */
static int furthest(Run *r, double *times)
{
    int found = 0;
    *times = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++) {
            const double past = -watched(r, c, (Slot)slot), usual = landing(r, &r->scratch, c, (Slot)slot);
            if (usual > 0.0 && past > *times * usual) {
                *times = past / usual;
                found = c;
            }
        }
    }
    return found;
}

/* an error in a state that no motion reaches is no fault of the model */
static RunStatus blame_location(Run *r, int c, double times)
{
    const double far = 1e4;
    char said[sizeof r->message];
    if (times < far) return RUN_ERROR;
    memcpy(said, r->message, sizeof said);
    return run_fail(r,
                    "the event of contact '%s' was never located: its indicator is %.1g times further below zero than "
                    "rounding explains, the importer's step is too long. There: %.80s",
                    model_contact_names[c], times, said);
}

/* closed rigid contacts at their walls, and what is held without slip: forces that read the slip are those at zero */
static int undo_drift(Run *r)
{
    signed char held[NC];
    int any = MODEL_IMPACTS > 0 && placement_closed_on_walls(r, held);
    placement_load(r);
    placement_load_inertia(r);
    for (int c = 0; c < MODEL_NC; c++) {
        held[c] = (signed char)(model_contact_impulsive[c]
                                    ? contact_is_closed(r, c)
                                    : contact_is_held(r->at.state, c) && placement_has_lever(r, c));
        any |= held[c];
    }
    return any && contact_project(&r->at, &r->scratch, held, NULL);
}

/* go back to where the first of the rigid contacts that arrive met its wall, and note which do there; by how much
   time */
static double go_back(Run *r)
{
    enum { ORDER = 20 };
    Jets *j = &r->scratch;
    double ago[NC], longest = 0.0;
    taylor_series(r, j, ORDER, INFINITY);
    const double limit = taylor_time_scale(r, j, ORDER);
    for (int c = 0; c < MODEL_NC; c++) {
        ago[c] = 0.0;
        if (!model_contact_impulsive[c] || r->at.state[c] != CONTACT_AWAY || !r->falling[c][SLOT_NORMAL]) continue;
        double past[ORDER + 1];
        for (int k = 0; k <= ORDER; k++)
            past[k] = k % 2 ? -j->depth[c][k] : j->depth[c][k];
        ago[c] = past[0] > 0.0 ? fmax(first_fall(past, ORDER, limit), 0.0) : 0.0;
        longest = fmax(longest, ago[c]);
    }
    if (longest == 0.0) return 0.0;
    for (int i = 0; i < MODEL_NX; i++)
        r->at.x[i] = polynomial_value(j->x[i], ORDER, -longest);
    for (int i = 0; i < MODEL_NU; i++)
        r->at.u[i] -= r->at.du[i] * longest;
    r->at.time -= longest;
    for (int c = 0; c < MODEL_NC; c++) {
        r->falling[c][SLOT_NORMAL] = ago[c] == longest;
        r->falling[c][SLOT_TANGENTIAL] = 0;
    }
    return longest;
}

/*
 * Rigid contacts that leave their wall so slowly that the importer's own errors may put them below it, by so much. Its
 * tolerance may not be known: the leeway grows where a contact is seen below its wall while it leaves.
 */
static void give_leeway(Run *r, const signed char *leaves)
{
    enum { ORDER = 3, ERRORS = 4, GROWTH = 8 };
    Jets *j = &r->scratch;
    taylor_series(r, j, ORDER, INFINITY);
    for (int c = 0; c < MODEL_NC; c++) {
        const double before = r->leeway[c];
        r->leeway[c] = 0.0;
        if (!model_contact_impulsive[c] || r->at.state[c] != CONTACT_AWAY) continue;
        const double least = ERRORS * gap_resolution(r, j, c);
        const double speed = j->slip[c][0];
        if (leaves[c])
            r->leeway[c] = fmax(least, GROWTH * before);
        else if (-j->depth[c][0] <= fmax(least, before) && speed * speed <= least * fabs(j->depth[c][2]))
            r->leeway[c] = fmax(least, before);
    }
}

/* inputs are the importer's: what the engine makes of them on its way back and forth must not stay */
static RunStatus resolve_earlier(Run *r, double now, int *moved)
{
    double u[MODEL_ROOM(MODEL_NU)];
    signed char struck[MODEL_ROOM(MODEL_NC)];
    memcpy(u, r->at.u, sizeof u);
    if (go_back(r) == 0.0) return transition_make(r, moved);
    *moved = 1;
    r->stalled = 0;
    if (transition_make(r, moved) == RUN_ERROR) return RUN_ERROR;
    memcpy(struck, r->struck, sizeof struck);
    const double work = r->impact_work;
    if (run_advance(r, now, 0, NULL, NULL) == RUN_ERROR) return RUN_ERROR;
    for (int c = 0; c < MODEL_NC; c++)
        r->struck[c] |= struck[c];
    r->impact_work += work;
    memcpy(r->at.u, u, sizeof u);
    r->at.time = now;
    r->at.time_rest = 0.0;
    run_touched(r);
    return RUN_OK;
}

/*
 * Friction whose bound the force is seen beyond, and that nothing makes slip: force and rate both tie, as where the
 * importer has not told the rate of an input. It lets go, to the side that its force has kept it from: held it would
 * never be asked again, for its indicator is below zero already.
 */
static void let_go(Run *r)
{
    load_indicators(r);
    for (int c = 0; c < MODEL_NC; c++)
        if (model_contact_tangential[c] && r->at.state[c] == CONTACT_STICK && watched(r, c, SLOT_TANGENTIAL) <= 0.0)
            r->at.state[c] = !cone_is_whole(c) && r->scratch.force[c][0] > 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
    cones_follow(r);
}

RunStatus exchange_event(Run *r, int *changed)
{
    signed char leaves[NC] = {0}, before[NC];
    int arrives = 0;
    double times;
    run_touched(r);
    memcpy(before, r->at.state, sizeof before);
    *changed = undo_drift(r);
    load_indicators(r);
    for (int c = 0; c < MODEL_NC; c++) {
        for (int slot = 0; slot < SLOTS; slot++)
            r->falling[c][slot] = (signed char)has_fallen(r, c, (Slot)slot);
        if (model_contact_impulsive[c] && r->at.state[c] == CONTACT_AWAY && r->falling[c][SLOT_NORMAL]) {
            arrives = 1;
            leaves[c] = r->scratch.slip[c][0] >= 0.0;
        }
    }
    const int latest = furthest(r, &times);
    const RunStatus status = arrives ? resolve_earlier(r, r->at.time, changed) : transition_make(r, changed);
    if (status == RUN_ERROR) return blame_location(r, latest, times);
    let_go(r);
    if (MODEL_IMPACTS > 0) {
        *changed = 1;
        give_leeway(r, leaves);
    }
    for (int c = 0; c < MODEL_NC; c++)
        r->young[c] |= cone_is_whole(c) && r->at.state[c] == CONTACT_SLIP_PLUS && r->at.known[c][SLOT_TANGENTIAL] > 0;
    *changed |= memcmp(before, r->at.state, sizeof before) != 0;
    return status;
}
