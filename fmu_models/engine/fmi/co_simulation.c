/*
 * The step of Co-Simulation.
 *
 *     to the end of the communication step, or to the first event where the importer handles events and lets the FMU
 *     return early
 *     an importer that looks inside (FMI 3): after every step of the engine that ends before, and after every event, it
 *     reads what it wants, and may ask to return there, or at a time that it names; if it has said that it gives inputs,
 *     it is asked for them first, at some times ahead, and they follow a cubic
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
    const int returns = m->show(m, now, 0, m->early_return_allowed && now < end, &until);
    core->phase = PHASE_STEP;
    return returns && m->early_return_allowed ? fmin(end, fmax(now, until)) : end;
}

/* where in a step an importer is asked for inputs: with the start the points of Radau, so that cubics through them keep
   three moments of inputs that are none; the end would be that of a value before a jump or behind it */
enum { ASKED = 3 };
static const double asked_at[ASKED] = {0.21234053823915294, 0.59053313555926534, 0.91141204048729611};

/* an input follows the cubic through its value and what it is beyond its line at these places; 1 if it changes */
static int bend_input(Point *at, int i, const double *beyond, double step)
{
    const double *s = asked_at;
    const double size = fabs(at->u[i]) + fabs(at->du[i]) * step;
    double slope[ASKED], largest = 0.0;
    for (int k = 0; k < ASKED; k++) {
        slope[k] = beyond[k] / s[k];
        largest = fmax(largest, fabs(beyond[k]));
    }
    if (largest <= 8.0 * DBL_EPSILON * size) return 0;
    const double first = (slope[1] - slope[0]) / (s[1] - s[0]);
    const double second = ((slope[2] - slope[1]) / (s[2] - s[1]) - first) / (s[2] - s[0]);
    at->du[i] += (slope[0] - first * s[0] + second * s[0] * s[1]) / step;
    at->bend[i][0] = 2.0 * (first - second * (s[0] + s[1])) / (step * step);
    at->bend[i][1] = 6.0 * second / (step * step * step);
    return at->curved = 1;
}

/* ask the importer for the inputs of a step; one that it does not give goes on at its rate, or stays at the last given */
static void ask_inputs(Instance *m, double step)
{
    Point *at = &m->core.run.at;
    double beyond[MODEL_ROOM(MODEL_NU)][ASKED], until;
    int changed = at->curved;
    at->curved = 0;
    memset(at->bend, 0, sizeof at->bend);
    for (int i = 0; i < MODEL_SET_INPUTS; i++)
        m->asked[i] = NAN;
    m->core.phase = PHASE_INTERMEDIATE;
    m->asking = 1;
    for (int k = 0; k < ASKED; k++) {
        m->show(m, at->time + asked_at[k] * step, 1, 0, &until);
        for (int i = 0; i < MODEL_SET_INPUTS; i++) {
            const double line = at->u[i] + at->du[i] * asked_at[k] * step;
            beyond[i][k] = isnan(m->asked[i]) ? 0.0 : m->asked[i] - line;
        }
    }
    m->asking = 0;
    m->core.phase = PHASE_STEP;
    for (int i = 0; i < MODEL_SET_INPUTS; i++)
        changed |= bend_input(at, i, beyond[i], step);
    if (!changed) return;
    run_touched(&m->core.run);
    m->core.settled = 0;
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
    if (m->takes_inputs && m->intermediate) ask_inputs(m, end - r->at.time);
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
