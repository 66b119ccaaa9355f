/*
 * The end of a chatter, of infinitely many impacts in finite time.
 *
 *     one contact:   after an impact with speed w+ off a wall that is approached with the acceleration P (P' its rate),
 *                    the bounces end after   2 u / P - (4/3) P' u^2 / P^3,   u = w+ / (1 - e).
 *                    From the bounce on at which w+ is below `chatter` of the fastest, the contact is held and the end
 *                    of the bounces is an event.
 *     several:       contacts that open each other (the corners of a block that rocks) close again and again. Pauses
 *                    between the closings of one shrink like a geometric sequence of ratio rho, which ends
 *                    pause rho / (1 - rho)   after a closing. From the closing on after which all that open again are
 *                    slower than `chatter` of their fastest impact, they are held, as above.
 *     no sequence:   of several whose pauses follow no ratio all are held, at once, where they are as slow and half as
 *                    many events as an instant may have have not moved time.
 *                    What cannot be held together, because a force would have to pull, goes on as it was.
 *     resets:        of a switch at whose zeros its rate is multiplied by r, |r| < 1, while the flow pushes it back with
 *                    P on this side and Q on the next (P, where it bounces): after one with rate v they end after
 *                    2 v (1/P + |r|/Q)/(1 - r^2).   From the reset on at which v is below `chatter` of the fastest the
 *                    zeros are passed over, and the end is an event: rest, if both sides still push.
 */
#include "chatter.h"

#include "../step/contact_forces.h"
#include "../step/roots.h"
#include "../step/taylor.h"
#include "contact_placement.h"
#include "gap_tolerance.h"
#include "mode_selection.h"

/* whether another open contact that feels c reaches its wall within a time; tail: it too is in the tail of a chatter */
static int disturbed(const Run *r, int c, double wait, int *tail)
{
    enum { ORDER = 4 };
    const Jets *j = &r->scratch;
    *tail = -1;
    for (int e = 0; e < MODEL_NC; e++) {
        if (e == c || !model_contact_impulsive[e] || r->at.state[e] != CONTACT_AWAY || j->G[c][e][0] == 0.0) continue;
        double gap[ORDER + 1];
        const int known = r->at.known[e][SLOT_NORMAL] < ORDER ? r->at.known[e][SLOT_NORMAL] : ORDER;
        for (int k = known; k <= ORDER; k++)
            gap[k - known] = -j->depth[e][k];
        if (first_fall(gap, ORDER - known, wait) >= 0.0) {
            if (!(fabs(j->slip[e][0]) <= r->tolerances.chatter * r->at.memory[e])) return 1;
            *tail = e;
        }
    }
    return 0;
}

/* whether rigid contact c, which has just bounced, is in the tail of a chatter that ends after `wait`; other: a contact
   whose chatter ends with it, or -1 */
static int bounces_end(Run *r, int c, double *wait, int *other)
{
    enum { ORDER = 4 };
    /* of the second term of the sum to the first: its square bounds what the series leaves out */
    const double SLOW = 1e-2;
    Jets *j = &r->scratch;
    const double e = model_restitution(r->at.p, r->at.d, c);
    const double speed = j->slip[c][0];
    const int slow = speed <= r->tolerances.chatter * r->at.memory[c];
    if (!(e < 1.0) || !(slow || r->tolerances.drift > 0.0)) return 0;
    taylor_series(r, j, ORDER, INFINITY);
    const double P = 2.0 * j->depth[c][2];
    const double rate = 6.0 * j->depth[c][3];
    const double u = speed / (1.0 - e);
    /* an importer cannot follow bounces lower than its own errors */
    if (!slow && !(speed * speed <= 2.0 * P * gap_resolution(r, j, c))) return 0;
    if (!(P > 0.0) || !(u * fabs(rate) <= SLOW * P * P)) return 0;
    *wait = 2.0 * u / P - 4.0 / 3.0 * rate * u * u / (P * P * P);
    return !disturbed(r, c, *wait, other);
}

/* contacts marked are held until the times at which they settle */
static RunStatus hold_until(Run *r, const signed char *member, int *moved)
{
    const signed char at_limit[NC] = {0};
    signed char candidate[NC];
    for (int c = 0; c < MODEL_NC; c++) {
        candidate[c] = member[c];
        if (member[c]) r->at.state[c] = r->at.settles[c] > r->at.time ? CONTACT_CHATTERING : CONTACT_TOUCHING;
    }
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++)
        if (member[c])
            placement_friction(r, c, candidate);
        else if (contact_is_held(r->at.state, c))
            candidate[c] = 1;
    return selection_make(r, candidate, at_limit, moved);
}

/* contacts that bounced slowly enough */
static RunStatus settle_bounces(Run *r, int *moved)
{
    signed char member[NC] = {0};
    int any = 0;
    for (int c = 0; c < MODEL_NC; c++) {
        double wait;
        int other;
        if (!r->struck[c] || r->at.state[c] != CONTACT_AWAY || !bounces_end(r, c, &wait, &other)) continue;
        for (int e = c; e >= 0; e = e == c ? other : -1) {
            r->at.settles[e] = r->at.time + wait;
            member[e] = 1;
            any = 1;
        }
    }
    return any ? hold_until(r, member, moved) : RUN_OK;
}

/* note that c has closed; 1 and when its closings end if their pauses shrink in a steady ratio */
static int closings_end(Run *r, int c, double *wait)
{
    const double STEADY = 1e-2; /* of what the ratio lacks to one */
    Closings *k = &r->closings[c];
    const double pause = (r->at.time - k->closed) + (r->at.time_rest - k->closed_rest);
    const double ratio = k->count > 1 && k->pause > 0.0 ? pause / k->pause : 1.0;
    const int steady = k->count > 2 && fabs(ratio - k->ratio) <= STEADY * (1.0 - ratio);
    *k = (Closings){k->count + 1, k->struck, r->at.time, r->at.time_rest, pause, ratio, k->fastest};
    *wait = steady ? pause * ratio / (1.0 - ratio) : 0.0;
    return steady;
}

/* mark c and the open contacts that have struck in the last so many seconds, if they are slow; 1 if there are any */
static int mark_open(Run *r, int c, double pause, signed char *member)
{
    int any = 0;
    memset(member, 0, NC);
    for (int e = 0; e < MODEL_NC; e++) {
        if (!model_contact_impulsive[e] || r->at.state[e] != CONTACT_AWAY || !(r->closings[e].fastest > 0.0)
            || r->closings[e].struck < r->at.time - pause) {
            continue;
        }
        const double speed = fabs(r->scratch.slip[e][0]);
        const int low = r->tolerances.drift > 0.0 && speed * pause <= gap_resolution(r, &r->scratch, e);
        if (!low && !(speed <= r->tolerances.chatter * r->closings[e].fastest)) return 0;
        member[e] = 1;
        any = 1;
    }
    member[c] = any;
    return any;
}

/* contacts that opened each other slowly enough; c has just closed */
static RunStatus settle_together(Run *r, int c, double pause, double wait, int *moved)
{
    signed char member[NC];
    int all = 1;
    placement_load(r);
    if (!mark_open(r, c, pause, member)) return RUN_OK;
    const Point before = r->at;
    for (int e = 0; e < MODEL_NC; e++)
        if (member[e]) r->at.settles[e] = r->at.time + wait;
    const RunStatus status = hold_until(r, member, moved);
    for (int e = 0; e < MODEL_NC; e++)
        all &= !member[e] || contact_is_held(r->at.state, e);
    if (status == RUN_ERROR || !all) {
        r->at = before;
        placement_load(r);
        return RUN_OK;
    }
    for (int e = 0; e < MODEL_NC; e++)
        if (member[e]) r->closings[e] = (Closings){0};
    return RUN_OK;
}

RunStatus chatter_settle(Run *r, int *moved)
{
    const int exhausted = r->stalled >= r->tolerances.max_iterations / 2;
    if (settle_bounces(r, moved) == RUN_ERROR) return RUN_ERROR;
    for (int c = 0; c < MODEL_NC; c++) {
        if (!r->struck[c]) continue;
        double wait = 0.0;
        r->closings[c].struck = r->at.time;
        const int steady = contact_is_held(r->at.state, c) && closings_end(r, c, &wait);
        if (steady || exhausted) {
            if (settle_together(r, c, steady ? r->closings[c].pause : 0.0, wait, moved) == RUN_ERROR) return RUN_ERROR;
        }
    }
    return RUN_OK;
}

double chatter_rate(Run *r, int c)
{
    taylor_load(r, &r->scratch);
    taylor_field(r, &r->scratch, 0);
    return contact_rest_rate(&r->at, &r->scratch, c);
}

/* how strongly the flow on a side pushes the function of a switch, which is zero, back to it */
static double push_back(Run *r, int c, int side)
{
    enum { ORDER = 3 };
    const signed char state = r->at.state[c];
    r->at.state[c] = (signed char)side;
    taylor_series(r, &r->scratch, ORDER, INFINITY);
    r->at.state[c] = state;
    return -2.0 * side * r->scratch.slip[c][2];
}

void chatter_note_reset(Run *r, int c, double before)
{
    Closings *k = &r->closings[c];
    const double after = chatter_rate(r, c);
    const double ratio = fabs(after / before);
    /* an importer cannot follow what stays as near to zero as its own errors */
    const double slow = fmax(r->tolerances.chatter, sqrt(r->tolerances.drift));
    k->fastest = fmax(k->fastest, fabs(before));
    if (!(ratio < 1.0) || fabs(after) > slow * k->fastest) return;
    const int side = after > 0.0 ? 1 : -1;
    const double own = push_back(r, c, side);
    const double other = before * after < 0.0 ? own : push_back(r, c, -side);
    if (!(own > 0.0 && other > 0.0)) return;
    k->count = 1;
    r->at.settles[c] = r->at.time + 2.0 * fabs(after) / (1.0 - ratio * ratio) * (1.0 / own + ratio / other);
}
