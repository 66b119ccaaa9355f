#include "fmi_calls.h"

#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#define CALL2(NAME, FUNCTION) ((fmi2##NAME##TYPE *)fmu->function[FUNCTION])
#define CALL3(NAME, FUNCTION) ((fmi3##NAME##TYPE *)fmu->function[FUNCTION])

/* the loggers handed to FMUs; what an FMU says after its first error is about the same error */
EXPORT void master_log2(void *environment, const char *name, int status, const char *category, const char *message, ...)
{
    char text[sizeof((Log *)environment)->message];
    va_list arguments;
    (void)name;
    if (!message) return;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
    master_log3(environment, status, category, text);
}

EXPORT void master_log3(void *environment, int status, const char *category, const char *message)
{
    Log *log = environment;
    (void)category;
    if (!log || !message || (status < FMI_WARNING && log->count)) return;
    snprintf(log->message, sizeof log->message, "%s", message);
    if (status == FMI_WARNING && log->warnings++ == 0) memcpy(log->warning, log->message, sizeof log->warning);
    log->count += status >= FMI_WARNING;
}

/* a bool of FMI 3 as a library may leave it: a byte of any value, where C takes 0 and 1 alone */
typedef unsigned char Flag;

int fmi_plain(const FmuInstance *fmu, Function function)
{
    /* without a reset the instance is a fresh one */
    if (function == F_RESET && !fmu->function[function]) return FMI_OK;
    /* fmi2Reset and its like have one signature in both versions */
    return (int)((fmi2ResetTYPE *)fmu->function[function])(fmu->instance);
}

int fmi_initialize(const FmuInstance *fmu, double start, double stop, double tolerance)
{
    if (fmu->fmi == 3) {
        return (int)CALL3(EnterInitializationMode, F_ENTER_INITIALIZATION)(fmu->instance, true, tolerance, start, true,
                                                                           stop);
    }
    const int status = (int)CALL2(SetupExperiment, F_SETUP)(fmu->instance, 1, tolerance, start, 1, stop);
    return status >= FMI_DISCARD ? status : fmi_plain(fmu, F_ENTER_INITIALIZATION);
}

int fmi_update(const FmuInstance *fmu, Update *update)
{
    if (fmu->fmi == 2) {
        fmi2EventInfo info;
        memset(&info, 0, sizeof info);
        const int status = (int)CALL2(NewDiscreteStates, F_UPDATE)(fmu->instance, &info);
        *update = (Update){info.newDiscreteStatesNeeded, info.terminateSimulation,
                           info.nominalsOfContinuousStatesChanged, info.valuesOfContinuousStatesChanged,
                           info.nextEventTimeDefined ? info.nextEventTime : INFINITY};
        return status;
    }
    Flag again = 0, terminate = 0, nominals = 0, states = 0, defined = 0;
    double time = 0.0;
    const int status = (int)CALL3(UpdateDiscreteStates, F_UPDATE)(
        fmu->instance, (void *)&again, (void *)&terminate, (void *)&nominals, (void *)&states, (void *)&defined, &time);
    *update = (Update){again, terminate, nominals, states, defined ? time : INFINITY};
    return status;
}

int fmi_completed(const FmuInstance *fmu, int *enter_event, int *terminate)
{
    if (fmu->fmi == 2)
        return (int)CALL2(CompletedIntegratorStep, F_COMPLETED)(fmu->instance, 1, enter_event, terminate);
    Flag enter = 0, ends = 0;
    const int status =
        (int)CALL3(CompletedIntegratorStep, F_COMPLETED)(fmu->instance, true, (void *)&enter, (void *)&ends);
    *enter_event = enter;
    *terminate = ends;
    return status;
}

/* these have the same signature in both versions */
int fmi_set_time(const FmuInstance *fmu, double t) { return (int)CALL2(SetTime, F_SET_TIME)(fmu->instance, t); }

/* a vector, for which an FMU that has no entries of it is not called */
#define VECTOR_CALL(face, Vector, NAME, FUNCTION, count)                                                               \
    int face(const FmuInstance *fmu, Vector values)                                                                    \
    {                                                                                                                  \
        return fmu->count ? (int)CALL2(NAME, FUNCTION)(fmu->instance, values, (size_t)fmu->count) : FMI_OK;            \
    }
VECTOR_CALL(fmi_set_states, const double *, SetContinuousStates, F_SET_STATES, n_states)
VECTOR_CALL(fmi_get_states, double *, GetContinuousStates, F_GET_STATES, n_states)
VECTOR_CALL(fmi_derivatives, double *, GetDerivatives, F_GET_DERIVATIVES, n_states)
VECTOR_CALL(fmi_indicators, double *, GetEventIndicators, F_GET_INDICATORS, n_indicators)
VECTOR_CALL(fmi_nominals, double *, GetNominalsOfContinuousStates, F_NOMINALS, n_states)

int fmi_directional(const FmuInstance *fmu, const double *seed, double *dx)
{
    const size_t n = (size_t)fmu->n_state_references;
    const size_t width = (size_t)fmu->n_states;
    if (fmu->fmi == 2) {
        return (int)CALL2(GetDirectionalDerivative, F_DIRECTIONAL)(fmu->instance, fmu->derivative_references, n,
                                                                   fmu->state_references, n, seed, dx);
    }
    return (int)CALL3(GetDirectionalDerivative, F_DIRECTIONAL)(fmu->instance, fmu->derivative_references, n,
                                                               fmu->state_references, n, seed, width, dx, width);
}

/* the types of FMI 3 other than double, what C and the functions call them, and their range */
#define NARROWER(ONE)                                                                                                  \
    ONE(T_INT32, int32_t, Int32, INT32_MIN, INT32_MAX)                                                                 \
    ONE(T_BOOLEAN, Flag, Boolean, 0, 1)                                                                                \
    ONE(T_FLOAT32, float, Float32, -INFINITY, INFINITY)                                                                \
    ONE(T_INT8, int8_t, Int8, INT8_MIN, INT8_MAX)                                                                      \
    ONE(T_UINT8, uint8_t, UInt8, 0, UINT8_MAX)                                                                         \
    ONE(T_INT16, int16_t, Int16, INT16_MIN, INT16_MAX)                                                                 \
    ONE(T_UINT16, uint16_t, UInt16, 0, UINT16_MAX)                                                                     \
    ONE(T_UINT32, uint32_t, UInt32, 0, UINT32_MAX)                                                                     \
    ONE(T_INT64, int64_t, Int64, INT64_MIN, INT64_MAX)                                                                 \
    ONE(T_UINT64, uint64_t, UInt64, 0, UINT64_MAX)

enum { FEW = 2 }; /* elements of an array that need no memory of their own */

/* the conversion of a number beyond the type, or of none, is not defined */
static int fits(double value, double least, double most) { return value > least - 1.0 && value < most + 1.0; }

/* the n values of a variable of such a type, either way */
#define ONE(TAG, CTYPE, NAME, LEAST, MOST)                                                                             \
    case TAG: {                                                                                                        \
        CTYPE few[FEW] = {0};                                                                                          \
        CTYPE *all = n <= FEW ? few : calloc((size_t)n, sizeof *all);                                                  \
        int fine = all != NULL;                                                                                        \
        for (int64_t i = 0; i < n && fine && writing; i++) {                                                           \
            fine = TAG == T_FLOAT32 || fits(value[i], (double)LEAST, (double)MOST);                                    \
            all[i] = fine ? (CTYPE)value[i] : (CTYPE)0;                                                                \
        }                                                                                                              \
        if (fine && writing) {                                                                                         \
            status = (int)CALL3(Set##NAME, F_SETTERS + TAG)(fmu->instance, reference, 1, (void *)all, (size_t)n);      \
        } else if (fine) {                                                                                             \
            status = (int)CALL3(Get##NAME, F_GETTERS + TAG)(fmu->instance, reference, 1, (void *)all, (size_t)n);      \
        }                                                                                                              \
        for (int64_t i = 0; i < n && fine && !writing; i++) {                                                          \
            value[i] = (double)all[i];                                                                                 \
        }                                                                                                              \
        if (all != few) {                                                                                              \
            free(all);                                                                                                 \
        }                                                                                                              \
        break;                                                                                                         \
    }

static int fmi_pass_one(const FmuInstance *fmu, Type type, const uint32_t *reference, double *value, int64_t n,
                        int writing)
{
    int status = FMI_ERROR;
    if (fmu->fmi == 2) {
        /* integers, enumerations and booleans of FMI 2 are all int */
        int one = 0;
        if (writing) {
            if (!fits(*value, INT_MIN, INT_MAX)) return FMI_ERROR;
            one = (int)*value;
            return (int)CALL2(SetInteger, F_SETTERS + type)(fmu->instance, reference, 1, &one);
        }
        status = (int)CALL2(GetInteger, F_GETTERS + type)(fmu->instance, reference, 1, &one);
        *value = one;
        return status;
    }
    switch (type) {
        NARROWER(ONE)
    case T_FLOAT64:
        return writing ? (int)CALL3(SetFloat64, F_SETTERS)(fmu->instance, reference, 1, value, (size_t)n)
                       : (int)CALL3(GetFloat64, F_GETTERS)(fmu->instance, reference, 1, value, (size_t)n);
    }
    return status;
}
#undef ONE

/* number of values of the variable that begins with the i-th */
static int64_t size_at(const Variables *variables, int64_t i) { return variables->sizes ? variables->sizes[i] : 1; }

/* number of variables of type Float64 from the i-th on, up to an array */
static int64_t floats_from(const Variables *variables, int64_t i)
{
    int64_t n = 0;
    while (i + n < variables->n && variables->types[i + n] == T_FLOAT64 && size_at(variables, i + n) == 1)
        n++;
    return n;
}

static int fmi_pass_floats(const FmuInstance *fmu, const uint32_t *reference, double *values, size_t n, int writing)
{
    if (fmu->fmi == 2) {
        return writing ? (int)CALL2(SetReal, F_SETTERS)(fmu->instance, reference, n, values)
                       : (int)CALL2(GetReal, F_GETTERS)(fmu->instance, reference, n, values);
    }
    return writing ? (int)CALL3(SetFloat64, F_SETTERS)(fmu->instance, reference, n, values, n)
                   : (int)CALL3(GetFloat64, F_GETTERS)(fmu->instance, reference, n, values, n);
}

static int fmi_pass(const FmuInstance *fmu, const Variables *variables, double *values, int writing)
{
    int status = FMI_OK;
    for (int64_t i = 0; i < variables->n && status < FMI_DISCARD;) {
        const uint32_t *reference = variables->references + i;
        const int64_t floats = floats_from(variables, i), n = floats ? floats : size_at(variables, i);
        status = floats ? fmi_pass_floats(fmu, reference, values + i, (size_t)n, writing)
                        : fmi_pass_one(fmu, (Type)variables->types[i], reference, values + i, n, writing);
        i += n;
    }
    return status;
}

int fmi_read(const FmuInstance *fmu, const Variables *variables, double *values)
{
    return fmi_pass(fmu, variables, values, 0);
}

int fmi_write(const FmuInstance *fmu, const Variables *variables, const double *values)
{
    return fmi_pass(fmu, variables, (double *)values, 1);
}

int fmi_do_step(const FmuInstance *fmu, double t, double length, Stepped *stepped)
{
    *stepped = (Stepped){0, 0, 0, t + length};
    if (fmu->fmi == 2) {
        const int status = (int)CALL2(DoStep, F_DO_STEP)(fmu->instance, t, length, 1);
        if (status == FMI_DISCARD && fmu->function[F_BOOLEAN_STATUS])
            CALL2(GetBooleanStatus, F_BOOLEAN_STATUS)(fmu->instance, fmi2Terminated, &stepped->terminate);
        if (status == FMI_DISCARD && fmu->function[F_REAL_STATUS])
            CALL2(GetRealStatus, F_REAL_STATUS)(fmu->instance, fmi2LastSuccessfulTime, &stepped->reached);
        return status;
    }
    Flag event = 0, terminate = 0, early = 0;
    const int status = (int)CALL3(DoStep, F_DO_STEP)(fmu->instance, t, length, true, (void *)&event, (void *)&terminate,
                                                     (void *)&early, &stepped->reached);
    stepped->event = event;
    stepped->terminate = terminate;
    stepped->early = early;
    return status;
}

EXPORT int fmi_configure(const FmuInstance *fmu)
{
    if (fmu->structure.n == 0) return FMI_OK;
    const int entered = fmi_plain(fmu, F_ENTER_CONFIGURATION);
    const int set = entered < FMI_DISCARD ? fmi_write(fmu, &fmu->structure, fmu->structure_values) : entered;
    return set < FMI_DISCARD ? fmi_plain(fmu, F_EXIT_CONFIGURATION) : set;
}

int fmi_set_clock(const FmuInstance *fmu, uint32_t reference)
{
    const fmi3Clock active = fmi3ClockActive;
    return (int)CALL3(SetClock, F_SET_CLOCK)(fmu->instance, &reference, 1, &active);
}

int fmi_get_clock(const FmuInstance *fmu, uint32_t reference, int *active)
{
    Flag ticks = 0;
    const int status = (int)CALL3(GetClock, F_GET_CLOCK)(fmu->instance, &reference, 1, (void *)&ticks);
    *active = ticks;
    return status;
}

int fmi_get_interval(const FmuInstance *fmu, uint32_t reference, double *interval, int *qualifier)
{
    fmi3IntervalQualifier told = fmi3IntervalNotYetKnown;
    const int status = (int)CALL3(GetIntervalDecimal, F_GET_INTERVAL)(fmu->instance, &reference, 1, interval, &told);
    *qualifier = (int)told;
    return status;
}

int fmi_get_shift(const FmuInstance *fmu, uint32_t reference, double *shift)
{
    return (int)CALL3(GetShiftDecimal, F_GET_SHIFT)(fmu->instance, &reference, 1, shift);
}

int fmi_activate(const FmuInstance *fmu, uint32_t reference, double t)
{
    return (int)CALL3(ActivateModelPartition, F_ACTIVATE)(fmu->instance, reference, t);
}
