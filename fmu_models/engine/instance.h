/*
 * What the FMI 2, FMI 3 and native faces share: an instance, its life, its variables and its frozen states.
 *
 * Life (FMI 2 names in brackets where they differ):
 *     INSTANTIATED -> INITIALIZATION -> Model Exchange: EVENT <-> CONTINUOUS
 *                                       Co-Simulation:  STEP (<-> EVENT, FMI 3 with event mode)
 *     any of the last three -> TERMINATED; an error of the engine -> FAILED, which only reset, free and a frozen state leave.
 * A call that is not allowed, or whose arguments make no sense, is refused with a logged reason and without any effect.
 */
#ifndef STICKSLIP_INSTANCE_H
#define STICKSLIP_INSTANCE_H

#include <stddef.h>
#include <stdint.h>

#include "run.h"

typedef enum {
    PHASE_INSTANTIATED = 1,
    PHASE_INITIALIZATION = 2,
    PHASE_EVENT = 4,
    PHASE_CONTINUOUS = 8,
    PHASE_STEP = 16,
    PHASE_TERMINATED = 32,
    PHASE_FAILED = 64
} Phase;

enum {
    PHASES_RUNNING = PHASE_EVENT | PHASE_CONTINUOUS | PHASE_STEP,
    PHASES_READABLE = PHASE_INITIALIZATION | PHASES_RUNNING | PHASE_TERMINATED | PHASE_FAILED,
    PHASES_ALL = PHASE_INSTANTIATED | PHASES_READABLE
};

/* the numbers FMI 2 and FMI 3 give them both */
typedef enum { STATUS_OK = 0, STATUS_WARNING = 1, STATUS_DISCARD = 2, STATUS_ERROR = 3 } Status;

/* what a value reference means; they are consecutive, in this order (fmu_models/codegen/model_description.py) */
typedef enum { TIME, PARAMETER, INPUT, RATE, STATE, MEMORY, DERIVATIVE, OUTPUT, CONTACT, INDICATOR, UNKNOWN } Kind;

/* all that a frozen state holds */
typedef struct {
    Run run;
    int co_simulation;
    int phase;         /* Phase */
    int settled;       /* the contact states fit the values written */
    int event_pending; /* Model Exchange: the importer located an event that is not resolved yet */
    int event_moved;   /* states moved by an event that was resolved before values were set */
    int stop_defined;
    double start_time, stop_time;
} Core;

typedef struct Frozen {
    Core core;
    struct Frozen *next;
} Frozen;

typedef struct Instance Instance;
typedef void (*Say)(Instance *instance, Status status, const char *category, const char *message);

struct Instance {
    Core core;
    int event_mode_used, early_return_allowed; /* FMI 3 Co-Simulation */
    int logging;               /* log debug messages */
    int quiet;                 /* without logging be silent about errors as well (FMI 3) */
    Say say;
    void (*logger)(void);      /* the importer's callback, cast back by say */
    void *environment;
    Frozen *frozen;            /* states handed out and not yet freed */
    char name[128];
};

/* a step of an importer may miss the present time by this fraction of its length: importers add up floating-point steps */
#define INSTANCE_TIME_SLACK 1e-6

/* a result of the engine for the present values, computed when first asked for */
typedef struct {
    int has_derivatives, has_outputs, has_indicators;
    double derivatives[MODEL_ROOM(MODEL_NX)];
    double outputs[MODEL_ROOM(MODEL_NY)];
    double indicators[MODEL_ROOM(MODEL_NI)];
} Evaluation;

/* NULL without memory or with a token of another model; token errors are said through the instance's logger */
Instance *instance_new(const char *name, const char *token, int co_simulation, Say say, void (*logger)(void),
                       void *environment, int logging, int quiet);
void instance_free(Instance *m);

/* log an error with printf-like arguments and return STATUS_ERROR */
Status instance_refuse(Instance *m, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
/* STATUS_OK if m lives and its phase is one of the phases, else an error that says what is allowed */
Status instance_enter(Instance *m, int phases, const char *function);
/* STATUS_OK unless an array of n entries is missing */
Status instance_array(Instance *m, const void *array, size_t n, const char *function, const char *what);
/* STATUS_OK if n_values values come with n references */
Status instance_same(Instance *m, const char *function, size_t n, size_t n_values);
/* STATUS_OK if every one of the categories is one of ours */
Status instance_categories(Instance *m, size_t n, const char *const categories[], const char *function);

Status instance_set_up(Instance *m, const char *function, int tolerance_defined, double tolerance, double start_time,
                       int stop_defined, double stop_time);
Status instance_exit_initialization(Instance *m, const char *function);
Status instance_reset(Instance *m);
/* make the contact states fit values written since they were chosen; changed (may be NULL): states were moved */
Status instance_settle(Instance *m, const char *function, int *changed);
/* one Co-Simulation step; *event is set when it ended early at a change of contact state */
Status instance_step(Instance *m, const char *function, double time, double step, int stop_at_event, int *event);
/* resolve the event that the importer has located (Model Exchange), if there is one */
Status instance_resolve(Instance *m, const char *function);
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

Status instance_get(Instance *m, const char *function, const uint32_t *vr, size_t n, double *value);
Status instance_set(Instance *m, const char *function, const uint32_t *vr, size_t n, const double *value);
Status instance_get_contacts(Instance *m, const char *function, const uint32_t *vr, size_t n, int32_t *value);
/* reference of the rate of an input, 0 for the reference of anything else */
uint32_t instance_rate_of(uint32_t vr);
/* what a value reference means, and the index among its kind */
Kind instance_locate(uint32_t vr, int *index);
/* whether it is the reference of an input or of the rate of one */
int instance_is_input(uint32_t vr);
/* refuse any reference: the model has no variables of that type (or none that can be set) */
Status instance_no_variable(Instance *m, const char *function, size_t n, const char *type);
/* the value of one variable of any type; 0 if there is none. Needs a settled instance that is past its initialization */
int instance_value(Instance *m, uint32_t vr, Evaluation *e, double *value);

Status instance_directional(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                            const uint32_t *known, size_t n_known, const double *seed, double *sensitivity);

Status instance_freeze(Instance *m, const char *function, void **state);
Status instance_thaw(Instance *m, const char *function, void *state);
Status instance_discard(Instance *m, const char *function, void **state);
Status instance_serialized_size(Instance *m, const char *function, void *state, size_t *size);
Status instance_serialize(Instance *m, const char *function, void *state, unsigned char *bytes, size_t size);
Status instance_deserialize(Instance *m, const char *function, const unsigned char *bytes, size_t size, void **state);

#endif
