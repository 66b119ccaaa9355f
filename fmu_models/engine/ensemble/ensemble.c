/*
 * Many runs over many steps of a section in one call. Nothing is allocated; runs know nothing of each other, unless one
 * begins where the one before it ended, and of no instance that made others before: results do not depend on who makes
 * them.
 *
 *     each run   reset; write its values; choose contact states
 *                step from section to section: some that are not recorded, then rows of one or several steps each
 *                where the motion repeats itself: as many rows more as its period has, and no others
 *                where it has come to a known orbit, or is lost: no more
 */
#include "ensemble.h"

#include <stdio.h>

#include "../events/model_exchange.h"
#include "../events/run.h"
#include "../fmi/variables.h"
#include "growth.h"
#include "known_orbits.h"
#include "section_step.h"

enum { ENSEMBLE_WIDTH = MODEL_NX + MODEL_NC + ENSEMBLE_TIMES };

/* one run on its way */
typedef struct {
    Instance *m;
    Ensemble *e;
    Walk walk;
    Arrival arrival;
    double directions[MODEL_ROOM(MODEL_NX + MODEL_NC + 1)][EXTENDED];
    double speed; /* of the motion, where the first tangent began */
} Job;

int64_t stickslip_ensemble_room(int64_t n_directions) { return (int64_t)tangents_room((int)n_directions); }

/* unit vectors: of the states as the choice of contact states has left them */
static void ensemble_unit(const Job *job, int chosen, double (*directions)[EXTENDED])
{
    const int n = (int)job->e->n_directions;
    for (int k = 0; k < n; k++) {
        const int64_t along = job->e->along[k];
        memset(directions[k], 0, sizeof directions[k]);
        if (chosen && along < MODEL_NX) {
            tangents_read(job->e->room, k, directions[k]);
        } else {
            directions[k][along] = 1.0;
        }
    }
}

int64_t stickslip_ensemble_memory(int64_t longest) { return arrival_numbers(longest); }

static double ensemble_norm(const double *v, int n)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        sum += v[i] * v[i];
    }
    return sqrt(sum);
}

/* the first tangent along the motion, the others beside it */
static RunStatus ensemble_flow(Job *job)
{
    double rates[MODEL_ROOM(MODEL_NX)];
    double growth[EXTENDED] = {0.0};
    const int n = (int)job->e->n_directions;
    if (exchange_derivatives(&job->m->core.run, rates) == RUN_ERROR) {
        return RUN_ERROR;
    }
    int most = 0; /* the unit vector nearest to it makes room */
    for (int i = 1; i < n && i < MODEL_NX; i++) {
        most = fabs(rates[i]) > fabs(rates[most]) ? i : most;
    }
    for (int k = most; k > 0; k--) {
        memcpy(job->directions[k], job->directions[k - 1], sizeof job->directions[k]);
    }
    memset(job->directions[0], 0, sizeof job->directions[0]);
    memcpy(job->directions[0], rates, MODEL_NX * sizeof *rates);
    growth_orthonormalize(job->directions[0], n, EXTENDED, 0, growth);
    job->speed = ensemble_norm(rates, MODEL_NX);
    return RUN_OK;
}

static Outcome ensemble_tangents(Job *job)
{
    Ensemble *e = job->e;
    tangents_choose(&job->m->core.run, e->room);
    ensemble_unit(job, 1, job->directions);
    if (e->flow && ensemble_flow(job) == RUN_ERROR) {
        return OUTCOME_BROKEN;
    }
    return OUTCOME_FINISHED;
}

/* differences that were lost on the way to where the motion stays say nothing of it: followed anew from there */
static RunStatus ensemble_renew(Job *job)
{
    const Ensemble *e = job->e;
    int lost = 0;
    for (int k = 0; k < e->n_directions; k++) {
        lost |= !(ensemble_norm(job->directions[k], EXTENDED) > 0.0);
    }
    if (!lost) {
        return RUN_OK;
    }
    ensemble_unit(job, 0, job->directions);
    return e->flow ? ensemble_flow(job) : RUN_OK;
}

static Outcome ensemble_start(Job *job, int64_t i)
{
    Ensemble *e = job->e;
    Instance *m = job->m;
    Run *r = &m->core.run;
    double x[MODEL_ROOM(MODEL_NX)];
    double memory[NC];
    const int follows = e->follow && i > 0 && e->outcomes[i - 1] <= OUTCOME_ABSORBED;
    memcpy(x, r->at.x, sizeof x);
    memcpy(memory, r->at.memory, sizeof memory);
    const RunStart start = {e->n_set, e->set, e->values + i * e->n_set, e->starts[i], e->tolerance};
    if (whole_run_enter_initialization(m, __func__, &start)) {
        run_fail(r, "%s", "a value that cannot be set");
        return OUTCOME_BROKEN;
    }
    if (follows) {
        memcpy(r->at.x, x, sizeof x);
        memcpy(r->at.memory, memory, sizeof memory);
    }
    if (e->n_directions > 0) {
        tangents_start(e->room, r, (int)e->n_directions);
        for (int k = 0; k < e->n_directions; k++) {
            tangents_along(e->room, k, ALONG_STATE, e->along[k] < MODEL_NX ? (int)e->along[k] : 0);
        }
    }
    if (run_initialize(r) == RUN_ERROR) return OUTCOME_BROKEN;
    m->core.phase = PHASE_STEP;
    m->core.settled = 1;
    job->walk = (Walk){.e = e, .run = i};
    if (e->kind == SECTION_LEVEL && variables_locate(e->state, &job->walk.state) != STATE) {
        run_fail(r, "value reference %u is not a state", (unsigned)e->state);
        return OUTCOME_BROKEN;
    }
    section_step_start(r, &job->walk);
    arrival_start(&job->arrival, e);
    return e->n_directions > 0 ? ensemble_tangents(job) : OUTCOME_FINISHED;
}

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
    const double speed = ensemble_norm(rates, MODEL_NX);
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
    ensemble_unit(job, 0, job->directions);
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

static void ensemble_record(Job *job, int64_t row, double waited)
{
    Ensemble *e = job->e;
    const Run *r = &job->m->core.run;
    section_step_close_row(r, &job->walk);
    if (row >= 0 && e->points) {
        double *point = e->points + row * ENSEMBLE_WIDTH;
        memcpy(point, r->at.x, MODEL_NX * sizeof *point);
        for (int c = 0; c < MODEL_NC; c++) {
            const int remembers = model_contact_remembers[c] && r->at.state[c] != CONTACT_AWAY;
            point[MODEL_NX + c] = remembers ? r->at.memory[c] : 0.0;
        }
        point[MODEL_NX + MODEL_NC] = r->at.time;
        point[MODEL_NX + MODEL_NC + 1] = waited;
    }
    if (row >= 0 && e->held) {
        memcpy(e->held + row * MODEL_NC, job->walk.held, MODEL_NC * sizeof(double));
    }
    if (row >= 0 && e->began) {
        memcpy(e->began + row * MODEL_NC, job->walk.began, MODEL_NC * sizeof(int32_t));
    }
    memset(job->walk.held, 0, sizeof job->walk.held);
    memset(job->walk.began, 0, sizeof job->walk.began);
}

static Outcome ensemble_walk(Job *job, int64_t i)
{
    Ensemble *e = job->e;
    const Run *r = &job->m->core.run;
    const int64_t first = i * e->n_rows;
    int64_t wanted = e->n_rows; /* rows */
    int64_t left = e->transient;
    while (left > 0 || e->rows[i] < wanted) {
        const int recording = left == 0;
        const int64_t row = recording ? first + e->rows[i] : -1;
        double waited = 0.0;
        if (recording && e->growth) {
            memset(e->growth + row * e->n_directions, 0, (size_t)e->n_directions * sizeof(double));
        }
        for (int64_t s = 0; s < (recording ? e->batch : 1); s++) {
            if (e->stop && *(const volatile int32_t *)e->stop) {
                return OUTCOME_STOPPED;
            }
            const Outcome outcome = ensemble_step(job, row);
            if (outcome != OUTCOME_FINISHED) {
                return outcome;
            }
            waited += r->at.time - job->walk.since;
            e->steps[i]++;
        }
        ensemble_record(job, row, waited);
        e->rows[i] += recording;
        left -= !recording;
        if (!recording && left == 0 && !e->jacobians && ensemble_renew(job) == RUN_ERROR) {
            return OUTCOME_BROKEN;
        }
        e->orbits[i] = e->n_known > 0 ? arrival_orbit(&job->arrival, r) : -1;
        if (e->orbits[i] >= 0) {
            return OUTCOME_ABSORBED;
        }
        if (e->recurs[i] == 0 && (e->recurs[i] = arrival_period(&job->arrival, r)) > 0) {
            wanted = e->recurs[i] < wanted ? e->recurs[i] : wanted;
            left = e->rows[i] = 0;
        }
    }
    return e->recurs[i] > 0 ? OUTCOME_SETTLED : OUTCOME_FINISHED;
}

int stickslip_ensemble(void *instance, Ensemble *e)
{
    Instance *m = instance;
    if (!e || instance_enter(m, PHASES_ALL, __func__)) return STATUS_ERROR;
    if (!m->core.co_simulation) return instance_refuse(m, "%s: only for Co-Simulation", __func__);
    if (e->n_directions < 0 || e->n_directions > EXTENDED || (e->n_directions > 0 && !e->room))
        return instance_refuse(m, "%s: %lld directions are not possible", __func__, (long long)e->n_directions);
    Job job = {.m = m, .e = e};
    for (; e->done < e->n_runs; e->done++) {
        const int64_t i = e->done;
        e->rows[i] = e->steps[i] = 0;
        e->recurs[i] = 0;
        e->orbits[i] = -1;
        Outcome outcome = ensemble_start(&job, i);
        if (outcome == OUTCOME_FINISHED) outcome = ensemble_walk(&job, i);
        e->outcomes[i] = outcome;
        const char *message = outcome == OUTCOME_BROKEN ? m->core.run.message : "";
        snprintf(e->messages + i * ENSEMBLE_MESSAGE, ENSEMBLE_MESSAGE, "%s", message);
        if (outcome == OUTCOME_STOPPED) break;
    }
    return STATUS_OK;
}
