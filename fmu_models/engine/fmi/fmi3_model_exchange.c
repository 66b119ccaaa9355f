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
