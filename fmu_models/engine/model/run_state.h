/*
 * One run of a model: its whole state as plain data (no pointers, so that a copy of the struct is a copy of the run).
 */
#pragma once

#include <float.h>
#include <math.h>
#include <string.h>

#include "model.h"

/* every tolerance of the engine, with its reason; all are relative and without unit */
typedef struct {
    double step;   /* local error of a Taylor step, relative to the size of each state over the step */
    double slip;   /* a slip speed below this fraction of its cancelling terms is zero (rounding of user input) */
    double lever;  /* a lever below this fraction of its size passes through zero, and a slip on the wrong side of zero
                        is its doing: there is nothing to correct in the velocities */
    double energy; /* by more than this fraction no event changes the kinetic energy beyond the work of its impulses;
                        where a body comes to rest, by more than its square of the energy that it had or has typically */
    double margin; /* a stick margin below this fraction of the capacity counts as a tie, decided by its rate */
    double importer; /* Model Exchange only: an indicator is shifted by this fraction of its scale, so that it is
                           positive right after an event and an importer that lands on zero does not see a second one */
    double
        drift; /* Model Exchange only: by so much an importer's own integration may miss the wall of a closed contact,
                  relative
                           to the gap that nominal values of the coordinates make */
    double chatter; /* a bounce off a rigid contact slower than this fraction of its fastest impact since it was last
                    closed is the
                           tail of a chatter, which is completed in closed form: heights are its square, below rounding
                           */
    double
        accumulation_span; /* ten times as many events as max_iterations allows within this fraction of the longest time
                              without any
                           accumulate: none of them will be the last */
    double
        graze; /* derivatives only: an indicator that falls more slowly than this fraction of its terms per step has a
                  double
                           root to rounding, and nothing is left of the digits of a derivative */
    int max_iterations; /* changes of contact states accepted at one instant before the run is declared chattering */
    long pace_steps;    /* steps over which the pace of a run is taken: some seconds of work */
    int paced_least;    /* events before their pace is judged: some hundredths of a second of work */
    double most_events; /* a run whose events would become so many is refused: hours of work */
    double most_paces_left; /* a run that would need this many times so many steps more is refused: hours of work */
} Tolerances;

/* events until their pace is taken for the first time */
enum { PACED_FIRST = 256 };

typedef enum { RUN_OK = 0, RUN_EVENT = 1, RUN_ERROR = 2, RUN_CROSSING = 3, RUN_PAUSED = 4 } RunStatus;

/* a change of contact state; an impact or a reset, after which the state may be as before */
typedef struct {
    double time;
    int contact;
    int before, after; /* ContactState */
    int reset;         /* states jumped where its function fell to zero */
    double work; /* of the impulses on the bodies in contact, J; negative where energy is lost, 0 without an impulse */
} ContactEvent;

/* a level of a state, at whose crossings a run pauses */
typedef struct {
    int watched;
    int state; /* index */
    double level;
    int direction;   /* 1 upward, -1 downward, 0 both */
    int side;        /* of the level on which the state was last seen; 0 not yet known */
    int jumped;      /* the last crossing was the jump of an event: the state is not at the level */
    double searched; /* variable of the series up to which the step in use has been searched */
} Section;

/* how a rigid contact has closed again and again */
typedef struct {
    long count;
    double struck;              /* time of its last impact */
    double closed, closed_rest; /* time of its last closing, and what rounding took from it */
    double pause, ratio;        /* between the last two closings, and in parts of the pause before */
    double fastest;             /* speed of impact */
} Closings;

/* what the length of a step of such sums, or its events, read of a contact */
typedef enum { Y_SLIP, Y_DEPTH, Y_FORCE, Y_RELEASE, Y_CAPACITY, Y_CAPACITY_MINUS, Y_KINDS } LinearQuantity;

/* a mode of a model that is linear with constant factors: its series as sums (step/linear.c) */
typedef struct {
    signed char state[NC]; /* of the contacts */
    int usable;
    int flies;                         /* its states are parabolas (step/flight.c) */
    int rows;                          /* states, and series of contacts */
    signed char quantity[LINEAR_READ]; /* LinearQuantity */
    short contact[LINEAR_READ];
    short first[MODEL_NX + LINEAR_READ + 1];    /* of each row: entry */
    unsigned char last[MODEL_NX + LINEAR_READ]; /* and order */
    unsigned char column[LINEAR_ENTRIES];
    double factor[LINEAR_ENTRIES][LINEAR_ORDER];
    double rate[MODEL_ROOM(MODEL_NH)]; /* of harmonics */
    double length, power; /* over which its series mostly keep the tolerance; of that, of the last term but one */
} LinearMode;

typedef struct {
    Tolerances tolerances;
    Point at;       /* where the run is */
    double horizon; /* no step reaches beyond: the next knot of an input, or infinity */
    double tick;    /* the next knot of a signal, or infinity */
    /* the Taylor step in use: valid on [start, start + length] */
    int segment_valid, segment_order;
    int segment_event;                                /* an event waits at its end */
    signed char falling[MODEL_ROOM(MODEL_NC)][SLOTS]; /* the indicators it belongs to */
    /* what the last event did to a contact: entered with a speed to remember, jumped, brought to zero slip */
    signed char entered[MODEL_ROOM(MODEL_NC)], jumped[MODEL_ROOM(MODEL_NC)], projected[MODEL_ROOM(MODEL_NC)];
    /* the impact that it made: phases, none if there was no impact; contacts that arrived at their wall; work of the
       impulses */
    int impact_phases;
    ImpactPhase impact[2];
    signed char struck[MODEL_ROOM(MODEL_NC)];
    double impact_work;
    double impulse[MODEL_ROOM(MODEL_NC)];
    Closings closings[MODEL_ROOM(MODEL_NC)];
    double nominal_gap[MODEL_ROOM(MODEL_NC)]; /* of what has a depth, from nominal coordinates */
    double
        largest_gap[MODEL_ROOM(MODEL_NC)]; /* of rigid contacts, at the ends of steps so far: rounding of a gap that is
                                                 a single coordinate is in parts of it */
    double noted_slip[MODEL_ROOM(MODEL_NC)]; /* before values were set: what rounding has left of a slip that is held */
    double leeway[MODEL_ROOM(MODEL_NC)];  /* Model Exchange only: added to the indicator of a gap that opens slowly */
    int segment_rests;                    /* it ends in the rest of this cone, by closed form; -1: of none */
    double fastest[MODEL_ROOM(MODEL_NC)]; /* slip of cones since they last began to slip */
    double typical_slip[MODEL_ROOM(MODEL_NC)]; /* Model Exchange only: of cones, at nominal states */
    unsigned char young[MODEL_ROOM(
        MODEL_NC)];     /* Model Exchange only: their slip has just begun: its direction is that of the drive,
                                                  of which integrators would see a very stiff approach */
    int segment_rooted; /* its series run in the square root of time */
    double segment_start, segment_length;
    int segment_linear; /* of its series those that it needs itself are there, by sums of this mode, from 1; else 0 */
    int linear_known;   /* the modes below are of the present parameters and tolerance */
    Section section;
    Jets jets;                       /* of the step */
    Jets scratch;                    /* of evaluations at one instant */
    long steps, events, evaluations; /* evaluations: orders of the series computed, plus single evaluations */
    int stalled;                     /* events since time last moved */
    int unseen; /* crossings of bounds on end that went no farther than rounding of the place sees */
    signed char stalls[MODEL_ROOM(MODEL_NC)][SLOTS]; /* the indicators that fell in all these */
    int starting;           /* the start values are being looked at: they must not be off, by however little */
    int accumulated_events; /* since accumulation_start */
    double accumulation_start, last_event, longest_pause; /* times; the longest time without event */
    /* events that are no impacts: how many were seen when their pace was last taken, when that was, and how long it took
       until then since it had been half as many */
    long paced_events, paced_at;
    double paced_time, paced_span;
    double goal;   /* the time that the caller wants to reach, perhaps by many calls; -infinity if it is not sure to */
    long pause_at; /* steps at which run_advance returns for a while; 0 never */
    void (*look)(void *context); /* called where an event waits, before anything has happened; may be NULL */
    void *look_context;
    double pace_start; /* where the present pace is taken from, at how many steps and events */
    long pace_first_step, pace_first_event;
    char message[256]; /* reason of the last RUN_ERROR */
    /* kept from run to run, for the next one of the same parameters and tolerance */
    LinearMode linear[LINEAR_MODES];
    int linear_count;
    double linear_parameters[MODEL_ROOM(MODEL_NP)], linear_tolerance;
} Run;

/* told of every change of contact state */
typedef void (*EventSink)(void *context, const ContactEvent *event);

extern const Tolerances run_default_tolerances;

/* everything back to start values */
void run_reset(Run *r);
/* after any write to p, u, du, x or time: forget the step in use (p: derive the constants anew) */
void run_parameters_changed(Run *r);
/* signals on the pieces that begin or go on at the present time, and their next knot */
void run_place_signals(Run *r);
void run_touched(Run *r);
/* the same run at a time that is later by so much, for a motion whose forcing is the same there: every time that a run
   keeps moves with it */
void run_shift_time(Run *r, double by);

/* RUN_ERROR with a message */
RunStatus run_fail(Run *r, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* the same if a value is not finite */
RunStatus run_check_finite(Run *r, const char *what, const double *values, int n);
/* the same if a pivot of the mass matrix, as it was last factored, is not positive */
RunStatus run_check_mass(Run *r, const Jets *j);
/* names of contacts in quotes, as a list, cut where it does not fit */
void run_name_contacts(const int *contact, int count, char *names, size_t size);

/* a rigid contact whose force decides, and whose gap is zero */
static inline int contact_is_closed(const Run *r, int c)
{
    return MODEL_IMPACTS > 0 && model_contact_impulsive[c] && r->at.state[c] != CONTACT_AWAY;
}

/* a switch whose resets are so slow that they are over in a moment, at which it comes to rest */
static inline int contact_is_settling(const Run *r, int c) { return contact_may_rest(c) && r->closings[c].count > 0; }

/* an open rigid contact: until it closes, its gap does nothing */
static inline int contact_is_open(const Run *r, int c)
{
    return MODEL_IMPACTS > 0 && model_contact_impulsive[c] && r->at.state[c] == CONTACT_AWAY;
}

/* whether the slip speed or switching function of a contact decides events of its own accord, even where its force is
   zero: it may be any function of states, inputs and time */
static inline int slip_decides(const Run *r, const Jets *j, int c)
{
    return MODEL_NQ == 0 ? r->at.state[c] != CONTACT_STICK : j->sign[c] != 0.0;
}
