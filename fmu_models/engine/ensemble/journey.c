/*
 * One run of an ensemble between its steps.
 *
 *     rows     some steps that are not recorded, then rows of one or several steps each
 *              where the motion repeats itself: as many rows more as its period has, and no others
 *              where it has come to a known orbit: no more
 */
#include "journey.h"

#include <stdio.h>

#include "../events/contact_placement.h"
#include "../events/model_exchange.h"
#include "../events/run.h"
#include "../fmi/variables.h"
#include "../whole_run/restart.h"
#include "forcing.h"
#include "growth.h"
#include "lane_stepper.h"

/* of the size of a state: a start nearer to its level is on it, and does not cross it at once */
static const double ON_LEVEL = 1e-9;

enum { ENSEMBLE_WIDTH = MODEL_NX + MODEL_NC + ENSEMBLE_TIMES };

void journey_unit(const Job *job, int chosen, double (*directions)[EXTENDED])
{
    const int n = (int)job->e->n_directions;
    for (int k = 0; k < n; k++) {
        const int64_t along = job->e->along[k];
        const int64_t c = along - MODEL_NX;
        memset(directions[k], 0, sizeof directions[k]);
        if (chosen && along < MODEL_NX)
            tangents_read(job->e->room, k, directions[k]);
        else if (!chosen || c >= MODEL_NC || !job->m->core.run.entered[c]) /* else its memory is taken anew */
            directions[k][along] = 1.0;
    }
}

/* the first tangent along the motion, the others beside it */
static RunStatus journey_flow(Job *job)
{
    double rates[MODEL_ROOM(MODEL_NX)], growth[EXTENDED] = {0.0};
    const int n = (int)job->e->n_directions;
    if (exchange_derivatives(&job->m->core.run, rates) == RUN_ERROR) return RUN_ERROR;
    int most = 0; /* the unit vector nearest to it makes room */
    for (int i = 1; i < n && i < MODEL_NX; i++)
        most = fabs(rates[i]) > fabs(rates[most]) ? i : most;
    for (int k = most; k > 0; k--)
        memcpy(job->directions[k], job->directions[k - 1], sizeof job->directions[k]);
    memset(job->directions[0], 0, sizeof job->directions[0]);
    memcpy(job->directions[0], rates, MODEL_NX * sizeof *rates);
    growth_orthonormalize(job->directions[0], n, EXTENDED, EXTENDED, 0, growth);
    job->speed = growth_norm(rates, MODEL_NX);
    return RUN_OK;
}

/* the growth since this was done last, to that of the present row */
static void journey_add_growth(Job *job)
{
    const Ensemble *e = job->e;
    const int64_t row = journey_row(job);
    for (int k = 0; k < e->n_directions; k++) {
        if (row >= 0 && e->growth) e->growth[row * e->n_directions + k] += log(job->grown[k]);
        job->grown[k] = 1.0;
    }
}

void journey_grow(Job *job, const double *factors)
{
    int far = 0;
    for (int k = 0; k < job->e->n_directions; k++) {
        job->grown[k] *= factors[k];
        far |= !(job->grown[k] > 1.0 / GROWTH_FAR && job->grown[k] < GROWTH_FAR);
    }
    if (far) journey_add_growth(job);
}

void journey_differences(Job *job, double speed)
{
    const Ensemble *e = job->e;
    const int n = (int)e->n_directions;
    const int64_t row = journey_row(job);
    double unused[EXTENDED * EXTENDED], factors[EXTENDED];
    if (e->jacobians) {
        double *jacobian = row < 0 ? unused : e->jacobians + row * EXTENDED * n;
        for (int k = 0; k < n; k++)
            for (int i = 0; i < EXTENDED; i++)
                jacobian[i * n + k] = job->directions[k][i];
        journey_unit(job, 0, job->directions);
        return;
    }
    for (int k = 0; k < n; k++)
        factors[k] = 1.0;
    /* steps by series, and so motions to their last digits, depend on tangents; steps in lanes do not */
    growth_orthonormalize(job->directions[0], n, EXTENDED, job->length, job->walk.losing, factors);
    journey_grown(job, factors, speed);
}

void journey_begin_held(Job *job)
{
    Tangents *tangents = job->e->room;
    Run *r = &job->m->core.run;
    const int n = (int)job->e->n_directions;
    if (!job->e->jacobians || !journey_holds(r->at.state)) return;
    for (int k = 0; k < n; k++)
        tangents_place(r, tangents, k, job->directions[k]);
    tangents_begin_held(r, tangents);
    for (int k = 0; k < n; k++)
        tangents_read(tangents, k, job->directions[k]);
}

void journey_grown(Job *job, double *factors, double speed)
{
    if (job->e->flow) {
        factors[0] /= speed / job->speed;
        job->speed = speed;
    }
    journey_grow(job, factors);
}

void journey_make_tangents(const Job *job)
{
    const Ensemble *e = job->e;
    if (e->n_directions == 0 || MODEL_IS_MAP) return;
    tangents_start(e->room, &job->m->core.run, (int)e->n_directions);
    for (int k = 0; k < e->n_directions; k++)
        tangents_along(e->room, k, ALONG_STATE, e->along[k] < MODEL_NX ? (int)e->along[k] : 0);
}

/* whether the choice of contact states has moved the start of the run, and what lies beside it */
static int journey_moved(const Run *r)
{
    int moved = r->impact_phases > 0;
    for (int c = 0; c < MODEL_NC; c++)
        moved |= r->entered[c] || r->jumped[c] || r->projected[c];
    return moved;
}

/* start: where the run was before the choice of contact states. In lanes differences that this has left alone need no
   series yet, and mostly never will */
static Outcome journey_tangents(Job *job, const Point *start)
{
    Ensemble *e = job->e;
    Run *r = &job->m->core.run;
    const int repeated = !MODEL_IS_MAP && (!job->in_lanes || journey_moved(r));
    if (repeated) {
        const Point chosen = r->at;
        r->at = *start;
        journey_make_tangents(job);
        r->at = chosen;
        tangents_choose(r, e->room);
    }
    journey_unit(job, repeated, job->directions);
    if (e->flow && journey_flow(job) == RUN_ERROR) return OUTCOME_BROKEN;
    return OUTCOME_FINISHED;
}

/* differences that were lost on the way to where the motion stays say nothing of it: followed anew from there */
static RunStatus journey_renew(Job *job)
{
    const Ensemble *e = job->e;
    int lost = 0;
    for (int k = 0; k < e->n_directions; k++)
        lost |= !(growth_norm(job->directions[k], EXTENDED) > 0.0);
    if (!lost) return RUN_OK;
    journey_unit(job, 0, job->directions);
    return e->flow ? journey_flow(job) : RUN_OK;
}

/* a run that goes on with other parameters may be inside a rigid wall that these have moved: it is put onto it */
static void journey_onto_walls(Run *r)
{
    signed char inside[NC] = {0};
    int any = 0;
    run_parameters_changed(r);
    placement_load(r);
    for (int c = 0; c < MODEL_NC; c++) {
        inside[c] = (signed char)(model_contact_impulsive[c] && r->scratch.depth[c][0] > 0.0);
        any |= inside[c];
    }
    if (any) {
        placement_load_inertia(r);
        placement_on_walls(r, inside);
    }
}

static Outcome journey_place(Job *job, int64_t i)
{
    Ensemble *e = job->e;
    Instance *m = job->m;
    Run *r = &m->core.run;
    double x[MODEL_ROOM(MODEL_NX)], memory[NC];
    double time = e->starts[i];
    const int64_t before = i - e->follow;
    const int follows = e->follow && before >= 0 && e->outcomes[before] <= OUTCOME_ABSORBED;
    memcpy(x, r->at.x, sizeof x);
    memcpy(memory, r->at.memory, sizeof memory);
    if (follows && e->kind != SECTION_STROBE && e->periods[i] > 0.0)
        time = r->at.time / e->periods[before] * e->periods[i]; /* the phase is part of the point */
    const RunStart start = {e->n_set, e->set, e->values + i * e->n_set, time, e->tolerance};
    if (whole_run_enter_initialization(m, __func__, &start)) {
        run_fail(r, "%s", "a value that cannot be set");
        return OUTCOME_BROKEN;
    }
    if (follows) {
        memcpy(r->at.x, x, sizeof x);
        memcpy(r->at.memory, memory, sizeof memory);
    }
    if (follows || (before < 0 && e->resumed[i])) journey_onto_walls(r);
    job->walk = (Walk){.e = e, .run = i};
    if (e->kind == SECTION_LEVEL) {
        if (variables_locate(e->state, &job->walk.state) != STATE) {
            run_fail(r, "value reference %u is not a state", (unsigned)e->state);
            return OUTCOME_BROKEN;
        }
        double *q = &r->at.x[job->walk.state];
        *q = fabs(*q - e->level) * e->weights[job->walk.state] <= ON_LEVEL ? e->level : *q;
    }
    job->length = EXTENDED;
    for (int k = 0; k < EXTENDED; k++)
        job->grown[k] = 1.0;
    const Point start_point = r->at;
    if (run_initialize(r) == RUN_ERROR) return OUTCOME_BROKEN;
    /* one step says nothing of the next, unless by its derivative */
    const int repeats = e->kind == SECTION_STROBE && (e->jacobians || e->transient + e->n_rows * e->batch > 1);
    if (repeats && forcing_check(r, e->periods[i]) == RUN_ERROR) return OUTCOME_UNFIT;
    m->core.phase = PHASE_STEP;
    m->core.settled = 1;
    section_step_start(r, &job->walk);
    return e->n_directions > 0 ? journey_tangents(job, &start_point) : OUTCOME_FINISHED;
}

static void journey_begin_row(Job *job)
{
    const Ensemble *e = job->e;
    const int64_t row = journey_row(job);
    job->batched = 0;
    job->waited = 0.0;
    if (row >= 0 && e->growth && e->n_rows > 0)
        memset(e->growth + row * e->n_directions, 0, (size_t)e->n_directions * sizeof(double));
}

Outcome journey_start(Job *job, int64_t i, double *memory)
{
    Ensemble *e = job->e;
    job->run = i;
    job->wanted = e->n_rows;
    job->left = e->transient;
    e->rows[i] = e->steps[i] = 0;
    e->recurs[i] = 0;
    e->orbits[i] = -1;
    const Outcome outcome = journey_place(job, i);
    arrival_start(&job->arrival, e, memory);
    journey_begin_row(job);
    return outcome;
}

int64_t journey_row(const Job *job) { return job->left > 0 ? -1 : job->run * job->e->n_rows + job->e->rows[job->run]; }

static void journey_record(Job *job, const Place *at)
{
    Ensemble *e = job->e;
    Walk *w = &job->walk;
    const int64_t row = journey_row(job);
    section_step_close_row(at->state, at->time, w);
    journey_add_growth(job);
    if (row >= 0 && e->points) {
        double *point = e->points + row * ENSEMBLE_WIDTH;
        memcpy(point, at->x, MODEL_NX * sizeof *point);
        for (int c = 0; c < MODEL_NC; c++) {
            const int remembers = model_contact_remembers[c] && at->state[c] != CONTACT_AWAY;
            point[MODEL_NX + c] = remembers ? at->memory[c] : 0.0;
        }
        point[MODEL_NX + MODEL_NC] = at->time;
        point[MODEL_NX + MODEL_NC + 1] = job->waited;
    }
    if (row >= 0 && e->held) memcpy(e->held + row * MODEL_NC, w->held, MODEL_NC * sizeof(double));
    if (row >= 0 && e->began) memcpy(e->began + row * MODEL_NC, w->began, MODEL_NC * sizeof(int32_t));
    memset(w->held, 0, sizeof w->held);
    memset(w->began, 0, sizeof w->began);
}

int64_t journey_quiet(const Job *job)
{
    const Ensemble *e = job->e;
    if (job->left > 0) return e->longest > 0 || e->n_known > 0 ? 0 : job->left - 1;
    return e->batch - job->batched - 1;
}

void journey_pass(Job *job, int64_t steps)
{
    int64_t *counted = job->left > 0 ? &job->left : &job->batched;
    *counted += job->left > 0 ? -steps : steps;
    job->e->steps[job->run] += steps;
}

int journey_note(Job *job, const Place *at, double time, Outcome *outcome)
{
    Ensemble *e = job->e;
    const int64_t i = job->run;
    const int recording = job->left == 0;
    job->waited += time;
    e->steps[i]++;
    if (++job->batched < (recording ? e->batch : 1)) return 0;
    journey_record(job, at);
    e->rows[i] += recording;
    job->left -= !recording;
    if (!recording && job->left == 0 && !e->jacobians && e->n_directions > 0 && journey_renew(job) == RUN_ERROR) {
        *outcome = OUTCOME_BROKEN;
        return 1;
    }
    e->orbits[i] = e->n_known > 0 ? arrival_orbit(&job->arrival, at->x) : -1;
    if (e->orbits[i] >= 0) {
        *outcome = OUTCOME_ABSORBED;
        return 1;
    }
    if (e->recurs[i] == 0 && (e->recurs[i] = arrival_period(&job->arrival, at->x, at->time)) > 0) {
        job->wanted = e->recurs[i] < job->wanted ? e->recurs[i] : job->wanted;
        job->left = e->rows[i] = 0;
    }
    *outcome = e->recurs[i] > 0 ? OUTCOME_SETTLED : OUTCOME_FINISHED;
    if (job->left == 0 && e->rows[i] >= job->wanted) return 1;
    journey_begin_row(job);
    return 0;
}

void journey_end(const Job *job, Outcome outcome)
{
    Ensemble *e = job->e;
    char *message = e->messages + job->run * ENSEMBLE_MESSAGE;
    e->outcomes[job->run] = outcome;
    *message = '\0';
    if (outcome == OUTCOME_BROKEN || outcome == OUTCOME_UNFIT)
        snprintf(message, ENSEMBLE_MESSAGE, "%s", job->m->core.run.message);
}
