/* The FMI 2.0 interface of an instance: Model Exchange and Co-Simulation (fmi-standard.org, FMI 2.0.5). */
#ifndef FMI2_OVERRIDE_FUNCTION_PREFIX
#define FMI2_OVERRIDE_FUNCTION_PREFIX
#endif
#include "fmi2Functions.h"

#include "co_simulation.h"
#include "fmu_state.h"
#include "iteration.h"
#include "variables.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter" /* the standard hands over more than is asked for here */

/* statuses, value references and integers are passed through as they are */
_Static_assert((int)fmi2OK == STATUS_OK && (int)fmi2Error == STATUS_ERROR, "numbers of fmi2Status");
_Static_assert(sizeof(fmi2ValueReference) == sizeof(uint32_t) && sizeof(fmi2Integer) == sizeof(int32_t),
               "sizes of FMI 2 types");

static void say(Instance *m, Status status, const char *category, const char *message)
{
    fmi2CallbackLogger logger = (fmi2CallbackLogger)m->logger;
    /* the message is the format: importers that do not expand one show it whole; our messages hold no '%' */
    logger(m->environment, m->name, (fmi2Status)status, category, message);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging_on)
{
    void (*logger)(void) = functions ? (void (*)(void))functions->logger : NULL;
    void *environment = functions ? functions->componentEnvironment : NULL;
    Instance *m = instance_new(name, guid, type == fmi2CoSimulation, say, logger, environment, logging_on, 0);
    if (m) m->input_order = MODEL_INPUT_DEGREE;
    return m;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean stop_defined, fmi2Real stop_time)
{
    if (instance_enter(c, PHASE_INSTANTIATED, __func__)) return fmi2Error;
    return (fmi2Status)instance_set_up(c, __func__, tolerance_defined, tolerance, start_time, stop_defined, stop_time);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Instance *m = c;
    if (instance_enter(m, PHASE_INSTANTIATED, __func__)) return fmi2Error;
    m->core.phase = PHASE_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    if (instance_enter(c, PHASES_ALL, __func__)) return fmi2Error;
    return (fmi2Status)instance_reset(c);
}

#define FMI_NAME(name) fmi2##name
#define FMI_STATE(before, after) fmi2##before##FMUstate##after
#define FMI_INSTANCE fmi2Component
#define FMI_DESERIALIZE fmi2DeSerializeFMUstate
#define DERIVATIVES fmi2GetDerivatives
#include "shared_calls.h"

/* variables */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    return (fmi2Status)variables_get(c, __func__, vr, n, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    return (fmi2Status)variables_get_contacts(c, __func__, vr, n, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    return (fmi2Status)variables_set(c, __func__, vr, n, value);
}

#define NO_VARIABLES(Name, type, kind)                                                                                 \
    fmi2Status fmi2##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type value[])                      \
    {                                                                                                                  \
        return (fmi2Status)variables_none(c, __func__, n, kind);                                                       \
    }

NO_VARIABLES(GetBoolean, fmi2Boolean, "of type Boolean")
NO_VARIABLES(GetString, fmi2String, "of type String")
NO_VARIABLES(SetInteger, const fmi2Integer, "of type Integer that can be set")
NO_VARIABLES(SetBoolean, const fmi2Boolean, "of type Boolean")
NO_VARIABLES(SetString, const fmi2String, "of type String")

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    return (fmi2Status)variables_directional(c, __func__, unknown, n_unknown, known, n_known, seed, sensitivity);
}

/* Model Exchange */

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    int changed;
    if (instance_enter(c, PHASE_EVENT, __func__) || instance_array(c, info, 1, __func__, "event info"))
        return fmi2Error;
    if (iteration_update(c, __func__, &changed)) return fmi2Error;
    /* the engine iterates to a fixed point itself: one call is enough */
    const double next = iteration_next(&((Instance *)c)->core);
    *info = (fmi2EventInfo){fmi2False, fmi2False, fmi2False, changed, isfinite(next), isfinite(next) ? next : 0.0};
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    Instance *m = c;
    int changed;
    if (instance_enter(m, PHASE_EVENT, __func__) || iteration_update(m, __func__, &changed)) return fmi2Error;
    m->core.phase = PHASE_CONTINUOUS;
    return fmi2OK;
}

/* Co-Simulation */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    return (fmi2Status)variables_set_input_derivatives(c, __func__, vr, n, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    return (fmi2Status)variables_output_derivatives(c, __func__, vr, n, order, value);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_set_state)
{
    StepEnd end;
    if (instance_enter(c, PHASE_STEP, __func__)) return fmi2Error;
    return (fmi2Status)co_simulation_step(c, __func__, time, step, &end);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return c ? (fmi2Status)instance_refuse(c, "%s: steps are never asynchronous", __func__) : fmi2Error;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    Instance *m = c;
    if (instance_enter(m, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED, __func__)) return fmi2Error;
    if (instance_array(m, value, 1, __func__, "value")) return fmi2Error;
    if (kind != fmi2LastSuccessfulTime)
        return (fmi2Status)instance_refuse(m, "%s: no status of kind %d", __func__, (int)kind);
    *value = m->core.run.at.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    Instance *m = c;
    if (instance_enter(m, PHASE_STEP | PHASE_TERMINATED | PHASE_FAILED, __func__)) return fmi2Error;
    if (instance_array(m, value, 1, __func__, "value")) return fmi2Error;
    if (kind != fmi2Terminated) return (fmi2Status)instance_refuse(m, "%s: no status of kind %d", __func__, (int)kind);
    *value = fmi2False;
    return fmi2OK;
}

/* statuses that only asynchronous steps have */
#define NO_STATUS(Name, type)                                                                                          \
    fmi2Status fmi2##Name(fmi2Component c, const fmi2StatusKind kind, type *value)                                     \
    {                                                                                                                  \
        return c ? (fmi2Status)instance_refuse(c, "%s: no status of kind %d: steps are never asynchronous", __func__,  \
                                               (int)kind)                                                              \
                 : fmi2Error;                                                                                          \
    }

NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetStringStatus, fmi2String)

#pragma GCC diagnostic pop
