/* Steps of a run by the series of the engine. */
#include "series_runs.h"

#include "../events/model_exchange.h"
#include "growth.h"

Outcome series_step(Job *job)
{
    double rates[MODEL_ROOM(MODEL_NX)];
    const Ensemble *e = job->e;
    Run *r = &job->m->core.run;
    if (e->n_directions == 0) return section_step(r, &job->walk);
    const Outcome outcome = section_step_tangents(r, &job->walk, e->room, (int)e->n_directions, job->directions[0],
                                                  e->jacobians ? NULL : job->grown);
    if (outcome != OUTCOME_FINISHED) return outcome;
    if (e->flow && exchange_derivatives(r, rates) == RUN_ERROR) return OUTCOME_BROKEN;
    journey_differences(job, e->flow ? growth_norm(rates, MODEL_NX) : 0.0);
    journey_begin_held(job);
    return OUTCOME_FINISHED;
}

Outcome series_run(Job *job)
{
    const Ensemble *e = job->e;
    const Run *r = &job->m->core.run;
    if (e->transient == 0 && e->n_rows == 0) return OUTCOME_FINISHED;
    while (1) {
        if (e->stop && *(const volatile int32_t *)e->stop) return OUTCOME_STOPPED;
        Outcome outcome = series_step(job);
        if (outcome != OUTCOME_FINISHED) return outcome;
        const Place at = {r->at.x, r->at.memory, r->at.state, r->at.time};
        if (journey_note(job, &at, r->at.time - job->walk.since, &outcome)) return outcome;
    }
}
