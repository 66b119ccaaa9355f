/* Where a pending indicator comes nearest to zero without an event (near_miss.c). */
#pragma once

#include <stdint.h>

#include "tangent.h"

typedef struct {
    double time;  /* s */
    double value; /* of the indicator there: its distance from an event; what begins with its acceleration: that */
    double slope; /* per second, at which it fell until an event of others turned it; 0 at a minimum */
    int32_t contact;
    int32_t slot;
    int32_t side;   /* of the margin of what sticks; else 0 */
    int32_t state;  /* of the contact */
    int32_t begins; /* an impact, or a slip that turned, has just begun the state */
} NearMiss;

/* room for them, and how many there were */
typedef struct {
    int64_t capacity, count;
    int64_t pending; /* behind these: what fell when the last event came, and may rise after it */
    int64_t events;  /* of the run, that have been seen */
    NearMiss *list;
    double *derivatives; /* of their values, one per direction */
} NearMisses;

/* those on the step in use up to a time; beyond the room they are counted only */
void near_misses_note(const Run *r, Tangents *tangents, double until, NearMisses *misses);
