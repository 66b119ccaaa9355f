/*
 * The step of Co-Simulation.
 *
 *     to the end of the communication step, or to the first event where the importer handles events and lets the FMU
 *     return early
 *     an importer that looks inside (FMI 3): after every step of the engine that ends before, and after every event, it
 *     reads what it wants, and may ask to return there, or at a time that it names
 */
#include <math.h>
#include <string.h>

#include "co_simulation.h"

#include "iteration.h"

#include "../events/run.h"
#include "../model/traps.h"

/* the run is shown at its present time; how far the step goes from there */
static double show_run(Instance *m, double end)
{
    Core *core = &m->core;
    const double now = core->run.at.time;
    double until = now;
    core->phase = PHASE_INTERMEDIATE;
    const int returns = m->show(m, m->early_return_allowed && now < end, &until);
    core->phase = PHASE_STEP;
    return returns && m->early_return_allowed ? fmin(end, fmax(now, until)) : end;
}

/* on to the end, or to where the importer asks to return: the motion is the same as at one stretch */
static RunStatus advance_shown(Instance *m, double end, int stop_at_event)
{
    Run *r = &m->core.run;
    for (;;) {
        r->pause_at = r->segment_valid ? r->steps : r->steps + 1;
        const RunStatus status = run_advance(r, end, 1, instance_note, m);
        r->pause_at = 0;
        if (status != RUN_EVENT && status != RUN_PAUSED) return status;
        end = show_run(m, end);
        if (status == RUN_EVENT && stop_at_event) return status;
        if (end <= r->at.time) return RUN_OK;
    }
}

Status co_simulation_step(Instance *m, const char *function, double time, double step, StepEnd *ended)
{
    TRAPS_REST;
    Core *core = &m->core;
    Run *r = &core->run;
    const double end = fmax(time + step, r->at.time);
    const double slack = INSTANCE_TIME_SLACK * step + 4.0 * DBL_EPSILON * fabs(time);
    const int stop_at_event = m->event_mode_used && m->early_return_allowed;
    *ended = (StepEnd){0, 0};
    if (!isfinite(time) || !isfinite(step) || !(step > 0.0))
        return instance_refuse(m, "%s: a step of %g s from time %g is not possible", function, step, time);
    if (fabs(time - r->at.time) > slack)
        return instance_refuse(m, "%s: the step starts at %.17g but the FMU is at %.17g", function, time, r->at.time);
    if (core->stop_defined && end > core->stop_time + slack)
        return instance_refuse(m, "%s: the step ends at %.17g, after the stop time %.17g", function, end,
                               core->stop_time);
    const long events = r->events;
    if (instance_settle(m, function, NULL)) return STATUS_ERROR;
    if (stop_at_event && r->events > events) { /* at the start itself */
        *ended = (StepEnd){1, 1};
        return STATUS_OK;
    }
    memset(core->ticks, 0, sizeof core->ticks);
    if (MODEL_IS_MAP) {
        int stepped;
        if (iteration_advance(m, function, end, stop_at_event, &stepped)) return STATUS_ERROR;
        *ended = (StepEnd){stepped, r->at.time < end};
        return STATUS_OK;
    }
    r->goal = end;
    const RunStatus status = m->intermediate ? advance_shown(m, end, stop_at_event)
                                             : run_advance(r, end, stop_at_event, instance_note, m);
    if (status == RUN_ERROR) return instance_failed(m, function);
    *ended = (StepEnd){status == RUN_EVENT, r->at.time < end};
    return STATUS_OK;
}
