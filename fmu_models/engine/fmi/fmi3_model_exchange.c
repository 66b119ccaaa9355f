/* The FMI 3.0 interface of an instance: Model Exchange. */
#include <string.h>

#include "fmi3_interface.h"

#include "instance.h"
#include "iteration.h"

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    Instance *m = c;
    int changed;
    if (instance_enter(m, PHASE_EVENT, __func__)) return fmi3Error;
    if (m->core.co_simulation)
        return (fmi3Status)instance_not_provided(m, __func__, "Co-Simulation goes on with fmi3EnterStepMode");
    if (iteration_update(m, __func__, &changed)) return fmi3Error;
    memset(m->core.ticks, 0, sizeof m->core.ticks);
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
    *n = MODEL_FLOWING;
    return fmi3OK;
}
