/*
 * Many runs over many steps of a section in one call. Nothing is allocated; runs know nothing of each other, unless one
 * begins where the one before it ended, and of no instance that made others before: results do not depend on who makes
 * them.
 *
 *     each run   reset; write its values; choose contact states
 *                step from section to section, with rows as journey.c fills them
 *     strobes of a piecewise linear system without tangents are made in lanes (lane_runs.c)
 */
#include "ensemble.h"

#include "../events/model_exchange.h"
#include "growth.h"
#include "journey.h"
#include "lane_runs.h"

int64_t stickslip_ensemble_room(int64_t n_directions) { return (int64_t)tangents_room((int)n_directions); }

int64_t stickslip_ensemble_memory(int64_t longest) { return arrival_numbers(longest); }

int64_t stickslip_lane_room(const void *stepper, int64_t longest) { return lane_runs_room(stepper, longest); }

/* the growth of this step; the first direction along the motion grows as its speed does, which is taken out */
static Outcome ensemble_grow(Job *job, double *growth)
{
    double rates[MODEL_ROOM(MODEL_NX)];
    const Ensemble *e = job->e;
    growth_orthonormalize(job->directions[0], (int)e->n_directions, EXTENDED, job->walk.losing, growth);
    if (!e->flow) {
        return OUTCOME_FINISHED;
    }
    if (exchange_derivatives(&job->m->core.run, rates) == RUN_ERROR) {
        return OUTCOME_BROKEN;
    }
    const double speed = journey_norm(rates, MODEL_NX);
    growth[0] -= log(speed / job->speed);
    job->speed = speed;
    return OUTCOME_FINISHED;
}

/* the derivative of a step: its results by its starts, memories and time among them */
static void ensemble_jacobian(Job *job, double *jacobian)
{
    const int n = (int)job->e->n_directions;
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < EXTENDED; i++) {
            jacobian[i * n + k] = job->directions[k][i];
        }
    }
    journey_unit(job, 0, job->directions);
}

static Outcome ensemble_step(Job *job, int64_t row)
{
    Ensemble *e = job->e;
    Run *r = &job->m->core.run;
    const int64_t n = e->n_directions;
    if (n == 0) {
        return section_step(r, &job->walk);
    }
    Outcome outcome = section_step_tangents(r, &job->walk, e->room, (int)n, job->directions[0]);
    if (outcome != OUTCOME_FINISHED) {
        return outcome;
    }
    if (e->jacobians) {
        double unused[EXTENDED * EXTENDED];
        ensemble_jacobian(job, row < 0 ? unused : e->jacobians + row * EXTENDED * n);
        return OUTCOME_FINISHED;
    }
    double unused[EXTENDED];
    return ensemble_grow(job, row < 0 || !e->growth ? unused : e->growth + row * n);
}

static Outcome ensemble_walk(Job *job)
{
    const Ensemble *e = job->e;
    const Run *r = &job->m->core.run;
    if (e->transient == 0 && e->n_rows == 0) {
        return OUTCOME_FINISHED;
    }
    while (1) {
        if (e->stop && *(const volatile int32_t *)e->stop) {
            return OUTCOME_STOPPED;
        }
        Outcome outcome = ensemble_step(job, journey_row(job));
        if (outcome != OUTCOME_FINISHED) {
            return outcome;
        }
        const Place at = {r->at.x, r->at.memory, r->at.state, r->at.time};
        if (journey_note(job, &at, r->at.time - job->walk.since, &outcome)) {
            return outcome;
        }
    }
}

int stickslip_ensemble(void *instance, Ensemble *e)
{
    Instance *m = instance;
    if (!e || instance_enter(m, PHASES_ALL, __func__)) return STATUS_ERROR;
    if (!m->core.co_simulation) return instance_refuse(m, "%s: only for Co-Simulation", __func__);
    if (e->n_directions < 0 || e->n_directions > EXTENDED || (e->n_directions > 0 && !e->room))
        return instance_refuse(m, "%s: %lld directions are not possible", __func__, (long long)e->n_directions);
    if (lane_runs_possible(e)) {
        return lane_runs(m, e);
    }
    Job job = {.m = m, .e = e};
    for (; e->done < e->n_runs; e->done++) {
        Outcome outcome = journey_start(&job, e->done, e->memory);
        if (outcome == OUTCOME_FINISHED) outcome = ensemble_walk(&job);
        journey_end(&job, outcome);
        if (outcome == OUTCOME_STOPPED) break;
    }
    return STATUS_OK;
}
