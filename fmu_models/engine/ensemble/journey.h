/* One run of an ensemble between its steps: its start, the rows that it fills, and when it is over. */
#pragma once

#include "../fmi/instance.h"
#include "known_orbits.h"
#include "section_step.h"

typedef struct {
    Instance *m;
    Ensemble *e;
    Walk walk;
    Arrival arrival;
    int64_t run;
    int in_lanes;         /* by steps that need no series of tangents */
    int64_t wanted, left; /* rows; steps that are not recorded */
    int64_t batched;      /* steps in the present row */
    double waited;        /* time in it */
    double directions[MODEL_ROOM(MODEL_NX + MODEL_NC + 1)][EXTENDED];
    double grown[EXTENDED]; /* of each in the present row, as a factor, beyond what its row has */
    int length;             /* numbers of a direction that are not always zero */
    double speed;           /* of the motion, where the first tangent began */
} Job;

/* where a motion is, on the section */
typedef struct {
    const double *x, *memory;
    const signed char *state;
    double time;
} Place;

/* the row that a step belongs to; -1: none */
int64_t journey_row(const Job *job);
/* choose the contact states of run i at its start, and make the first tangents; memory: arrival_numbers */
Outcome journey_start(Job *job, int64_t i, double *memory);
/* room for the tangents of the run whose values the instance has */
void journey_make_tangents(const Job *job);
/* the run has stepped with tangents: the derivative of the step, or their growth, into its row; speed: of the motion now,
   where the first is along it */
void journey_differences(Job *job, double speed);
/* whether any contact is held in these states */
static inline int journey_holds(const signed char *state)
{
    int holds = 0;
    for (int c = 0; c < MODEL_NC; c++)
        holds |= contact_is_held(state, c);
    return holds;
}
/* derivatives that begin where the run is are those of a motion that starts there: none moves contacts that are held */
void journey_begin_held(Job *job);
/* the same of differences that are at right angles already, and have grown by these factors */
void journey_grown(Job *job, double *factors, double speed);
/* each difference has grown by a factor since it was set at right angles last */
void journey_grow(Job *job, const double *factors);
/* steps of which nobody asks more than how many they were */
int64_t journey_quiet(const Job *job);
/* so many of these have been made */
void journey_pass(Job *job, int64_t steps);
/* the run has made one more step, over a time: rows, repetition and orbits; 1 if it is over, with its outcome */
int journey_note(Job *job, const Place *at, double time, Outcome *outcome);
/* it is over */
void journey_end(const Job *job, Outcome outcome);

/* unit vectors: of the states as the choice of contact states has left them */
void journey_unit(const Job *job, int chosen, double (*directions)[EXTENDED]);
