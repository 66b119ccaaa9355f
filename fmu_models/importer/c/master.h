/*
 * The contract between the master and Python: what a loaded FMU looks like, what a run is asked for, what it reports.
 * Only numbers and pointers of fixed size, for Python reads these structures here.
 */
#pragma once

#include <stdint.h>

#define EXPORT __attribute__((visibility("default")))

/* functions of an FMU; Python lists their names in this order */
typedef enum {
    F_RESET,
    F_SETUP,
    F_ENTER_INITIALIZATION,
    F_EXIT_INITIALIZATION,
    F_ENTER_EVENT,
    F_UPDATE,
    F_ENTER_CONTINUOUS,
    F_ENTER_STEP,
    F_COMPLETED,
    F_SET_TIME,
    F_SET_STATES,
    F_GET_STATES,
    F_GET_DERIVATIVES,
    F_GET_INDICATORS,
    F_NOMINALS,
    F_DIRECTIONAL,
    F_DO_STEP,
    F_SET_CLOCK,
    F_GET_CLOCK,
    F_GET_INTERVAL,
    F_GET_SHIFT,
    F_ACTIVATE,
    F_TERMINATE,
    F_BOOLEAN_STATUS,
    F_REAL_STATUS,
    F_ENTER_CONFIGURATION,
    F_EXIT_CONFIGURATION,
    F_GETTERS,
    F_SETTERS = F_GETTERS + 11,
    F_COUNT = F_SETTERS + 11
} Function;

/* types of variables: the getter of a type is F_GETTERS + type. FMI 2 has the first three */
typedef enum {
    T_FLOAT64,
    T_INT32,
    T_BOOLEAN,
    T_FLOAT32,
    T_INT8,
    T_UINT8,
    T_INT16,
    T_UINT16,
    T_UINT32,
    T_INT64,
    T_UINT64
} Type;

/* what the FMU said last, and who runs it; handed to it as its environment */
typedef struct {
    int64_t count, warnings;
    char message[1024], warning[1024]; /* the last one of any kind, the first warning */
    void *master;                      /* NULL: nobody who looks inside its steps */
} Log;

/* variables to read or write, one entry a value: an array (FMI 3) has as many entries as elements, in its order */
typedef struct {
    int64_t n;
    const int32_t *types; /* Type */
    const uint32_t *references;
    const int32_t *sizes; /* elements of the variable that begins here, 0 within an array; NULL: no arrays */
} Variables;

/* an instance of an FMU */
typedef struct {
    int64_t fmi; /* 2 or 3 */
    int64_t n_states, n_indicators;
    int64_t completes;   /* wants completedIntegratorStep */
    int64_t directional; /* offers directional derivatives */
    int64_t event_mode;  /* Co-Simulation with event mode */
    int64_t resets;      /* reset before a run; the first run of an instance needs none */
    Log *log;
    int64_t n_state_references; /* fewer than states where a state is an array */
    const uint32_t *state_references, *derivative_references;
    /* rates that the FMU declares to depend on each state: (n_states + 1) where those of a state begin, their numbers;
       NULL: it does not say */
    const int64_t *dependency_start;
    const int32_t *dependency_rows;
    Variables structure; /* structural parameters to set in configuration mode */
    const double *structure_values;
    void *instance;
    void *function[F_COUNT];
} FmuInstance;

/* how a clock of FMI 3 ticks: in equal intervals, after an interval that the FMU tells at each tick or some time later,
   when the user asks, when the FMU does */
typedef enum { CLOCK_PERIODIC, CLOCK_CHANGING, CLOCK_COUNTDOWN, CLOCK_ASKED, CLOCK_OUTPUT } ClockKind;

typedef struct {
    uint32_t reference;
    int32_t kind;           /* ClockKind */
    int32_t asks;           /* the FMU tells the interval, and of a periodic clock the shift */
    int32_t priority;       /* of what ticks at the same time in scheduled execution; the lowest is the first */
    double interval, shift; /* s, of a periodic clock */
    int64_t n_times;
    const double *times; /* (n_times), s, ascending: of one that ticks when the user asks */
    /* progress: of a run */
    double next;          /* time of the next tick, infinity where it is not known */
    int64_t ticks, later; /* so far; its place in times, or in the periods since the first tick */
} MasterClock;

typedef struct {
    double time;
    int64_t clock;
} MasterTick;

/* a variable that is read when its clocks tick, and keeps its value until then */
typedef struct {
    int64_t clocks; /* one bit each, and the next one where its first value comes from initialization */
    double value;
} Kept;

/* clocks of an FMU, at most: one bit each */
typedef enum { MOST_CLOCKS = 62 } MostClocks;

/* what is known of the entries of the Jacobian that are not zero: no Jacobian yet, all are taken for such, the FMU
   declares them, they were found column by column */
typedef enum { PATTERN_NONE, PATTERN_FULL, PATTERN_DECLARED, PATTERN_FOUND } PatternKind;

typedef enum {
    METHOD_AUTO,
    METHOD_DOPRI5,
    METHOD_DOP853,
    METHOD_STIFF,
    METHOD_CO_SIMULATION,
    METHOD_SCHEDULED
} MethodChoice;

typedef enum {
    EVENT_STATE,
    EVENT_TIME,
    EVENT_STEP,
    EVENT_INPUT,
    EVENT_SLIDE,
    EVENT_LEAVE,
    EVENT_END,
    EVENT_REST
} EventKind;

/* where events accumulate: end the run, keep the states as they are there, or go on as the FMU does */
typedef enum { ZENO_STOP, ZENO_HOLD, ZENO_CONTINUE } ZenoChoice;

typedef struct {
    double time;
    int32_t kind;         /* EventKind */
    int32_t indicator;    /* -1: not of an indicator */
    double before, after; /* of the indicator: at the start of the step, after the event */
} MasterEvent;

/* DONE and MORE are progress, the rest is the reason why the run ended early */
typedef enum {
    RUN_DONE,
    RUN_MORE,
    RUN_TERMINATED,
    RUN_FMI_ERROR,
    RUN_NOT_FINITE,
    RUN_STEP_TOO_SMALL,
    RUN_EVENT_ITERATION,
    RUN_CHATTERING,
    RUN_CHATTERING_OF_TWO,
    RUN_CHATTERING_OF_MANY,
    RUN_ZENO,
    RUN_EVENTS_PILE_UP,
    RUN_STALLS,
    RUN_DISCARD,
    RUN_BAD_INDICATOR,
    RUN_TOO_MANY_STEPS,
    RUN_RATES_DIFFER,
    RUN_BAD_CLOCK,
    RUN_BAD_EVENT_TIME,
    RUN_TOO_LARGE,
    RUN_CROSSED /* the section: done too */
} RunStatus;

typedef struct {
    double start, stop;              /* s */
    double tolerance;                /* relative; absolute: times the nominal value of the state */
    double first_step, longest_step; /* s; 0: chosen; in Co-Simulation longest_step is the communication step */
    int64_t method;                  /* MethodChoice */
    Variables starts;
    const double *start_values;
    Variables recorded;
    const int32_t *recorded_rates; /* (recorded.n): number of the state whose derivative it is, or -1 */
    int64_t n_times;
    const double *times;
    double *states, *values; /* (n_times, n_states), (n_times, recorded.n) */
    Variables inputs;
    int64_t n_knots;
    const double *knot_times, *knot_values, *knot_rates; /* (n_knots), (n_knots, inputs.n) twice */
    const int64_t *knot_jumps;                           /* the values jump at this knot: an event */
    /* of a co-simulation, whose knots are its communication points: the inputs between them */
    int64_t n_shown;
    const double *shown_times, *shown_values, *shown_rates; /* (n_shown), (n_shown, inputs.n) twice */
    const int32_t *shown_inputs;                            /* (inputs.n): may be set inside a step of Co-Simulation */
    int64_t n_clocks;
    MasterClock *clocks;
    Variables clocked;      /* recorded variables that have clocks */
    Kept *kept;             /* (clocked.n) */
    double *clocked_values; /* (n_times, clocked.n) */
    int64_t tick_capacity;
    MasterTick *ticks;
    int64_t event_capacity;
    MasterEvent *events;
    double *event_states; /* (event_capacity, 2, n_states): before and after */
    int64_t on_zeno;      /* ZenoChoice */
    int64_t allowance;    /* steps after which to return RUN_MORE */
    /* a section, where the run ends: a state crosses a level */
    int64_t section_state; /* its number from 1; 0: none */
    double section_level;
    int64_t section_direction; /* 1 upward, -1 downward, 0 both */
    /* tangents and what else is seen at the ends; NULL: not wanted */
    double *ends;            /* (4, n_states): states and rates at the start, and where the run ends */
    double *tangents;        /* (n_states, n_states): derivatives of the states there by those at the start, by rows */
    double *tangent_room;    /* 20 n_states^2 + 4 n_states */
    int32_t *tangent_pivots; /* 4 n_states */
    int64_t missed;          /* parts of the way of which the tangents know nothing */
    double *slopes;          /* (n_states, n_states): derivatives of the rates by the states at the start, by rows */
    double *indicators;      /* (n_indicators): where the run ends */
    double *misses; /* (n_indicators, 2): least value on the side that holds, of those with a minimum between events,
                       and its time; infinite where there is none */
    /* progress, kept over RUN_MORE; next_time counts the rows written */
    int64_t begun, next_time, n_events, n_ticks;
    int64_t looks; /* inside the steps of a co-simulation */
    int64_t steps, rejected, evaluations, jacobians, slides;
    int64_t pattern, colours, undeclared; /* of the Jacobian: PatternKind, evaluations, entries beyond the declared */
    int64_t most_surfaces, by_convention; /* slid along at once; such motions whose mean is a convention */
    int64_t n_switches;                   /* of the method, by auto */
    double switch_time;                   /* of the first one */
    int64_t accumulations;                /* at which the run did not end */
    double accumulation_time;             /* of the first one */
    int64_t unresolved;                   /* steps on which an indicator changes faster than it can be followed */
    double unresolved_time;               /* of the first one */
    int64_t unresolved_indicator;
    /* report of an early end */
    double report_time, report_value, report_reached; /* how far a step came that was discarded */
    int64_t report_index;                             /* indicator, state, or Function that returned an error */
    int64_t report_other;                             /* second indicator; the state that does not rest, or -1 */
    double *report_gradient; /* (n_states): how the indicator depends on the states, scaled by their nominals */
} Run;
