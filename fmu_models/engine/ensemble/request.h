/* Many runs over many steps of a section: what is asked for and what comes of it. The program that asks reads these
   structures here. */
#pragma once

#include <stdint.h>

/* where a motion is looked at: once per period; where a state crosses a level; where a contact begins or ends; a map at
   every step */
typedef enum {
    SECTION_STROBE = 0,
    SECTION_LEVEL = 1,
    SECTION_BEGIN = 2,
    SECTION_END = 3,
    SECTION_STEP = 4
} SectionKind;

/* how a run ended: after all its steps; on a motion that repeats itself; on a known orbit; beyond the bound; without
   meeting the section in time; by an error of the engine, which has a message; because the caller said so; not at all: a
   strobe of its period sees another forcing each time, with a message */
typedef enum {
    OUTCOME_FINISHED = 0,
    OUTCOME_SETTLED = 1,
    OUTCOME_ABSORBED = 2,
    OUTCOME_ESCAPED = 3,
    OUTCOME_LOST = 4,
    OUTCOME_BROKEN = 5,
    OUTCOME_STOPPED = 6,
    OUTCOME_UNFIT = 7
} Outcome;

/* characters of the message of a run */
enum { ENSEMBLE_MESSAGE = 256 };

/* beside the states and the memories of all contacts, a row holds the time and the time since the row before it */
enum { ENSEMBLE_TIMES = 2 };

typedef struct {
    /* the runs: value k of run i is values[i * n_set + k]; with `follow` run i begins where run i - follow ended, at the
       same phase: as many chains beside one another; resumed: of the first of each, whether its values are such an end */
    int64_t n_runs, n_set, follow;
    const int64_t *resumed;
    const uint32_t *set;
    const double *values;
    double tolerance;
    /* the time at which each run starts; that of a strobe goes back to zero, from which periods count too */
    const double *starts;
    /* the section, the period of each run (of the forcing; 0: nothing forces it), and how long to wait for it */
    int32_t kind, direction, contact;
    uint32_t state;
    double level;
    const double *periods, *patience;
    /* a motion farther out than this goes to infinity */
    double bound;
    /* steps that are not recorded, and rows of `batch` steps each that are */
    int64_t transient, n_rows, batch;
    /* longest period looked for, 0: none; weights of states and time in the distance of two points, and the distance
       below which they are one; states whose weight is 0 do not count */
    int64_t longest;
    const double *weights;
    double settled;
    /* after how much of itself each state is the same, INFINITY for one that is no angle */
    const double *turns;
    /* points of known orbits, MODEL_NX each, and quadratic forms, below 1 near them; the point that follows each; its
       orbit; how many points in a row must be met */
    int64_t n_known;
    const double *known, *metric;
    const int64_t *next, *orbit, *passes;
    /* tangents: how many, and room for them; with jacobians the derivative of each step is written, otherwise their
       growth; with `flow` the first is along the motion, and its growth is told less that of the speed */
    int64_t n_directions, flow;
    const int64_t *along; /* where in states, memories and time each begins as a unit vector */
    void *room;
    /* results; NULL: not wanted. Rows of MODEL_NX + MODEL_NC + ENSEMBLE_TIMES; per contact the time in contact or stick
       and how often that began; jacobians[row][result][direction] over a row without its last time */
    double *points, *held;
    int32_t *began;
    double *growth, *jacobians;
    /* per run: rows that are filled, steps made, how it ended, its period (0: none), the known orbit (-1: none) */
    int64_t *rows, *steps;
    int32_t *outcomes;
    int64_t *recurs, *orbits;
    char *messages;
    /* set to another number than 0 from outside: return soon */
    const int32_t *stop;
    /* room of the engine */
    double *memory;
    /* what steps strobes in lanes (lane_stepper.h), NULL: nothing; room for it, aligned to 64 bytes; steps per run that it
       made */
    const void *lanes;
    void *lane_room;
    int64_t *in_lanes;
} Ensemble;

/* so many runs lie between two of one chain: a run that follows none is a chain by itself */
static inline int64_t ensemble_chains(const Ensemble *e) { return e->follow > 0 ? e->follow : e->n_runs; }
