/* What happens to one lane where a guard has fallen, and at the ends of a period. */
#pragma once

#include "lane_held.h"
#include "lane_modes.h"
#include "pool.h"

enum {
    LANES_ORDER = 13,    /* of the series */
    LANES_GUESS = 7,     /* of the part of it that is searched for a root first */
    LANES_ROUNDS = 1000, /* sub-steps of one lane in a period */
    LANES_ZERO = 8       /* zeros of a guard that stays zero over a sub-step */
};

/* guard g has fallen in a lane, so long after the strobe: change its mode, its states, its known zeros and, where that takes
   a while, the time. What is not decided here the engine decides; if it does not either the lane has failed. 1 if neighbours
   take the same way (lane_tangents.c) */
int lane_event(Pool *pool, int64_t slot, int g, double *time);
/* the same of a stop where no force holds a contact, at a depth that changes at a rate: states are not looked at */
static inline void lane_stop(LaneTable *t, Lane *lane, int g, double depth, double rate, double time)
{
    const int c = lanes_guard_contact[g];
    LaneMotion *m = &lane->motion;
    const int before = m->state[c];
    int64_t *known = lane->known;
    int digit; /* away, touching, released */
    memset(known, 0, sizeof lane->known);
    if (lanes_guard_slot[g] == GUARD_TANGENTIAL) {
        digit = before == CONTACT_RELEASED ? 1 : depth > 0.0 ? 2 : 0;
        known[digit == 0 ? g - 1 : g] = 1;
    } else {
        digit = before == CONTACT_AWAY;
        known[g] = 1;
        if (before == CONTACT_AWAY) {
            m->memory[c] = fabs(rate);
            if (g + 1 < LANES_GUARDS && lanes_guard_contact[g + 1] == c)
                known[g + 1] = t->entry_release[c][0] * rate + t->entry_release[c][1] == 0.0;
        }
    }
    lane->mode = t->mode[lane->mode].with[c][digit];
    lane->failed |= !table_at(t, lane->mode)->usable;
    m->state[c] = t->mode[lane->mode].state[c];
    if (before == CONTACT_TOUCHING) m->held[c] += time - m->since[c];
    if (digit == 1) {
        m->since[c] = time;
        m->began[c]++;
    }
}

/* take up a motion that wants a step; 0 if it is none for lanes at present */
static inline int lane_begin(Pool *pool, int64_t slot, const LaneMotion *motion)
{
    Lane *lane = &pool->lanes[slot];
    LaneTable *t = &pool->tables[slot];
    if (!motion->wanted || !t->usable) return 0;
    const int same = !lane->failed && memcmp(motion->state, lane->motion.state, sizeof motion->state) == 0;
    const int mode = same ? lane->mode : table_mode(motion->state);
    if (mode < 0 || !table_at(t, mode)->usable) return 0;
    lane->motion = *motion;
    lane->mode = mode;
    lane->failed = 0;
    for (int i = 0; i < MODEL_NX; i++)
        lane->z[i] = pool_flushed(motion->x[i] - t->mode[mode].shift[i]);
    return 1;
}

/* hand back one that is at the end of the period; 0 if it is beyond the bound */
static inline int lane_end(Pool *pool, int64_t slot, LaneMotion *motion)
{
    Lane *lane = &pool->lanes[slot];
    const LaneTable *t = &pool->tables[slot];
    int within = 1;
    double *z = lane->z;
    const LaneMode *mode = &t->mode[lane->mode];
    if (mode->held_count > 0) {
        memcpy(z + MODEL_NX, t->phasor[lane_point(t->steps)], 2 * LANES_HARMONICS * sizeof *z);
        held_settle(t, mode, z);
    }
    *motion = lane->motion;
    for (int i = 0; i < MODEL_NX; i++) {
        motion->x[i] = z[i] + mode->shift[i];
        within &= fabs(motion->x[i]) <= pool->bound;
    }
    for (int c = 0; c < MODEL_NC; c++)
        motion->since[c] -= t->period;
    motion->made++;
    return within;
}

/* whether differences may have been lost on the way from a strobe to the next: a contact was closed or stuck */
int lane_loses(const LaneMotion *from, const LaneMotion *to);
