/*
 * What FMI 2, FMI 3 and whole runs share: an instance and its life.
 *
 * Life (FMI 2 names in brackets where they differ):
 *     INSTANTIATED -> INITIALIZATION -> Model Exchange: EVENT <-> CONTINUOUS
 *                                       Co-Simulation:  STEP (<-> EVENT, FMI 3 with event mode)
 *     STEP <-> INTERMEDIATE inside a step of FMI 3, while the importer looks at it
 *     EVENT, CONTINUOUS, STEP -> TERMINATED; an error of the engine -> FAILED, which only reset, free and an FMU state
 *     leave.
 * A call that is not allowed, or whose arguments make no sense, is refused with a logged reason and without any effect.
 */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "../model/run_state.h"

typedef enum {
    PHASE_INSTANTIATED = 1,
    PHASE_INITIALIZATION = 2,
    PHASE_EVENT = 4,
    PHASE_CONTINUOUS = 8,
    PHASE_STEP = 16,
    PHASE_TERMINATED = 32,
    PHASE_FAILED = 64,
    PHASE_INTERMEDIATE = 128
} Phase;

enum {
    PHASES_RUNNING = PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP,
    PHASES_SETTABLE = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASES_RUNNING | PHASE_TERMINATED | PHASE_FAILED,
    PHASES_ALL = PHASES_SETTABLE | PHASE_INTERMEDIATE,
    PHASES_READABLE = PHASES_ALL & ~PHASE_INSTANTIATED
};

/* the numbers FMI 2 and FMI 3 give them both */
typedef enum { STATUS_OK = 0, STATUS_WARNING = 1, STATUS_DISCARD = 2, STATUS_ERROR = 3 } Status;

/* what messages are about; their names are in fmu_models/codegen/model_description.py too, with what they mean */
typedef enum { LOG_ERROR = 1, LOG_WARNING = 2, LOG_EVENT = 4, LOG_ALL = 7 } LogCategory;

/* all that an FMU state holds, up to what the run keeps of its modes */
typedef struct {
    int co_simulation;
    int phase;         /* Phase */
    int settled;       /* the contact states fit the values written */
    int event_pending; /* Model Exchange: the importer located an event that is not resolved yet */
    int event_moved;   /* states or contacts changed by an event that was resolved before values were set */
    unsigned char ticks[MODEL_ROOM(MODEL_NC)]; /* of the clocks of a contact, active until they are read (Tick) */
    int stop_defined;
    long iterations; /* of a map: steps made since first_step, s, at this period, s */
    double first_step, period;
    double start_time, stop_time;
    Run run; /* the last: its end is no part of a state */
} Core;

typedef struct FmuState {
    Core core;
    struct FmuState *next;
} FmuState;

typedef struct Instance Instance;
typedef void (*Say)(Instance *instance, Status status, const char *category, const char *message);
/* let the importer look inside a step at a time, or ask it for inputs there; 1 where it asks to return, and until when */
typedef int (*Show)(Instance *instance, double time, int asks, int can_return, double *until);

struct Instance {
    Core core;
    int event_mode_used, early_return_allowed; /* FMI 3 Co-Simulation */
    int categories;                            /* of messages that are wanted: LogCategory */
    int quiet;                                 /* unless they are wanted be silent about errors as well (FMI 3) */
    Say say;
    void (*logger)(void); /* the importer's callback, cast back by say */
    Show show;
    void (*intermediate)(void);         /* the same, cast back by show; NULL: it does not look */
    int takes_inputs;                   /* inside a step, which the importer has said that it gives */
    int asking;                         /* for them */
    double asked[MODEL_ROOM(MODEL_NU)]; /* what it has given; nan: nothing */
    int input_order;                    /* up to which derivatives of the inputs are known to the FMU */
    void *environment;
    FmuState *fmu_states; /* states handed out and not yet freed */
    void *derivatives;    /* room for directional ones, made when they are first asked for */
    char name[128];
};

/* a step of an importer may miss the present time by this fraction of its length: importers add up floating-point
   steps */
#define INSTANCE_TIME_SLACK 1e-6

/* NULL if there is no room for it, or with a token of another model; token errors are said through the instance's
   logger */
Instance *instance_new(const char *name, const char *token, int co_simulation, Say say, void (*logger)(void),
                       void *environment, int logging, int quiet);
void instance_free(Instance *m);

/* log an error with printf-like arguments and return STATUS_ERROR */
Status instance_refuse(Instance *m, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* refuse whatever capability flags in modelDescription.xml say that it is not provided; m may be NULL */
Status instance_not_provided(Instance *m, const char *function, const char *reason);
/* an error of the engine ends the run: its state can no longer be trusted */
Status instance_failed(Instance *m, const char *function);
/* an EventSink: ticks clocks, and tells of the event where that is wanted */
void instance_note(void *instance, const ContactEvent *event);
/* STATUS_OK if m lives and its phase is one of the phases, else an error that says what is allowed */
Status instance_enter(Instance *m, int phases, const char *function);
/* STATUS_OK unless an array of n entries is missing */
Status instance_array(Instance *m, const void *array, size_t n, const char *function, const char *what);
/* STATUS_OK if n_values values come with n references */
Status instance_same(Instance *m, const char *function, size_t n, size_t n_values);
/* log messages of these categories only: of all without any, and of none where it is off; an error if one is not ours */
Status instance_log(Instance *m, const char *function, int on, size_t n, const char *const categories[]);

Status instance_set_up(Instance *m, const char *function, int tolerance_defined, double tolerance, double start_time,
                       int stop_defined, double stop_time);
Status instance_exit_initialization(Instance *m, const char *function);
Status instance_reset(Instance *m);
/* make the contact states fit values written since they were chosen; changed (may be NULL): states were moved */
Status instance_settle(Instance *m, const char *function, int *changed);
/* resolve the event that the importer has located (Model Exchange), if there is one */
Status instance_resolve(Instance *m, const char *function);
/* the same in event mode, and make the contact states fit values set there */
Status instance_evaluate(Instance *m, const char *function);
/* leave an event located by the importer (Model Exchange) or announced to it (Co-Simulation) */
Status instance_update(Instance *m, const char *function, int *changed);

Status instance_enter_event(Instance *m, const char *function);

/* Model Exchange: time, states and what follows from them */
Status instance_set_time(Instance *m, const char *function, double time);
Status instance_set_states(Instance *m, const char *function, const double *x, size_t n);
Status instance_states(Instance *m, const char *function, double *x, size_t n);
Status instance_nominals(Instance *m, const char *function, double *x, size_t n);
Status instance_derivatives(Instance *m, const char *function, double *dx, size_t n);
Status instance_indicators(Instance *m, const char *function, double *z, size_t n);
