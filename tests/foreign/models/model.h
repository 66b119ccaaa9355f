/*
 * One small FMU for Model Exchange, FMI 2 or FMI 3 as -DFMI says. The C file that includes this defines before
 *
 *     NX, NZ, NP         numbers of states, indicators, parameters (NP may be 0)
 *     PARAMETERS         start values of the parameters, STARTS those of the states
 *     RESTLESS           (if need be) the discrete states want another update
 *     FAILS              (if need be) the derivatives cannot be computed: an error with a message
 *     CO_SIMULATION      (if need be) do_step, which moves the model towards the time end
 *     SIZE(v)            (if need be, FMI 3) elements of the array v, which takes as many value references
 *     READABLE(m, v)     (if need be, FMI 3) whether a value may be asked for now
 *     CLOCKS             (if need be, FMI 3) number of clocks, whose functions are in the C file
 *     REFUSES_EVENTS     (if need be) no event mode, whatever the description says: an error with a message
 *     TEXTS              (if need be) texts, whose functions are in the C file
 *     and the functions declared below
 *
 * Value references: 0 time, 1.. states, 101.. derivatives, 201.. parameters, 301.. indicators (FMI 3), 401.. whole
 * numbers.
 */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#if FMI == 2
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

#ifndef READABLE
#define READABLE(m, v) 1
#endif

#ifndef SIZE
#define SIZE(v) 1
#endif

enum { OK = 0, FAILED = 3, ROOM = 8 };

typedef struct {
    double t, x[NX + 1], p[NP + 1];
    int mode[ROOM];              /* whole numbers of the model, to be read as well */
    double next_time;            /* of the next time event; infinity: none */
    int wants_event, terminates; /* set by after_step or update */
#ifdef CLOCKS
    int active[CLOCKS], initializes;
    double interval[CLOCKS];
    int qualifier[CLOCKS];
    void (*told)(void *environment);
#endif
#if FMI == 2
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

static void put_back(Model *m)
{
    static const double parameters[] = {PARAMETERS, 0.0}, starts[] = {STARTS, 0.0};
    m->t = 0.0;
    memcpy(m->p, parameters, sizeof m->p);
    memcpy(m->x, starts, sizeof m->x);
    memset(m->mode, 0, sizeof m->mode);
    m->next_time = INFINITY;
    m->wants_event = m->terminates = 0;
#ifdef CLOCKS
    memset(m->active, 0, sizeof m->active);
    memset(m->qualifier, 0, sizeof m->qualifier);
    m->initializes = 1;
#endif
#ifdef TEXTS
    forget();
#endif
}

static STATUS get_one(Model *m, unsigned v, double *value)
{
    double many[NX + NZ + 1];
    if (!READABLE(m, v)) return FAILED;
    if (v == 0) {
        *value = m->t;
    } else if (v <= NX) {
        *value = m->x[v - 1];
    } else if (v > 100 && v <= 100 + NX) {
        derivatives(m, many);
        *value = many[v - 101];
    } else if (v > 200 && v <= 200 + NP) {
        *value = m->p[v - 201];
    } else if (v > 300 && v <= 300 + NZ) {
        indicators(m, many);
        *value = many[v - 301];
    } else {
        return FAILED;
    }
    return OK;
}

static STATUS set_one(Model *m, unsigned v, double value)
{
    if (v >= 1 && v <= NX) {
        m->x[v - 1] = value;
    } else if (v > 200 && v <= 200 + NP) {
        m->p[v - 201] = value;
    } else {
        return FAILED;
    }
    return OK;
}

static STATUS complain(Model *m)
{
#if FMI == 2
    m->callbacks->logger(m->callbacks->componentEnvironment, "model", fmi2Error, "logStatusError", "%s beyond t = %g",
                         "no rates", 1.0);
#else
    m->log(m->environment, fmi3Error, "logStatusError", "no rates beyond t = 1");
#endif
    return FAILED;
}

static STATUS get_many(Model *m, const REFERENCE *v, size_t n, double *values)
{
    STATUS status = OK;
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
STATUS NAME(Reset)(void *c)
{
    put_back(c);
    return OK;
}
void NAME(FreeInstance)(void *c) { free(c); }

STATUS NAME(SetTime)(void *c, double t)
{
    ((Model *)c)->t = t;
    return OK;
}
STATUS NAME(SetContinuousStates)(void *c, const double *x, size_t n)
{
    memcpy(((Model *)c)->x, x, n * sizeof *x);
    return OK;
}
STATUS NAME(GetContinuousStates)(void *c, double *x, size_t n)
{
    memcpy(x, ((Model *)c)->x, n * sizeof *x);
    return OK;
}
STATUS NAME(GetEventIndicators)(void *c, double *z, size_t n)
{
    (void)n;
    indicators(c, z);
    return OK;
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

#if FMI == 2
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *k) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    Model *m = calloc(1, sizeof *m);
    m->callbacks = callbacks;
    put_back(m);
    return m;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends,
                               fmi2Real stop)
{
    ((Model *)c)->t = start;
    return fmi2OK;
}
PLAIN(EnterInitializationMode)
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Model *m = c;
    *info = (fmi2EventInfo){0};
    info->valuesOfContinuousStatesChanged = update(m);
    info->newDiscreteStatesNeeded = RESTLESS;
    info->terminateSimulation = m->terminates;
    info->nextEventTimeDefined = isfinite(m->next_time);
    info->nextEventTime = m->next_time;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real *dx, size_t n)
{
    Model *m = c;
    derivatives(m, dx);
    return FAILS ? complain(m) : fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference *v, size_t n, fmi2Real *values)
{
    return get_many(c, v, n, values);
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Real *values)
{
    return set_many(c, v, n, values);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference *v, size_t n, fmi2Integer *values)
{
    for (size_t i = 0; i < n; i++)
        values[i] = ((Model *)c)->mode[v[i] - 401];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *values)
{
    return fmi2Error;
}
#define NONE(Name, Value)                                                                                              \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference *v, size_t n, Value *values)                    \
    {                                                                                                                  \
        return n ? fmi2Error : fmi2OK;                                                                                 \
    }                                                                                                                  \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference *v, size_t n, const Value *values)              \
    {                                                                                                                  \
        return n ? fmi2Error : fmi2OK;                                                                                 \
    }
NONE(Boolean, fmi2Boolean)
#ifndef TEXTS
NONE(String, fmi2String)
#endif
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { return fmi2Error; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { return fmi2Error; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte *b, size_t n) { return fmi2Error; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte *b, size_t n, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference *u, size_t nu,
                                        const fmi2ValueReference *k, size_t nk, const fmi2Real *seed, fmi2Real *du)
{
#ifdef JACOBIAN
    jacobian(c, seed, du);
    return fmi2OK;
#else
    return fmi2Error;
#endif
}
#else
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String *k) { return fmi3OK; }
const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    Model *m = calloc(1, sizeof *m);
    m->log = log;
    m->environment = environment;
    put_back(m);
    return m;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean given, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 stop)
{
    ((Model *)c)->t = start;
#ifdef CLOCKS
    begin(c);
#endif
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *states, fmi3Boolean *defined, fmi3Float64 *next)
{
    Model *m = c;
    *states = update(m);
    *again = RESTLESS;
    *nominals = false;
    *terminate = m->terminates;
    *defined = isfinite(m->next_time);
    *next = m->next_time;
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 *dx, size_t n)
{
    Model *m = c;
    derivatives(m, dx);
    return FAILS ? complain(m) : fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    *n = NX;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    *n = NZ;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Float64 *values, size_t m)
{
    return get_many(c, v, n, values);
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3Float64 *values, size_t m)
{
    return set_many(c, v, n, values);
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Int32 *values, size_t m)
{
    for (size_t i = 0; i < n; i++)
        for (unsigned k = 0; k < SIZE(v[i]); k++) {
            if (!READABLE((Model *)c, v[i])) return fmi3Error;
            *values++ = ((Model *)c)->mode[v[i] + k - 401];
        }
    return fmi3OK;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference *u, size_t nu,
                                        const fmi3ValueReference *k, size_t nk, const fmi3Float64 *seed, size_t ns,
                                        fmi3Float64 *du, size_t nd)
{
#ifdef JACOBIAN
    jacobian(c, seed, du);
    return fmi3OK;
#else
    return fmi3Error;
#endif
}
#endif

#ifdef CO_SIMULATION
#if FMI == 2
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *o,
                                       const fmi2Real *d)
{
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *o,
                                        fmi2Real *d)
{
    return fmi2Error;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real length, fmi2Boolean no_set)
{
    Model *m = c;
    while (do_step(m, t + length))
        update(m);
    return m->terminates ? fmi2Discard : fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
#define ASK(Name, Value)                                                                                               \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind s, Value *value) { return fmi2Error; }
ASK(Status, fmi2Status)
ASK(IntegerStatus, fmi2Integer)
ASK(StringStatus, fmi2String)
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    *value = ((Model *)c)->terminates;
    return fmi2OK;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    *value = ((Model *)c)->t;
    return fmi2OK;
}
#else
PLAIN(EnterStepMode)
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference *v, size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback intermediate)
{
#ifdef REFUSES_EVENTS
    if (events) log(environment, fmi3Error, "logStatusError", "no event mode here");
    const bool makes = !events;
#else
    const bool makes = events && early;
#endif
    return makes ? fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log) : NULL;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 length, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Model *m = c;
#ifdef REFUSES_EVENTS
    *event = *early = false;
    while (do_step(m, t + length))
        update(m);
#else
    *event = *early = do_step(m, t + length);
#endif
    *terminate = m->terminates;
    *last = m->t;
    return fmi3OK;
}
#endif
#endif
