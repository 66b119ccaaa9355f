/*
 * One small FMU for Model Exchange, FMI 1, 2 or 3 as -DFMI says. The C file that includes this defines before
 *
 *     NX, NZ, NP         numbers of states, indicators, parameters (NP may be 0)
 *     PARAMETERS         start values of the parameters, STARTS those of the states
 *     RESTLESS           (if need be) the discrete states want another update
 *     FAILS              (if need be) the derivatives cannot be computed: an error with a message
 *     FAILED_STATUS      (if need be) its status then, other than an error
 *     NO_RESET           (if need be) it has no reset
 *     CO_SIMULATION      (if need be) do_step, which moves the model towards the time end
 *     SAVES              (if need be, FMI 2) it gives and takes its state
 *     REFUSES(m, end)    (if need be, FMI 2) whether it discards a step to the time end
 *     SIZE(v)            (if need be, FMI 3) elements of the array v, which takes as many value references
 *     READABLE(m, v)     (if need be) whether a value may be asked for now, UNREADABLE the status if not
 *     INDICATED(m)       (if need be) whether there are indicators now; if not, they are discarded
 *     DISCARDS(m)        (if need be) whether the step of a Co-Simulation that was just made is discarded
 *     CLOCKS             (if need be, FMI 3) number of clocks, whose functions are in the C file
 *     RATES              (if need be) value reference of the first derivative, where there are more than 50
 *     REFUSES_EVENTS     (if need be) no event mode, whatever the description says: an error with a message
 *     TEXTS              (if need be) texts, whose functions are in the C file
 *     LAZY               (if need be) computes when it is asked for its rates and at events; rates as variables and
 *                        indicators are those of that point until then
 *     HASTY              (if need be) computes variables when one is read after a new time or new states, unless it was
 *                        asked for its rates in between: then they are what they were before
 *     and the functions declared below
 *
 * Value references: 0 time, 1.. states, 101.. derivatives, 151.. the same as outputs, 201.. parameters, 301.. indicators
 * (FMI 3), 401.. whole numbers.
 */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#if FMI == 1
#include "fmi1Functions.h"
#define BOOLEAN int
#define STATUS fmi1Status
#define NAME(suffix) plain_##suffix
#define REFERENCE fmi1ValueReference
#elif FMI == 2
#include "fmi2Functions.h"
#define BOOLEAN int
#define STATUS fmi2Status
#define NAME(suffix) fmi2##suffix
#define REFERENCE fmi2ValueReference
#else
#define FMI3_OVERRIDE_FUNCTION_PREFIX
#include "fmi3Functions.h"
#define BOOLEAN fmi3Boolean
#define STATUS fmi3Status
#define NAME(suffix) fmi3##suffix
#define REFERENCE fmi3ValueReference
#endif

#ifndef RESTLESS
#define RESTLESS 0
#endif
#ifndef FAILS
#define FAILS 0
#endif

#ifndef SAVES
#define SAVES 0
#endif
#ifndef REFUSES
#define REFUSES(m, end) 0
#endif

#ifndef FAILED_STATUS
#define FAILED_STATUS 3
#endif

#ifndef READABLE
#define READABLE(m, v) 1
#endif
#ifndef UNREADABLE
#define UNREADABLE FAILED
#endif
#ifndef INDICATED
#define INDICATED(m) 1
#endif
#ifndef DISCARDS
#define DISCARDS(m) 0
#endif

#ifndef SIZE
#define SIZE(v) 1
#endif
#ifndef RATES
#define RATES 101
#endif

enum { OK = 0, FAILED = 3, ROOM = 8 };

typedef struct {
    double t, x[NX + 1], p[NP + 1];
    int mode[ROOM];                /* whole numbers of the model, to be read as well */
    double next_time;              /* of the next time event; infinity: none */
    int wants_event, terminates;   /* set by after_step or update */
    double seen_t, seen_x[NX + 1]; /* where it computed */
    int stale;                     /* it was moved since */
#ifdef CLOCKS
    int active[CLOCKS], initializes;
    double interval[CLOCKS];
    int qualifier[CLOCKS];
    void (*told)(void *environment);
#endif
#if FMI == 1
    fmi1CallbackFunctions callbacks;
    int initialized;
#elif FMI == 2
    const fmi2CallbackFunctions *callbacks;
#else
    fmi3LogMessageCallback log;
    void *environment;
#endif
} Model;

static void derivatives(Model *m, double *dx);
static void indicators(Model *m, double *z);
/* event mode: may change x, mode and next_time; 1 if x was changed */
static int update(Model *m);
/* what completedIntegratorStep does */
static void after_step(Model *m);

#ifdef CLOCKS
/* at the begin of initialization */
static void begin(Model *m);
#endif

#ifdef TEXTS
/* back to its start values */
static void forget(void);
#endif

#ifdef CO_SIMULATION
/* to end, or to an earlier event: 1 */
static int do_step(Model *m, double end);
#endif

static void compute(Model *m)
{
    m->seen_t = m->t;
    memcpy(m->seen_x, m->x, sizeof m->x);
}

/* asked for its rates */
static void rated(Model *m)
{
#ifndef HASTY
    compute(m);
#endif
    m->stale = 0;
}

static void put_back(Model *m)
{
    static const double parameters[] = {PARAMETERS, 0.0}, starts[] = {STARTS, 0.0};
    m->t = 0.0;
    memcpy(m->p, parameters, sizeof m->p);
    memcpy(m->x, starts, sizeof m->x);
    memset(m->mode, 0, sizeof m->mode);
    m->next_time = INFINITY;
    m->wants_event = m->terminates = 0;
    compute(m);
#ifdef CLOCKS
    memset(m->active, 0, sizeof m->active);
    memset(m->qualifier, 0, sizeof m->qualifier);
    m->initializes = 1;
#endif
#ifdef TEXTS
    forget();
#endif
}

/* the model where it computed */
static Model computed(const Model *m)
{
    Model seen = *m;
#if defined LAZY || defined HASTY
    seen.t = m->seen_t;
    memcpy(seen.x, m->seen_x, sizeof m->x);
#endif
    return seen;
}

static STATUS get_one(Model *m, unsigned v, double *value)
{
    double many[NX + NZ + 1];
    Model seen = computed(m);
    if (!READABLE(m, v)) return UNREADABLE;
    if (v == 0) {
        *value = m->t;
    } else if (v <= NX) {
        *value = m->x[v - 1];
    } else if ((v >= RATES && v < RATES + NX) || (v > 150 && v <= 150 + NX)) {
        derivatives(&seen, many);
        *value = many[v >= RATES && v < RATES + NX ? v - RATES : v - 151];
    } else if (v > 200 && v <= 200 + NP) {
        *value = m->p[v - 201];
    } else if (v > 300 && v <= 300 + NZ) {
        indicators(&seen, many);
        *value = many[v - 301];
    } else {
        return FAILED;
    }
    return OK;
}

static STATUS set_one(Model *m, unsigned v, double value)
{
    if (v >= 1 && v <= NX)
        m->x[v - 1] = value;
    else if (v > 200 && v <= 200 + NP)
        m->p[v - 201] = value;
    else
        return FAILED;
    return OK;
}

static STATUS complain(Model *m)
{
#if FMI == 1
    m->callbacks.logger(m, "model", FAILED_STATUS, "logStatusError", "%s beyond t = %g", "no rates", 1.0);
#elif FMI == 2
    m->callbacks->logger(m->callbacks->componentEnvironment, "model", FAILED_STATUS, "logStatusError",
                         "%s beyond t = %g", "no rates", 1.0);
#else
    m->log(m->environment, FAILED_STATUS, "logStatusError", "no rates beyond t = 1");
#endif
    return FAILED_STATUS;
}

static STATUS get_many(Model *m, const REFERENCE *v, size_t n, double *values)
{
    STATUS status = OK;
#ifdef HASTY
    if (m->stale) compute(m);
    m->stale = 0;
#endif
    for (size_t i = 0; i < n && status == OK; i++)
        for (unsigned k = 0; k < SIZE(v[i]) && status == OK; k++)
            status = get_one(m, v[i] + k, values++);
    return status;
}

static STATUS set_many(Model *m, const REFERENCE *v, size_t n, const double *values)
{
    STATUS status = OK;
    for (size_t i = 0; i < n && status == OK; i++)
        for (unsigned k = 0; k < SIZE(v[i]) && status == OK; k++)
            status = set_one(m, v[i] + k, *values++);
    return status;
}

#define PLAIN(Function)                                                                                                \
    STATUS NAME(Function)(void *c)                                                                                     \
    {                                                                                                                  \
        (void)c;                                                                                                       \
        return OK;                                                                                                     \
    }
PLAIN(EnterEventMode)
PLAIN(EnterContinuousTimeMode)
PLAIN(ExitInitializationMode)
PLAIN(Terminate)
#ifndef NO_RESET
STATUS NAME(Reset)(void *c)
{
    put_back(c);
    return OK;
}
#endif
void NAME(FreeInstance)(void *c) { free(c); }

STATUS NAME(SetTime)(void *c, double t)
{
    ((Model *)c)->t = t;
    ((Model *)c)->stale = 1;
    return OK;
}
STATUS NAME(SetContinuousStates)(void *c, const double *x, size_t n)
{
    memcpy(((Model *)c)->x, x, n * sizeof *x);
    ((Model *)c)->stale = 1;
    return OK;
}
STATUS NAME(GetContinuousStates)(void *c, double *x, size_t n)
{
    memcpy(x, ((Model *)c)->x, n * sizeof *x);
    return OK;
}
STATUS NAME(GetEventIndicators)(void *c, double *z, size_t n)
{
#ifdef HASTY
    compute(c);
#endif
    Model seen = computed(c);
    (void)n;
    indicators(&seen, z);
    return INDICATED(&seen) ? OK : (STATUS)2;
}
STATUS NAME(GetNominalsOfContinuousStates)(void *c, double *x, size_t n)
{
#ifdef NOMINALS
    static const double nominals[] = {NOMINALS};
    (void)c;
    memcpy(x, nominals, n * sizeof *x);
#else
    (void)c;
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
#endif
    return OK;
}
STATUS NAME(CompletedIntegratorStep)(void *c, BOOLEAN no_set, BOOLEAN *event, BOOLEAN *terminate)
{
    Model *m = c;
    (void)no_set;
    m->wants_event = 0;
    after_step(m);
    *event = m->wants_event;
    *terminate = m->terminates;
    return OK;
}

#ifdef JACOBIAN
/* dx = df/dx seed */
static void jacobian(Model *m, const double *seed, double *dx);
#endif

#if FMI == 1
#include "model_fmi1.h"
#elif FMI == 2
#include "model_fmi2.h"
#else
#include "model_fmi3.h"
#endif
