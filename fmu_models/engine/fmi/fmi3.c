/* The FMI 3.0 interface of an instance: Model Exchange and Co-Simulation (fmi-standard.org, FMI 3.0.2). */
#ifndef FMI3_OVERRIDE_FUNCTION_PREFIX
#define FMI3_OVERRIDE_FUNCTION_PREFIX
#endif
#include "fmi3Functions.h"

#include "fmu_state.h"
#include "variables.h"

/* statuses and integers are passed through as they are */
_Static_assert((int)fmi3OK == STATUS_OK && (int)fmi3Error == STATUS_ERROR, "numbers of fmi3Status");

static void say(Instance *m, Status status, const char *category, const char *message)
{
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)m->logger;
    logger(m->environment, (fmi3Status)status, category, message);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean logging_on, size_t n, const fmi3String categories[])
{
    return (fmi3Status)instance_log(c, __func__, logging_on, n, categories);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging_on, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)resources;
    (void)visible;
    return instance_new(name, token, 0, say, (void (*)(void))logger, environment, logging_on, 1);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging_on, fmi3Boolean event_mode_used,
                                         fmi3Boolean early_return_allowed, const fmi3ValueReference intermediate[],
                                         size_t n_intermediate, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback intermediate_update)
{
    (void)resources;
    (void)visible;
    (void)intermediate;
    (void)n_intermediate;
    (void)intermediate_update;
    Instance *m = instance_new(name, token, 1, say, (void (*)(void))logger, environment, logging_on, 1);
    if (!m) return NULL;
    m->event_mode_used = event_mode_used;
    m->early_return_allowed = early_return_allowed;
    return m;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging_on,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                               fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)clock_update;
    (void)lock;
    (void)unlock;
    if (logger && logging_on)
        logger(environment, fmi3Error, "logStatusError", "fmi3InstantiateScheduledExecution: the model has no clocks");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { instance_free(c); }

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

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    if (instance_enter(c, PHASE_INITIALIZATION, __func__)) return fmi3Error;
    return (fmi3Status)instance_exit_initialization(c, __func__);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) { return (fmi3Status)instance_enter_event(c, __func__); }

fmi3Status fmi3Terminate(fmi3Instance c)
{
    Instance *m = c;
    if (instance_enter(m, PHASES_RUNNING, __func__)) return fmi3Error;
    m->core.phase = PHASE_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    if (instance_enter(c, PHASES_ALL, __func__)) return fmi3Error;
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
    if (instance_update(c, __func__, &changed)) return fmi3Error;
    /* the engine iterates to a fixed point itself: one call is enough */
    *need_update = *terminate = *nominals_changed = *next_event_defined = false;
    *states_changed = changed != 0;
    *next_event = 0.0;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c)
{
    return (fmi3Status)instance_enter(c, PHASE_INITIALIZATION | PHASE_EVENT, __func__);
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
    (void)vr;
    (void)values;
    (void)n_values;
    return (fmi3Status)variables_none(c, __func__, n, "of type Int32 that can be set");
}

/* variables of the types it has not */

#define NO_VARIABLES(type, value_type)                                                                                 \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, value_type values[],             \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)vr;                                                                                                      \
        (void)values;                                                                                                  \
        (void)n_values;                                                                                                \
        return (fmi3Status)variables_none(c, __func__, n, "of type " #type);                                           \
    }                                                                                                                  \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const value_type values[],       \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)vr;                                                                                                      \
        (void)values;                                                                                                  \
        (void)n_values;                                                                                                \
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
        (void)vr;                                                                                                      \
        return (fmi3Status)variables_none(c, __func__, n, kind);                                                       \
    }

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter" /* their whole purpose is to ignore what they are given */
#endif
NOTHING_TO(GetBinary, "of type Binary", size_t sizes[], fmi3Binary values[], size_t n_values)
NOTHING_TO(SetBinary, "of type Binary", const size_t sizes[], const fmi3Binary values[], size_t n_values)
NOTHING_TO(GetClock, "of type Clock", fmi3Clock values[])
NOTHING_TO(SetClock, "of type Clock", const fmi3Clock values[])
NOTHING_TO(GetIntervalDecimal, "of type Clock", fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NOTHING_TO(GetIntervalFraction, "of type Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[],
           fmi3IntervalQualifier qualifiers[])
NOTHING_TO(GetShiftDecimal, "of type Clock", fmi3Float64 shifts[])
NOTHING_TO(GetShiftFraction, "of type Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NOTHING_TO(SetIntervalDecimal, "of type Clock", const fmi3Float64 intervals[])
NOTHING_TO(SetIntervalFraction, "of type Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NOTHING_TO(SetShiftDecimal, "of type Clock", const fmi3Float64 shifts[])
NOTHING_TO(SetShiftFraction, "of type Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

/* a function whose capability flag in modelDescription.xml is false */
static fmi3Status not_provided(Instance *m, const char *function, const char *reason)
{
    return m ? (fmi3Status)instance_refuse(m, "%s: %s", function, reason) : fmi3Error;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n)
{
    (void)vr;
    (void)n;
    return not_provided(c, __func__,
                        "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t dependent_elements[],
                                       fmi3ValueReference independents[], size_t independent_elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent;
    (void)dependent_elements;
    (void)independents;
    (void)independent_elements;
    (void)kinds;
    (void)n;
    return not_provided(c, __func__,
                        "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    return not_provided(c, __func__, "the model has no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    return not_provided(c, __func__, "the model has no structural parameters");
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock;
    (void)time;
    return not_provided(c, __func__, "the model has no clocks");
}

/* FMU states and directional derivatives */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return (fmi3Status)fmu_state_get(c, __func__, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return (fmi3Status)fmu_state_set(c, __func__, state); }

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return (fmi3Status)fmu_state_free(c, __func__, state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    return (fmi3Status)fmu_state_serialized_size(c, __func__, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return (fmi3Status)fmu_state_serialize(c, __func__, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return (fmi3Status)fmu_state_deserialize(c, __func__, bytes, size, state);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    if (instance_enter(c, PHASES_ALL, __func__)) return fmi3Error;
    if (instance_same(c, __func__, n_knowns, n_seed) || instance_same(c, __func__, n_unknowns, n_sensitivity))
        return fmi3Error;
    return (fmi3Status)variables_directional(c, __func__, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    if (instance_enter(c, PHASES_ALL, __func__)) return fmi3Error;
    if (instance_same(c, __func__, n_unknowns, n_seed) || instance_same(c, __func__, n_knowns, n_sensitivity))
        return fmi3Error;
    return (fmi3Status)variables_adjoint(c, __func__, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

/* Model Exchange */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    Instance *m = c;
    int changed;
    if (instance_enter(m, PHASE_EVENT, __func__)) return fmi3Error;
    if (m->core.co_simulation) return not_provided(m, __func__, "Co-Simulation goes on with fmi3EnterStepMode");
    if (instance_update(m, __func__, &changed)) return fmi3Error;
    m->core.phase = PHASE_CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean *enter_event_mode,
                                       fmi3Boolean *terminate)
{
    (void)no_set_state;
    if (instance_enter(c, PHASE_CONTINUOUS, __func__)) return fmi3Error;
    if (instance_array(c, enter_event_mode, 1, __func__, "enterEventMode")) return fmi3Error;
    if (instance_array(c, terminate, 1, __func__, "terminateSimulation")) return fmi3Error;
    *enter_event_mode = *terminate = false;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { return (fmi3Status)instance_set_time(c, __func__, time); }

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    return (fmi3Status)instance_set_states(c, __func__, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n)
{
    return (fmi3Status)instance_derivatives(c, __func__, dx, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n)
{
    return (fmi3Status)instance_indicators(c, __func__, z, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    return (fmi3Status)instance_states(c, __func__, x, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    return (fmi3Status)instance_nominals(c, __func__, x, n);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_array(c, n, 1, __func__, "the number")) return fmi3Error;
    *n = MODEL_NI;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_array(c, n, 1, __func__, "the number")) return fmi3Error;
    *n = MODEL_NX;
    return fmi3OK;
}

/* Co-Simulation */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_output_derivatives(c, __func__, vr, n, orders, values);
}

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    Instance *m = c;
    int changed;
    if (instance_enter(m, PHASE_EVENT, __func__)) return fmi3Error;
    if (!m->core.co_simulation)
        return not_provided(m, __func__, "Model Exchange goes on with fmi3EnterContinuousTimeMode");
    if (instance_update(m, __func__, &changed)) return fmi3Error;
    m->core.phase = PHASE_STEP;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
                      fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_time)
{
    Instance *m = c;
    const void *results[] = {event_handling_needed, terminate, early_return, last_time};
    int event;
    (void)no_set_state;
    if (instance_enter(m, PHASE_STEP, __func__)) return fmi3Error;
    for (int i = 0; i < 4; i++)
        if (instance_array(m, results[i], 1, __func__, "a result")) return fmi3Error;
    *event_handling_needed = *terminate = *early_return = false;
    Status status = instance_step(m, __func__, time, step, m->event_mode_used && m->early_return_allowed, &event);
    *event_handling_needed = event != 0;
    *early_return = event && m->core.run.at.time < time + step;
    *last_time = m->core.run.at.time;
    return (fmi3Status)status;
}
