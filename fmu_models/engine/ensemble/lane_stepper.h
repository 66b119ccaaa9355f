/* What steps many motions at once, from strobe to strobe: the contract between an ensemble and a library beside the FMU
   (fmu_models/lanes). Whatever it cannot decide it leaves as it was, and the series of the engine make that step. */
#ifndef STICKSLIP_LANE_STEPPER_H
#define STICKSLIP_LANE_STEPPER_H

#include <stdint.h>

#include "../model/model.h"

/* changes with this header */
enum { LANE_STEPPER_VERSION = 2 };

/* one motion, between two strobes */
typedef struct {
    double x[MODEL_ROOM(MODEL_NX)];
    double memory[NC];     /* as Point has it */
    signed char state[NC]; /* ContactState */
    /* time in contact since the last row, how often that began, and, where one is held, from when on */
    double held[NC], since[NC];
    int32_t began[NC];
    int32_t wanted;  /* to be stepped */
    int32_t decided; /* it was: the motion is at the next strobe, where its time is the same */
    double speed;    /* of the states there, where tangents are followed */
} LaneMotion;

typedef struct {
    int64_t version;
    const char *token; /* of the model */
    int64_t together;  /* motions that one instruction takes */
    /* bytes for so many motions, and their beginning; aligned to 64 */
    int64_t (*room)(int64_t motions);
    void (*open)(void *room, int64_t motions);
    /* motion `slot` has these parameters and inputs, is strobed every `period`, and the forcing is that from `origin`
       on; 0: it is none for lanes */
    int (*place)(void *room, int64_t slot, const double *p, const double *u, double origin, double period);
    /* step all motions that want it, and differences of neighbours along each, tangents[motion][direction][state] */
    void (*step)(void *room, LaneMotion *motions, int64_t directions, double *tangents);
} LaneStepper;

#endif
