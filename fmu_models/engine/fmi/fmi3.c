/* The FMI 3.0 interface of an instance: Model Exchange and Co-Simulation (fmi-standard.org, FMI 3.0.2). */
#include <string.h>

#ifndef FMI3_OVERRIDE_FUNCTION_PREFIX
#define FMI3_OVERRIDE_FUNCTION_PREFIX
#endif
#include "fmi3Functions.h"

#include "clocks.h"
#include "co_simulation.h"
#include "fmu_state.h"
#include "iteration.h"
#include "variables.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standard hands over more than is asked for here */

/* statuses and integers are passed through as they are */
_Static_assert((int)fmi3OK == STATUS_OK && (int)fmi3Error == STATUS_ERROR, "numbers of fmi3Status");

static void say(Instance *m, Status status, const char *category, const char *message)
{
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)m->logger;
    logger(m->environment, (fmi3Status)status, category, message);
}

/* a Show: outputs where the step is, or inputs for times ahead */
static int show(Instance *m, double time, int asks, int can_return, double *until)
{
    fmi3IntermediateUpdateCallback update = (fmi3IntermediateUpdateCallback)m->intermediate;
    fmi3Boolean returns = false;
    update(m->environment, time, asks != 0, !asks, !asks, can_return != 0, &returns, until);
    return returns;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    return instance_new(name, token, 0, say, (void (*)(void))logger, environment, logging_on, 1);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode_used,
                                         fmi3Boolean early_return_allowed, const fmi3ValueReference intermediate[],
                                         size_t n_intermediate, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback intermediate_update)
{
    Instance *m = instance_new(name, token, 1, say, (void (*)(void))logger, environment, logging_on, 1);
    if (!m) return NULL;
    for (size_t k = 0; intermediate && k < n_intermediate; k++) {
        m->takes_inputs |= variables_rate_of(intermediate[k]) != 0;
        if (!variables_is_intermediate(intermediate[k])) {
            instance_refuse(m, "%s: value reference %u cannot be accessed inside a step", __func__,
                            (unsigned)intermediate[k]);
            instance_free(m);
            return NULL;
        }
    }
    m->event_mode_used = event_mode_used;
    m->early_return_allowed = early_return_allowed;
    m->show = show;
    m->intermediate = (void (*)(void))intermediate_update;
    return m;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                               fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    if (logger && logging_on)
        logger(environment, fmi3Error, "logStatusError",
               "fmi3InstantiateScheduledExecution: the model has no input clocks");
    return NULL;
}

#define FMI_NAME(name) fmi3##name
#define FMI_STATE(before, after) fmi3##before##FMUState##after
#define FMI_INSTANCE fmi3Instance
#define FMI_DESERIALIZE fmi3DeserializeFMUState
#define DERIVATIVES fmi3GetContinuousStateDerivatives
#include "shared_calls.h"

/* life */

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time)
{
    Instance *m = c;
    if (instance_enter(m, PHASE_INSTANTIATED, __func__)) return fmi3Error;
    if (instance_set_up(m, __func__, tolerance_defined, tolerance, start_time, stop_defined, stop_time))
        return fmi3Error;
    m->core.phase = PHASE_INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    if (instance_enter(c, PHASES_SETTABLE, __func__)) return fmi3Error;
    return (fmi3Status)instance_reset(c);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *need_update, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                    fmi3Boolean *next_event_defined, fmi3Float64 *next_event)
{
    const void *results[] = {need_update, terminate, nominals_changed, states_changed, next_event_defined, next_event};
    int changed;
    if (instance_enter(c, PHASE_EVENT, __func__)) return fmi3Error;
    for (int i = 0; i < 6; i++)
        if (instance_array(c, results[i], 1, __func__, "a result")) return fmi3Error;
    if (iteration_update(c, __func__, &changed)) return fmi3Error;
    /* the engine iterates to a fixed point itself: one call is enough */
    *need_update = *terminate = *nominals_changed = false;
    *states_changed = changed != 0;
    const double next = iteration_next(&((Instance *)c)->core);
    *next_event_defined = isfinite(next) != 0;
    *next_event = *next_event_defined ? next : 0.0;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    return (fmi3Status)instance_enter(c, PHASE_INITIALIZATION | PHASE_EVENT, __func__);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    return (fmi3Status)instance_not_provided(c, __func__, "the model has no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    return (fmi3Status)instance_not_provided(c, __func__, "the model has no structural parameters");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    return (fmi3Status)instance_not_provided(c, __func__, "the model has no input clocks");
}

/* from event mode into the mode in which time goes on, which only one of the two interfaces has */
static fmi3Status leave_event_mode(Instance *m, const char *function, int co_simulation, Phase next, const char *other)
{
    int changed;
    if (instance_enter(m, PHASE_EVENT, function)) return fmi3Error;
    if (m->core.co_simulation != co_simulation) return (fmi3Status)instance_not_provided(m, function, other);
    if (iteration_update(m, function, &changed)) return fmi3Error;
    memset(m->core.ticks, 0, sizeof m->core.ticks);
    m->core.phase = next;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    return leave_event_mode(c, __func__, 0, PHASE_CONTINUOUS, "Co-Simulation goes on with fmi3EnterStepMode");
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    return leave_event_mode(c, __func__, 1, PHASE_STEP, "Model Exchange goes on with fmi3EnterContinuousTimeMode");
}

#define NUMBER_OF(Name, number)                                                                                        \
    fmi3Status fmi3GetNumberOf##Name(fmi3Instance c, size_t *n)                                                        \
    {                                                                                                                  \
        if (instance_enter(c, PHASES_ALL, __func__) || instance_array(c, n, 1, __func__, "the number"))                \
            return fmi3Error;                                                                                          \
        *n = number;                                                                                                   \
        return fmi3OK;                                                                                                 \
    }

NUMBER_OF(EventIndicators, MODEL_NI)
NUMBER_OF(ContinuousStates, MODEL_FLOWING)

/* Co-Simulation */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_output_derivatives(c, __func__, vr, n, orders, values);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
                      fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_time)
{
    Instance *m = c;
    const void *results[] = {event_handling_needed, terminate, early_return, last_time};
    StepEnd end;
    if (instance_enter(m, PHASE_STEP, __func__)) return fmi3Error;
    for (int i = 0; i < 4; i++)
        if (instance_array(m, results[i], 1, __func__, "a result")) return fmi3Error;
    *event_handling_needed = *terminate = *early_return = false;
    Status status = co_simulation_step(m, __func__, time, step, &end);
    *event_handling_needed = end.event != 0;
    *early_return = end.early != 0;
    *last_time = m->core.run.at.time;
    return (fmi3Status)status;
}

/* variables of the types the model has */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[],
                          size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_get(c, __func__, vr, n, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_set(c, __func__, vr, n, values);
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 values[], size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_get_contacts(c, __func__, vr, n, values);
}

fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 values[],
                        size_t n_values)
{
    return (fmi3Status)variables_none(c, __func__, n, "of type Int32 that can be set");
}

/* variables of the types it has not */

#define NO_VARIABLES(type, value_type)                                                                                 \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, value_type values[],             \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        return (fmi3Status)variables_none(c, __func__, n, "of type " #type);                                           \
    }                                                                                                                  \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const value_type values[],       \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        return (fmi3Status)variables_none(c, __func__, n, "of type " #type);                                           \
    }

NO_VARIABLES(Float32, fmi3Float32)
NO_VARIABLES(Int8, fmi3Int8)
NO_VARIABLES(UInt8, fmi3UInt8)
NO_VARIABLES(Int16, fmi3Int16)
NO_VARIABLES(UInt16, fmi3UInt16)
NO_VARIABLES(UInt32, fmi3UInt32)
NO_VARIABLES(Int64, fmi3Int64)
NO_VARIABLES(UInt64, fmi3UInt64)
NO_VARIABLES(Boolean, fmi3Boolean)
NO_VARIABLES(String, fmi3String)

/* a function of FMI 3 about variables the model has none of; arguments is its parameter list after the instance */
#define NOTHING_TO(name, kind, ...)                                                                                    \
    fmi3Status fmi3##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, __VA_ARGS__)                        \
    {                                                                                                                  \
        return (fmi3Status)variables_none(c, __func__, n, kind);                                                       \
    }

/* a function about clocks of another kind than the model has */
#define ONLY_OTHER_CLOCKS(name, reason, ...)                                                                           \
    fmi3Status fmi3##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, __VA_ARGS__)                        \
    {                                                                                                                  \
        return (fmi3Status)clocks_refuse(c, __func__, vr, n, reason);                                                  \
    }
#define NOT_SET "the clocks tick by themselves and cannot be set"
#define NOT_TIMED "the clocks tick at events, and have neither an interval nor a shift"

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[])
{
    return (fmi3Status)clocks_get(c, __func__, vr, n, values);
}

NOTHING_TO(GetBinary, "of type Binary", size_t sizes[], fmi3Binary values[], size_t n_values)
NOTHING_TO(SetBinary, "of type Binary", const size_t sizes[], const fmi3Binary values[], size_t n_values)
ONLY_OTHER_CLOCKS(SetClock, NOT_SET, const fmi3Clock values[])
ONLY_OTHER_CLOCKS(GetIntervalDecimal, NOT_TIMED, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ONLY_OTHER_CLOCKS(GetIntervalFraction, NOT_TIMED, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                  fmi3IntervalQualifier qualifiers[])
ONLY_OTHER_CLOCKS(GetShiftDecimal, NOT_TIMED, fmi3Float64 shifts[])
ONLY_OTHER_CLOCKS(GetShiftFraction, NOT_TIMED, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ONLY_OTHER_CLOCKS(SetIntervalDecimal, NOT_TIMED, const fmi3Float64 intervals[])
ONLY_OTHER_CLOCKS(SetIntervalFraction, NOT_TIMED, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ONLY_OTHER_CLOCKS(SetShiftDecimal, NOT_TIMED, const fmi3Float64 shifts[])
ONLY_OTHER_CLOCKS(SetShiftFraction, NOT_TIMED, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n)
{
    return (fmi3Status)instance_not_provided(
        c, __func__, "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t dependent_elements[],
                                       fmi3ValueReference independents[], size_t independent_elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
    return (fmi3Status)instance_not_provided(
        c, __func__, "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

/* directional derivatives take a seed per known and give a number per unknown, adjoint ones the other way round */
#define DERIVATIVES_OF(Name, derive, n_given, n_found)                                                                 \
    fmi3Status fmi3Get##Name##Derivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,       \
                                         const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], \
                                         size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)               \
    {                                                                                                                  \
        if (instance_enter(c, PHASES_ALL, __func__)) return fmi3Error;                                                 \
        if (instance_same(c, __func__, n_given, n_seed) || instance_same(c, __func__, n_found, n_sensitivity))         \
            return fmi3Error;                                                                                          \
        return (fmi3Status)derive(c, __func__, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);             \
    }

DERIVATIVES_OF(Directional, variables_directional, n_knowns, n_unknowns)
DERIVATIVES_OF(Adjoint, variables_adjoint, n_unknowns, n_knowns)

#pragma GCC diagnostic pop
