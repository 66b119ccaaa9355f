/* Where a pending indicator comes nearest to zero without an event (near_miss.c). */
#ifndef STICKSLIP_NEAR_MISS_H
#define STICKSLIP_NEAR_MISS_H

#include <stdint.h>

#include "tangent.h"

typedef struct {
    double time;  /* s */
    double value; /* of the indicator there: its distance from an event */
    int32_t contact;
    int32_t slot;
    int32_t side;  /* of the margin of what sticks; else 0 */
    int32_t state; /* of the contact */
} NearMiss;

/* room for them, and how many there were */
typedef struct {
    int64_t capacity, count;
    NearMiss *list;
    double *derivatives; /* of their values, one per direction */
} NearMisses;

/* those on the step in use up to a time; beyond the room they are counted only */
void near_misses_note(const Run *r, Tangents *tangents, double until, NearMisses *misses);

#endif
