/* What steps many motions at once, from strobe to strobe: the contract between an ensemble and a library beside the FMU
   (fmu_models/lanes). Events that it has no rule for the engine decides; a step that it cannot make it leaves as it was,
   and the series of the engine make that. */
#pragma once

#include <stdint.h>

#include "../model/model.h"

/* changes with this header */
enum { LANE_STEPPER_VERSION = 5 };

/* of a difference: less than this is left only by rounding, and less than that by a closed or sticking contact, which takes
   differences away */
#define GROWTH_ROUNDING 1e-13
#define GROWTH_TAKEN 1e-11
/* beyond it, or its inverse, the logarithm of a growth is taken */
#define GROWTH_FAR 1e100

/* one motion, between two strobes */
typedef struct {
    double x[MODEL_ROOM(MODEL_NX)];
    double memory[NC];     /* as Point has it */
    signed char state[NC]; /* ContactState */
    /* time in contact since the last row, how often that began, and, where one is held, from when on */
    double held[NC], since[NC];
    int32_t began[NC];
    int32_t wanted; /* to be stepped */
    int32_t made;   /* strobes that it has come to in this call; its time is the same at all of them */
    double speed;   /* of the states there, where it was not 0 before */
} LaneMotion;

/* an event on the way of a motion */
typedef struct {
    double time;                  /* since the strobe; afterwards that from which the motion goes on */
    signed char falls[NC][SLOTS]; /* the indicators that do */
    signed char known[NC][SLOTS]; /* afterwards: leading zeros of each indicator, as Point has them */
} LaneEvent;

/* decide the event of a motion, and go on for as long as its contacts are in states that no step in lanes begins with;
   0: there is no going on */
typedef int (*LaneResolve)(void *context, int64_t slot, LaneMotion *motion, LaneEvent *event);

typedef struct {
    int64_t version;
    const char *token; /* of the model */
    int64_t together;  /* motions that one instruction takes */
    /* bytes for so many motions, and their beginning; aligned to 64 */
    int64_t (*room)(int64_t motions);
    void (*open)(void *room, int64_t motions);
    /* motion `slot` has these parameters and inputs, is strobed every `period`, and the forcing is that from time
       zero on; 0: it is none for lanes */
    int (*place)(void *room, int64_t slot, const double *p, const double *u, double period);
    /* step all motions that want it by so many periods, fewer where one is not decided, has a state beyond the bound or a
       growth beyond GROWTH_FAR: that many are returned, and made, but for the last one of motions that are not decided.
       Differences of neighbours along each: tangents[group][direction][state] of `together` motions each, a vector aligned
       to its size. With growth[group][direction] these are made orthonormal, as in growth.h, and it is multiplied by what
       they grow by */
    int64_t (*step)(void *room, LaneMotion *motions, int64_t periods, double bound, int64_t directions,
                    double *tangents, double *growth, LaneResolve resolve, void *context);
} LaneStepper;
