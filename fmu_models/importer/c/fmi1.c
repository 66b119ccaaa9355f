/*
 * FMI 1.0 behind the functions of FMI 2.0, so that the rest of the importer need not know of it.
 *
 *     exit initialization mode      fmiInitialize, fmiInitializeSlave; before, where a variable is read earlier
 *     first update                  what fmiInitialize told, unless something was set since: fmiEventUpdate
 *     enter event, continuous mode  nothing
 *     reset                         none: the caller makes a fresh instance
 *     states                        in the order of the description; fmiGetStateValueReferences says which is which
 *
 * The logger of FMI 1.0 has no environment: a message belongs to the instance that was called last on its thread.
 */
#include "fmi1.h"

#include "fmi_calls.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "fmi1Functions.h"
#include "fmi2FunctionTypes.h"

/* the callbacks of FMI 2.0, and the instance to be */
typedef struct {
    fmi2CallbackFunctions common;
    Adapter *adapter;
} Callbacks1;

static _Thread_local Log *speaking;

#define CALL1(a, NAME) (speaking = (a)->log, (fmi1##NAME##TYPE *)(a)->NAME)
#define FACE(NAME) EXPORT fmi2Status fmi1_##NAME

static void log1(fmi1Component c, fmi1String name, fmi1Status status, fmi1String category, fmi1String message, ...)
{
    char text[sizeof speaking->message];
    va_list arguments;
    (void)c;
    (void)name;
    if (!message) return;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    master_log3(speaking, (int)status, category, text);
}

EXPORT fmi2Component fmi1_Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                                      const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    const fmi1CallbackFunctions own = {log1, callbacks->allocateMemory, callbacks->freeMemory, NULL};
    const fmi1Boolean shown = (fmi1Boolean)visible, logs = (fmi1Boolean)logging;
    Adapter *a = ((const Callbacks1 *)(const void *)callbacks)->adapter;
    a->log = callbacks->componentEnvironment;
    a->slave = type == fmi2CoSimulation;
    a->component = a->slave ? CALL1(a, InstantiateSlave)(name, guid, location, "application/x-fmu-sharedlibrary", 0.0,
                                                         shown, fmi1False, own, logs)
                            : CALL1(a, InstantiateModel)(name, guid, own, logs);
    return a->component ? a : NULL;
}

EXPORT void fmi1_FreeInstance(fmi2Component c)
{
    Adapter *a = c;
    a->slave ? CALL1(a, FreeSlaveInstance)(a->component) : CALL1(a, FreeModelInstance)(a->component);
}

FACE(SetupExperiment)(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends,
                      fmi2Real stop)
{
    Adapter *a = c;
    a->tolerance = given ? tolerance : 0.0;
    a->start = start;
    a->stop = ends ? stop : INFINITY;
    a->initializing = 1;
    return a->slave ? fmi2OK : (fmi2Status)CALL1(a, SetTime)(a->component, start);
}

/* the number in the description of a state of the library, or n_states: none. States that it does not tell, one by one */
static int64_t described(Adapter *a, int64_t i, int tells, int64_t *untold)
{
    const int64_t n = a->n_states;
    if (!tells) {
        /* in the same order, where the variables have the values of the states */
        double value = a->vector[i];
        const int known = a->GetReal && a->states[i] < a->first_made;
        const fmi1Status status = known ? CALL1(a, GetReal)(a->component, a->states + i, 1, &value) : fmi1OK;
        return status < fmi1Discard && value != a->vector[i] ? n : i;
    }
    if (a->states[i] == a->told_states[i]) return i;
    for (int64_t k = 0; k < n; k++)
        if (a->states[k] == a->told_states[i]) return k;
    while (*untold < n && a->states[*untold] < a->first_made)
        ++*untold;
    return *untold < n ? (*untold)++ : n;
}

static fmi2Status set_order(Adapter *a)
{
    const size_t n = (size_t)a->n_states;
    Log *log = a->log;
    if (a->slave || n == 0) return fmi2OK;
    a->log = NULL; /* some do not tell, and say that as an error */
    const int tells = a->GetStateValueReferences
                      && CALL1(a, GetStateValueReferences)(a->component, a->told_states, n) < fmi1Discard;
    a->log = log;
    const fmi1Status status = tells ? fmi1OK : CALL1(a, GetContinuousStates)(a->component, a->vector, n);
    a->moved = 0;
    for (int64_t i = 0, untold = 0; i < a->n_states && status < fmi1Discard; i++) {
        a->order[i] = described(a, i, tells, &untold);
        a->moved |= a->order[i] != i;
        if (a->order[i] < a->n_states) continue;
        master_log3(log, FMI_ERROR, "",
                    "the states of the library are other variables than those whose der(...) is described; states that "
                    "are chosen anew during a run are not followed");
        return fmi2Error;
    }
    return (fmi2Status)status;
}

FACE(ExitInitializationMode)(fmi2Component c)
{
    Adapter *a = c;
    if (!a->initializing) return fmi2OK;
    a->initializing = 0;
    a->told = 1;
    const fmi1Boolean ends = isfinite(a->stop), given = a->tolerance > 0.0;
    const fmi1Status status = a->slave
                                  ? CALL1(a, InitializeSlave)(a->component, a->start, ends, ends ? a->stop : a->start)
                                  : CALL1(a, Initialize)(a->component, given, a->tolerance, (void *)a->info);
    return status < fmi1Discard ? set_order(a) : (fmi2Status)status;
}

FACE(EnterInitializationMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
FACE(EnterEventMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
FACE(EnterContinuousTimeMode)(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

FACE(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    Adapter *a = c;
    const fmi1EventInfo *own = (void *)a->info;
    fmi2Status status = a->told ? fmi2OK : (fmi2Status)CALL1(a, EventUpdate)(a->component, fmi1False, (void *)a->info);
    if (status < fmi2Discard && !a->told && own->stateValueReferencesChanged) status = set_order(a);
    a->told = 0;
    *info = (fmi2EventInfo){!own->iterationConverged, own->terminateSimulation, own->stateValueReferencesChanged,
                            own->stateValuesChanged,  own->upcomingTimeEvent,   own->nextEventTime};
    return status;
}

FACE(CompletedIntegratorStep)(fmi2Component c, fmi2Boolean keep, fmi2Boolean *event, fmi2Boolean *terminate)
{
    Adapter *a = c;
    fmi1Boolean asks = fmi1False;
    (void)keep;
    const fmi1Status status = CALL1(a, CompletedIntegratorStep)(a->component, &asks);
    *event = asks != fmi1False;
    *terminate = 0;
    return (fmi2Status)status;
}

FACE(SetContinuousStates)(fmi2Component c, const fmi2Real x[], size_t n)
{
    Adapter *a = c;
    for (size_t i = 0; a->moved && i < n; i++)
        a->vector[i] = x[a->order[i]];
    return (fmi2Status)CALL1(a, SetContinuousStates)(a->component, a->moved ? a->vector : x, n);
}

#define VECTOR1(NAME, NAME1)                                                                                           \
    FACE(NAME)(fmi2Component c, fmi2Real values[], size_t n)                                                           \
    {                                                                                                                  \
        Adapter *a = c;                                                                                                \
        const fmi1Status status = CALL1(a, NAME1)(a->component, a->moved ? a->vector : values, n);                     \
        for (size_t i = 0; a->moved && i < n; i++) {                                                                   \
            values[a->order[i]] = a->vector[i];                                                                        \
        }                                                                                                              \
        return (fmi2Status)status;                                                                                     \
    }
VECTOR1(GetContinuousStates, GetContinuousStates)
VECTOR1(GetDerivatives, GetDerivatives)
VECTOR1(GetNominalsOfContinuousStates, GetNominalContinuousStates)

/* the variable behind a reference; NULL: one of the library's */
static const Made *made(const Adapter *a, fmi2ValueReference reference)
{
    const int64_t i = (int64_t)reference - a->first_made;
    return i < 0 || i >= a->n_made ? NULL : a->made + i;
}

static fmi1Status get_state(Adapter *a, const Made *m, double *value)
{
    const fmi2Status status =
        (m->kind == MADE_RATE ? fmi1_GetDerivatives : fmi1_GetContinuousStates)(a, a->room, (size_t)a->n_states);
    *value = a->room[m->source];
    return (fmi1Status)status;
}

/* one after the other: a negated one is that of the library, turned round both ways */
#define EACH(NAME, PARAMETERS, BEFORE, ...)                                                                            \
    FACE(NAME) PARAMETERS                                                                                              \
    {                                                                                                                  \
        Adapter *a = c;                                                                                                \
        fmi1Status status = BEFORE;                                                                                    \
        for (size_t i = 0; i < n && status < fmi1Discard; i++) {                                                       \
            const Made *m = made(a, v[i]);                                                                             \
            const fmi1ValueReference *source = m ? &m->source : v + i;                                                 \
            __VA_ARGS__;                                                                                               \
        }                                                                                                              \
        return (fmi2Status)status;                                                                                     \
    }
#define PASS1(NAME, TURNED, STATE)                                                                                     \
    EACH(                                                                                                              \
        Get##NAME, (fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2##NAME values[]),                     \
        (fmi1Status)fmi1_ExitInitializationMode(a), fmi1##NAME value = 0;                                              \
        if (m && m->kind) {                                                                                            \
            status = STATE;                                                                                            \
            continue;                                                                                                  \
        } status = CALL1(a, Get##NAME)(a->component, source, 1, &value);                                               \
        values[i] = (fmi2##NAME)(m ? TURNED value : value))                                                            \
    EACH(Set##NAME, (fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2##NAME values[]),              \
         (a->told = 0, fmi1OK), const fmi1##NAME value = (fmi1##NAME)(m ? TURNED values[i] : values[i]);               \
         status = m && m->kind ? fmi1Error : CALL1(a, Set##NAME)(a->component, source, 1, &value))
PASS1(Real, -, get_state(a, m, values + i))
PASS1(Integer, -, fmi1Error)
PASS1(Boolean, !, fmi1Error)
#define DERIVATIVES1(NAME, TYPE, VALUE, AFTER)                                                                         \
    EACH(NAME, (fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2Integer order[], TYPE values[]),    \
         fmi1OK, double value = VALUE;                                                                                 \
         if (m) value = -value; status = CALL1(a, NAME)(a->component, source, 1, order + i, &value); AFTER)
DERIVATIVES1(SetRealInputDerivatives, const fmi2Real, values[i], (void)0)
DERIVATIVES1(GetRealOutputDerivatives, fmi2Real, 0.0, values[i] = m ? -value : value)

#define FORWARD(NAME, PARAMETERS, ...)                                                                                 \
    FACE(NAME) PARAMETERS { return (fmi2Status)CALL1((Adapter *)c, NAME)(((Adapter *)c)->component, __VA_ARGS__); }
FORWARD(SetTime, (fmi2Component c, fmi2Real t), t)
FORWARD(GetEventIndicators, (fmi2Component c, fmi2Real z[], size_t n), z, n)
FORWARD(GetString, (fmi2Component c, const fmi2ValueReference v[], size_t n, fmi2String values[]), v, n, values)
FORWARD(SetString, (fmi2Component c, const fmi2ValueReference v[], size_t n, const fmi2String values[]), v, n, values)
FORWARD(GetRealStatus, (fmi2Component c, fmi2StatusKind kind, fmi2Real *value), (fmi1StatusKind)kind, value)

FACE(DoStep)(fmi2Component c, fmi2Real t, fmi2Real length, fmi2Boolean keep)
{
    (void)keep;
    return (fmi2Status)CALL1((Adapter *)c, DoStep)(((Adapter *)c)->component, t, length, fmi1True);
}

FACE(Terminate)(fmi2Component c)
{
    Adapter *a = c;
    return (fmi2Status)(a->slave ? CALL1(a, TerminateSlave)(a->component) : CALL1(a, Terminate)(a->component));
}
