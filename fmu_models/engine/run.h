/*
 * One run of a model: its whole state as plain data (no pointers, so that a copy of the struct is a copy of
 * the run), and what can be done with it. The FMI faces and the native face are thin layers over these calls.
 */
#ifndef STICKSLIP_RUN_H
#define STICKSLIP_RUN_H

#include "model.h"

/* every tolerance of the engine, with its reason; all are relative and without unit */
typedef struct {
    double step;        /* local error of a Taylor step, relative to the size of each state over the step */
    double slip;        /* a slip speed below this fraction of its cancelling terms is zero (rounding of user input) */
    double margin;      /* a stick margin below this fraction of the capacity counts as a tie, decided by its rate */
    double importer;    /* Model Exchange only: an indicator is shifted by this fraction of its scale, so that it is
                           positive right after an event and an importer that lands on zero does not see a second one */
    double drift;       /* Model Exchange only: by so much an importer's own integration may miss the wall of a closed contact, relative
                           to the gap that nominal values of the coordinates make */
    double chatter;     /* a bounce off a rigid contact slower than this fraction of its fastest impact since it was last closed is the
                           tail of a chatter, which is completed in closed form: heights are its square, below rounding */
    double crowd;       /* so many events as max_iterations allows within this fraction of the longest time without any: none will end it */
    double graze;       /* derivatives only: an indicator that falls more slowly than this fraction of its terms per step has a double
                           root to rounding, and nothing is left of the digits of a derivative */
    int max_iterations; /* changes of contact states accepted at one instant before the run is declared chattering */
    long lap;           /* steps after which the pace of a run is looked at: some seconds of work */
    double patience;    /* a run that at the pace of its last lap would need so many laps more is refused: hours of work */
} Tolerances;

typedef enum { RUN_OK = 0, RUN_EVENT = 1, RUN_ERROR = 2, RUN_CROSSING = 3, RUN_PAUSED = 4 } RunStatus;

/* a change of contact state, or an impact, after which a rigid contact may be open as before */
typedef struct {
    double time;
    int contact;
    int before, after; /* ContactState */
    double work;       /* of the impulses on the bodies in contact, J; negative where energy is lost, 0 without an impulse */
} ContactEvent;

/* a level of a state, at whose crossings a run pauses */
typedef struct {
    int watched;
    int state;       /* index */
    double level;
    int direction;   /* 1 upward, -1 downward, 0 both */
    int side;        /* of the level on which the state was last seen; 0 not yet known */
    double searched; /* variable of the series up to which the step in use has been searched */
} Section;

typedef struct {
    Tolerances tolerances;
    Point at;                                           /* where the run is */
    double horizon;                                     /* no step reaches beyond: the next knot of an input, or infinity */
    /* the Taylor step in use: valid on [start, start + length] */
    int segment_valid, segment_order;
    int segment_event;                                  /* an event waits at its end */
    signed char falling[MODEL_ROOM(MODEL_NC)][SLOTS];   /* the indicators it belongs to */
    /* what the last event did to a contact: entered with a speed to remember, jumped, brought to zero slip */
    signed char entered[MODEL_ROOM(MODEL_NC)], jumped[MODEL_ROOM(MODEL_NC)], projected[MODEL_ROOM(MODEL_NC)];
    /* the impact that it made: phases, none if there was no impact; contacts that arrived at their wall; work of the impulses */
    int impact_phases;
    ImpactPhase impact[2];
    signed char struck[MODEL_ROOM(MODEL_NC)];
    double impact_work;
    double nominal_gap[MODEL_ROOM(MODEL_NC)];           /* Model Exchange only: of rigid contacts, from nominal coordinates */
    double leeway[MODEL_ROOM(MODEL_NC)];                /* Model Exchange only: added to the indicator of a gap that opens slowly */
    int segment_rooted;                                 /* its series run in the square root of time */
    double segment_start, segment_length;
    Section section;
    Jets jets;                                          /* of the step */
    Jets scratch;                                       /* of evaluations at one instant */
    long steps, events, evaluations;                    /* evaluations: orders of the series computed, plus single evaluations */
    int stalled;                                        /* events since time last moved */
    int starting;                                       /* the start values are being looked at: they must not be off, by however little */
    int crowded;                                        /* events since crowd_start */
    double crowd_start, last_event, longest_pause;      /* times; the longest time without event */
    double goal;                                        /* the time that the caller wants to reach, perhaps by many calls; -infinity if it is not sure to */
    long pause_at;                                      /* steps at which run_advance returns for a while; 0 never */
    double lap_start;                                   /* where the present lap began, with how many steps and events */
    long lap_steps, lap_events;
    char message[256];                                  /* reason of the last RUN_ERROR */
} Run;

extern const Tolerances run_default_tolerances;

/* everything back to start values */
void run_reset(Run *r);
/* after any write to p, u, du, x or time: forget the step in use (p: derive the constants anew) */
void run_parameters_changed(Run *r);
void run_touched(Run *r);

/* choose the contact states for the state x at r->time from scratch; RUN_ERROR with message if p or x is unusable */
RunStatus run_initialize(Run *r);
/* inputs may have jumped: choose again for contacts at zero slip or with a violated stick; changed (may be NULL): x moved */
RunStatus run_reconsider(Run *r, int *changed);

/*
 * Move to time t with events handled inside. With stop_at_event, return RUN_EVENT right after the first change of a
 * contact state; r->time says where. sink (may be NULL) gets every change of contact state. With a section watched, return
 * RUN_CROSSING at each of its crossings; with pause_at set, RUN_PAUSED once so many steps are made, to be called again.
 */
typedef void (*EventSink)(void *context, const ContactEvent *event);
RunStatus run_advance(Run *r, double t, int stop_at_event, EventSink sink, void *context);
/* pause at the crossings of a level from now on; one at this very instant is none */
void section_watch(Run *r, int state, double level, int direction);

/* Model Exchange face, at (r->time, r->u, r->x) in the present contact states */
RunStatus run_derivatives(Run *r, double *dx);              /* MODEL_NX */
RunStatus run_indicators(Run *r, double *z);                /* MODEL_NI */
/* resolve the event an importer has located; changed: continuous states were moved */
RunStatus run_event(Run *r, int *changed);

/* outputs and their directional derivatives along (xdot, udot); any result pointer may be NULL */
RunStatus run_outputs(Run *r, double *y);                   /* MODEL_NY */
RunStatus run_directional(Run *r, const double *xdot, const double *udot, double *dxdot, double *ydot);

#endif
