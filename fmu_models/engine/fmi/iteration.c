/* The steps of a map. Contract in iteration.h. */
#include <math.h>
#include <string.h>

#include "iteration.h"
#include "../model/traps.h"

/* importers add up their steps: the time of one may be missed by this fraction of the period */
#define ITERATION_SLACK 1e-9

double iteration_next(Core *core)
{
    TRAPS_REST;
    if (!MODEL_IS_MAP) return core->co_simulation ? INFINITY : core->run.tick;
    const double period = model_period(core->run.at.p);
    if (period != core->period) {
        core->first_step += (double)core->iterations * core->period;
        core->iterations = 0;
        core->period = period;
    }
    return core->first_step + (double)(core->iterations + 1) * period;
}

static int is_due(Core *core, double time) { return iteration_next(core) <= time + ITERATION_SLACK * core->period; }

static Status catch_up(Instance *m, const char *function)
{
    Run *r = &m->core.run;
    double next[MODEL_ROOM(MODEL_NX)];
    while (MODEL_IS_MAP && is_due(&m->core, r->at.time)) {
        model_iterate(r->at.p, r->at.x, next);
        for (int i = 0; i < MODEL_NX; i++) {
            if (!isfinite(next[i])) {
                run_fail(r, "the rule gives state %d no finite value", i);
                return instance_failed(m, function);
            }
        }
        memcpy(r->at.x, next, sizeof next);
        m->core.iterations++;
        run_touched(r);
    }
    return STATUS_OK;
}

Status iteration_update(Instance *m, const char *function, int *changed)
{
    TRAPS_REST;
    return instance_update(m, function, changed) ? STATUS_ERROR : catch_up(m, function);
}

Status iteration_advance(Instance *m, const char *function, double end, int stop_at_event, int *event)
{
    TRAPS_REST;
    Run *r = &m->core.run;
    *event = 0;
    while (is_due(&m->core, end)) {
        r->at.time = fmin(iteration_next(&m->core), end);
        if (stop_at_event) {
            *event = 1;
            return STATUS_OK;
        }
        if (catch_up(m, function)) return STATUS_ERROR;
    }
    r->at.time = end;
    return STATUS_OK;
}
