/* The FMI 3.0 interface of an instance: Co-Simulation. */
#include <string.h>

#include "fmi3_interface.h"

#include "co_simulation.h"
#include "iteration.h"
#include "variables.h"

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
        return (fmi3Status)instance_not_provided(m, __func__,
                                                 "Model Exchange goes on with fmi3EnterContinuousTimeMode");
    if (iteration_update(m, __func__, &changed)) return fmi3Error;
    memset(m->core.ticks, 0, sizeof m->core.ticks);
    m->core.phase = PHASE_STEP;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
                      fmi3Boolean *event_handling_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_time)
{
    Instance *m = c;
    const void *results[] = {event_handling_needed, terminate, early_return, last_time};
    StepEnd end;
    (void)no_set_state;
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
