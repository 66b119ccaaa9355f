/*
 * Many runs over many steps of a section in one call. Nothing is allocated; runs know nothing of each other, unless one
 * begins where another ended, and of no instance that made others before: results do not depend on who makes them.
 *
 *     each run   reset; write its values; choose contact states
 *                step from section to section, with rows as journey.c fills them
 *     by the series of the engine (series_runs.c); strobes of a piecewise linear system in lanes (lane_runs.c); a map by
 *     its rule (map_runs.c)
 */
#include "ensemble.h"

#include "lane_runs.h"
#include "map_runs.h"
#include "series_runs.h"
#include "../model/traps.h"

int64_t stickslip_ensemble_room(int64_t n_directions) { return (int64_t)tangents_room((int)n_directions); }

int64_t stickslip_ensemble_memory(int64_t longest) { return arrival_numbers(longest); }

int64_t stickslip_lane_room(const void *stepper, int64_t longest) { return lane_runs_room(stepper, longest); }

int stickslip_ensemble(void *instance, Ensemble *e)
{
    TRAPS_REST;
    Instance *m = instance;
    if (!e || instance_enter(m, PHASES_ALL, __func__)) return STATUS_ERROR;
    if (!m->core.co_simulation) return instance_refuse(m, "%s: only for Co-Simulation", __func__);
    if (e->n_directions < 0 || e->n_directions > EXTENDED || (e->n_directions > 0 && !e->room))
        return instance_refuse(m, "%s: %lld directions are not possible", __func__, (long long)e->n_directions);
    if (lane_runs_possible(e)) return lane_runs(m, e);
    Job job = {.m = m, .e = e};
    for (int64_t chain = 0; chain < ensemble_chains(e); chain++) {
        for (int64_t i = chain; i < e->n_runs; i += ensemble_chains(e)) {
            Outcome outcome = journey_start(&job, i, e->memory);
            if (outcome == OUTCOME_FINISHED) outcome = MODEL_IS_MAP ? map_run(&job) : series_run(&job);
            journey_end(&job, outcome);
            if (outcome == OUTCOME_STOPPED) return STATUS_OK;
        }
    }
    return STATUS_OK;
}
