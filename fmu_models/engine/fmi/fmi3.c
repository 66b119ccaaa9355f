/* The FMI 3.0 interface of an instance: its life, in Model Exchange and Co-Simulation (fmi-standard.org, FMI 3.0.2). */
#include "fmi3_interface.h"

#include "fmu_state.h"
#include "iteration.h"
#include "variables.h"

/* statuses and integers are passed through as they are */
_Static_assert((int)fmi3OK == STATUS_OK && (int)fmi3Error == STATUS_ERROR, "numbers of fmi3Status");

static void say(Instance *m, Status status, const char *category, const char *message)
{
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)m->logger;
    logger(m->environment, (fmi3Status)status, category, message);
}

/* a Show: inputs go on at their rates, so that none are asked for */
static int show(Instance *m, int can_return, double *until)
{
    fmi3IntermediateUpdateCallback update = (fmi3IntermediateUpdateCallback)m->intermediate;
    fmi3Boolean returns = false;
    update(m->environment, m->core.run.at.time, false, true, true, can_return != 0, &returns, until);
    return returns;
}

const char *fmi3GetVersion(void) { return fmi3Version; }

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
    Instance *m = instance_new(name, token, 1, say, (void (*)(void))logger, environment, logging_on, 1);
    if (!m) return NULL;
    for (size_t k = 0; intermediate && k < n_intermediate; k++)
        if (!variables_is_intermediate(intermediate[k])) {
            instance_refuse(m, "%s: value reference %u cannot be accessed inside a step", __func__,
                            (unsigned)intermediate[k]);
            instance_free(m);
            return NULL;
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
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)clock_update;
    (void)lock;
    (void)unlock;
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
    *next_event_defined = MODEL_IS_MAP;
    *next_event = MODEL_IS_MAP ? iteration_next(&((Instance *)c)->core) : 0.0;
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
    (void)clock;
    (void)time;
    return (fmi3Status)instance_not_provided(c, __func__, "the model has no input clocks");
}
