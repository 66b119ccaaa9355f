/*
 * Strobes of many motions at once.
 *
 *     some runs at a time, each as if it were alone
 *         all that go on:   a period in lanes, or several of which only the last is looked at; events that these leave the
 *                           engine decides on the way
 *         the undecided:    the same period by the series of the engine, from the same point
 *         each:             rows, repetition and orbits (journey.c); where a run is over the next of its chain goes on
 *                           from there, and where that is over the first of another takes its place
 *
 * Which steps are made by series depends on the motion alone, not on its neighbours: so do results.
 */
#include "lane_runs.h"

#include "../events/run.h"
#include "../events/transition.h"
#include "../fmi/variables.h"
#include "lane_stepper.h"
#include "series_runs.h"

enum {
    LANE_RUNS_TOGETHER = 64,             /* their numbers stay near the processor */
    LANE_RUNS_PATIENCE = 64,             /* periods before the caller may say again that it has had enough */
    TANGENTS = MODEL_NX * (MODEL_NX + 1) /* numbers of the differences of one motion and their growth, at most */
};

/* what the engine knows of a motion beside its point, from one of its own steps to the next */
typedef struct {
    double settles[NC];
    Closings closings[NC];
    signed char known[NC][SLOTS];
} Kept;

typedef struct {
    Job job[LANE_RUNS_TOGETHER];
    LaneMotion motion[LANE_RUNS_TOGETHER];
    Kept kept[LANE_RUNS_TOGETHER];
    int series[LANE_RUNS_TOGETHER]; /* its last step was made by series */
    /* the same of the events that lanes have left to the engine in a period of the present call */
    Kept met[LANE_RUNS_TOGETHER];
    int32_t asked[LANE_RUNS_TOGETHER]; /* the last period of this call with such: 1, 2, ...; 0: none */
    int64_t loaded;                    /* the run whose numbers the instance has; -1: none */
    int64_t series_of;                 /* and that whose constants the series of tangents have */
    int64_t begun;                     /* chains of runs */
    int64_t width;                     /* of the stepper, whose differences and their growth these are */
    double *tangents, *growth;
} Together;

/* where numbers of a motion begin, so many each: motions of a vector are beside each other */
static int64_t column_of(const Together *t, int slot, int64_t each)
{
    return slot / t->width * t->width * each + slot % t->width;
}

static int64_t in_lines(int64_t bytes) { return (bytes + 63) / 64 * 64; }

static const LaneStepper *stepper_of(const void *stepper)
{
    const LaneStepper *s = stepper;
    return s && s->version == LANE_STEPPER_VERSION && strcmp(s->token, MODEL_TOKEN) == 0 ? s : NULL;
}

/* whether a difference begins along what is no state */
static int beside_states(const Ensemble *e)
{
    int found = e->n_directions > MODEL_NX;
    for (int64_t k = 0; k < e->n_directions; k++)
        found |= e->along[k] >= MODEL_NX;
    return found;
}

int lane_runs_possible(const Ensemble *e)
{
    return stepper_of(e->lanes) && e->kind == SECTION_STROBE && !beside_states(e) && e->n_rows + e->transient > 0;
}

int64_t lane_runs_room(const void *stepper, int64_t longest)
{
    const LaneStepper *s = stepper_of(stepper);
    if (!s) return 0;
    return in_lines(sizeof(Together))
           + in_lines(LANE_RUNS_TOGETHER * arrival_numbers(longest) * (int64_t)sizeof(double))
           + in_lines(LANE_RUNS_TOGETHER * TANGENTS * (int64_t)sizeof(double)) + s->room(LANE_RUNS_TOGETHER);
}

/* the motion of the run, which has just been placed or stepped by series */
static void take(const Run *r, const Job *job, LaneMotion *motion, Kept *kept)
{
    memcpy(motion->x, r->at.x, MODEL_NX * sizeof *motion->x);
    memcpy(motion->memory, r->at.memory, sizeof motion->memory);
    memcpy(motion->state, r->at.state, sizeof motion->state);
    memcpy(motion->held, job->walk.held, sizeof motion->held);
    memcpy(motion->since, job->walk.contact_since, sizeof motion->since);
    memcpy(motion->began, job->walk.began, sizeof motion->began);
    memcpy(kept->settles, r->at.settles, sizeof kept->settles);
    memcpy(kept->closings, r->closings, sizeof kept->closings);
    memcpy(kept->known, r->at.known, sizeof kept->known);
}

/* the run where a motion is, so long after the strobe; kept: NULL if nothing is */
static RunStatus give(Together *t, int64_t slot, const LaneMotion *motion, double time, const Kept *kept)
{
    Job *job = &t->job[slot];
    const Ensemble *e = job->e;
    Run *r = &job->m->core.run;
    if (t->loaded != job->run) {
        job->m->core.phase = PHASE_INITIALIZATION;
        if (variables_set(job->m, __func__, e->set, (size_t)e->n_set, e->values + job->run * e->n_set))
            return run_fail(r, "%s", "a value that cannot be set");
        job->m->core.phase = PHASE_STEP;
        job->m->core.settled = 1;
        t->loaded = job->run;
        run_parameters_changed(r);
    }
    run_touched(r);
    r->at.time = time;
    r->at.time_rest = 0.0;
    memcpy(r->at.x, motion->x, MODEL_NX * sizeof *motion->x);
    memcpy(r->at.memory, motion->memory, sizeof motion->memory);
    memcpy(r->at.state, motion->state, sizeof motion->state);
    memcpy(job->walk.held, motion->held, sizeof motion->held);
    memcpy(job->walk.contact_since, motion->since, sizeof motion->since);
    memcpy(job->walk.began, motion->began, sizeof motion->began);
    memset(r->at.settles, 0, sizeof r->at.settles);
    memset(r->closings, 0, sizeof r->closings);
    if (kept) {
        memcpy(r->at.settles, kept->settles, sizeof r->at.settles);
        memcpy(r->closings, kept->closings, sizeof r->closings);
        memcpy(r->at.known, kept->known, sizeof r->at.known);
    }
    run_resume(r);
    return RUN_OK;
}

/* the outcome of a step as section_step.c has it */
static Outcome bounded(const Ensemble *e, const double *x)
{
    for (int i = 0; i < MODEL_NX; i++)
        if (!(fabs(x[i]) <= e->bound)) return OUTCOME_ESCAPED;
    return OUTCOME_FINISHED;
}

/* differences of a motion into the room of the stepper, and back */
static void give_tangents(const Together *t, int slot)
{
    const Job *job = &t->job[slot];
    double *column = t->tangents + column_of(t, slot, job->e->n_directions * MODEL_NX);
    for (int64_t k = 0; k < job->e->n_directions; k++)
        for (int i = 0; i < MODEL_NX; i++)
            column[(k * MODEL_NX + i) * t->width] = job->directions[k][i];
}

static void take_tangents(Together *t, int slot)
{
    Job *job = &t->job[slot];
    const double *column = t->tangents + column_of(t, slot, job->e->n_directions * MODEL_NX);
    for (int64_t k = 0; k < job->e->n_directions; k++)
        for (int i = 0; i < MODEL_NX; i++)
            job->directions[k][i] = column[(k * MODEL_NX + i) * t->width];
}

/* series of tangents of the run whose numbers the instance has */
static void prepare_series(Together *t, const Job *job)
{
    if (t->series_of != job->run) journey_make_tangents(job);
    t->series_of = job->run;
}

/* one period by series, of a motion that lanes have not decided */
static Outcome step_by_series(Together *t, int slot)
{
    Job *job = &t->job[slot];
    if (give(t, slot, &t->motion[slot], 0.0, t->series[slot] ? &t->kept[slot] : NULL) == RUN_ERROR)
        return OUTCOME_BROKEN;
    prepare_series(t, job);
    take_tangents(t, slot);
    const Outcome outcome = series_step(job);
    give_tangents(t, slot);
    take(&job->m->core.run, job, &t->motion[slot], &t->kept[slot]);
    t->series[slot] = 1;
    return outcome;
}

/* whether a step in lanes begins with these states: the last bounces of a chatter are none of its modes */
static int is_settled(const Run *r)
{
    for (int c = 0; c < MODEL_NC; c++)
        if (r->at.state[c] == CONTACT_CHATTERING) return 0;
    return 1;
}

/* an event that lanes leave to the engine */
static int resolve(void *context, int64_t slot, LaneMotion *motion, LaneEvent *event)
{
    Together *t = context;
    Job *job = &t->job[slot];
    Run *r = &job->m->core.run;
    const double end = job->e->periods[job->run];
    const Kept *met = t->asked[slot] == motion->made + 1 ? &t->met[slot] : NULL;
    if (give(t, slot, motion, event->time, met) == RUN_ERROR) return 0;
    memcpy(r->falling, event->falls, sizeof r->falling);
    if (transition_resolve(r, section_step_note, &job->walk) == RUN_ERROR) return 0;
    r->goal = end;
    while (!is_settled(r) && r->at.time < end)
        if (run_advance(r, end, 1, section_step_note, &job->walk) == RUN_ERROR) return 0;
    if (!is_settled(r)) return 0;
    take(r, job, motion, &t->met[slot]);
    t->asked[slot] = motion->made + 1;
    memcpy(event->known, r->at.known, sizeof event->known);
    event->time = r->at.time;
    return 1;
}

/* periods that all motions can make before somebody asks for more than how many they were */
static int64_t periods_of(const Together *t, const Ensemble *e, int together)
{
    int64_t quiet = e->jacobians || e->flow ? 0 : LANE_RUNS_PATIENCE - 1;
    for (int slot = 0; slot < together && quiet > 0; slot++) {
        const int64_t one = t->motion[slot].wanted ? journey_quiet(&t->job[slot]) : quiet;
        quiet = one < quiet ? one : quiet;
    }
    return quiet + 1;
}

/* the growth of differences up to now into the room of the stepper */
static void give_growth(const Together *t, int slot)
{
    const Job *job = &t->job[slot];
    double *column = t->growth + column_of(t, slot, job->e->n_directions);
    for (int64_t k = 0; k < job->e->n_directions; k++)
        column[k * t->width] = job->grown[k];
}

/* what differences have come to by steps in lanes */
static void note_tangents(Together *t, int slot)
{
    Job *job = &t->job[slot];
    const Ensemble *e = job->e;
    const double *column = t->growth + column_of(t, slot, e->n_directions);
    double factors[EXTENDED];
    if (e->jacobians) {
        take_tangents(t, slot);
        journey_differences(job, 0.0);
        if (journey_holds(t->motion[slot].state) && give(t, slot, &t->motion[slot], 0.0, NULL) == RUN_OK) {
            prepare_series(t, job);
            journey_begin_held(job);
        }
        give_tangents(t, slot);
        return;
    }
    for (int64_t k = 0; k < e->n_directions; k++) {
        factors[k] = column[k * t->width];
        job->grown[k] = 1.0;
    }
    journey_grown(job, factors, t->motion[slot].speed);
}

/* what comes of the last of so many steps that a motion has made, the others in lanes; 1 if its run is over */
static int step_made(Together *t, int slot, int64_t steps, Outcome *outcome)
{
    Job *job = &t->job[slot];
    Ensemble *e = job->e;
    LaneMotion *motion = &t->motion[slot];
    const int decided = motion->made == steps;
    if (e->in_lanes) e->in_lanes[job->run] += motion->made;
    journey_pass(job, steps - 1);
    for (int64_t k = 1; k < steps && job->left == 0; k++)
        job->waited += e->periods[job->run];
    *outcome = decided ? bounded(e, motion->x) : OUTCOME_FINISHED;
    if (*outcome != OUTCOME_FINISHED) return 1;
    if (motion->made > 0) t->series[slot] = 0;
    if (motion->made > 0 && e->n_directions > 0) note_tangents(t, slot);
    if (!decided && (*outcome = step_by_series(t, slot)) != OUTCOME_FINISHED) return 1;
    memcpy(job->walk.held, motion->held, sizeof motion->held);
    memcpy(job->walk.contact_since, motion->since, sizeof motion->since);
    memcpy(job->walk.began, motion->began, sizeof motion->began);
    const int renews = job->left == 1 && e->n_directions > 0; /* journey_note may begin differences anew */
    if (renews) take_tangents(t, slot);
    if (renews && e->flow && give(t, slot, motion, 0.0, t->series[slot] ? &t->kept[slot] : NULL) == RUN_ERROR) {
        *outcome = OUTCOME_BROKEN;
        return 1;
    }
    const Place at = {motion->x, motion->memory, motion->state, 0.0};
    const int over = journey_note(job, &at, e->periods[job->run], outcome);
    if (renews) give_tangents(t, slot);
    memcpy(motion->held, job->walk.held, sizeof motion->held);
    memcpy(motion->since, job->walk.contact_since, sizeof motion->since);
    memcpy(motion->began, job->walk.began, sizeof motion->began);
    return over;
}

/* the run after this one in its chain, or the first of another; as many as there are: none is left */
static int64_t run_after(Together *t, const Ensemble *e, int64_t run)
{
    const int64_t chains = ensemble_chains(e);
    if (run >= 0 && run + chains < e->n_runs) return run + chains;
    return t->begun < chains ? t->begun++ : e->n_runs;
}

/* the next runs that begin without an error take a place; 0 if there is none left */
static int next_run(Together *t, int slot, Instance *m, Ensemble *e, double *memory, void *room)
{
    const LaneStepper *s = stepper_of(e->lanes);
    const Run *r = &m->core.run;
    LaneMotion *motion = &t->motion[slot];
    Job *job = &t->job[slot];
    for (int64_t i = run_after(t, e, job->run); i < e->n_runs; i = run_after(t, e, i)) {
        job->m = m;
        job->e = e;
        job->in_lanes = 1;
        if (e->in_lanes) e->in_lanes[i] = 0;
        t->loaded = i;
        Outcome outcome = journey_start(job, i, memory);
        t->series_of = -1; /* it may have used their room */
        int steady = MODEL_NS == 0;
        for (int k = 0; k < MODEL_NU; k++)
            steady &= r->at.du[k] == 0.0;
        if (outcome == OUTCOME_FINISHED) outcome = bounded(e, r->at.x);
        steady &= e->starts[i] == 0.0;
        if (outcome == OUTCOME_FINISHED && (!steady || !s->place(room, slot, r->at.p, r->at.u, e->periods[i]))) {
            prepare_series(t, job);
            outcome = series_run(job);
        } else if (outcome == OUTCOME_FINISHED) {
            job->length = MODEL_NX;
            take(r, job, motion, &t->kept[slot]);
            t->series[slot] = 1;
            give_tangents(t, slot);
            motion->wanted = 1;
            return 1;
        }
        journey_end(job, outcome);
    }
    motion->wanted = 0;
    return 0;
}

Status lane_runs(Instance *m, Ensemble *e)
{
    const LaneStepper *s = stepper_of(e->lanes);
    char *base = e->lane_room;
    Together *t = e->lane_room;
    const int64_t numbers = arrival_numbers(e->longest);
    const int64_t chains = ensemble_chains(e);
    const int together = chains < LANE_RUNS_TOGETHER ? (int)chains : LANE_RUNS_TOGETHER;
    double *memory = (double *)(void *)(base + in_lines(sizeof *t));
    const int64_t size = sizeof *memory;
    void *room = (char *)memory + in_lines(LANE_RUNS_TOGETHER * numbers * size)
                 + in_lines(LANE_RUNS_TOGETHER * TANGENTS * size);
    int going = 0;
    t->width = s->together;
    t->tangents = memory + in_lines(LANE_RUNS_TOGETHER * numbers * size) / size;
    t->growth = t->tangents + LANE_RUNS_TOGETHER * e->n_directions * MODEL_NX;
    memset(t->tangents, 0, (size_t)(LANE_RUNS_TOGETHER * e->n_directions * MODEL_NX * size));
    s->open(room, together);
    t->begun = 0;
    for (int slot = 0; slot < together; slot++) {
        t->job[slot].run = -1;
        going += next_run(t, slot, m, e, memory + slot * numbers, room);
    }
    while (going > 0) {
        if (e->stop && *(const volatile int32_t *)e->stop) {
            for (int slot = 0; slot < together; slot++)
                if (t->motion[slot].wanted) journey_end(&t->job[slot], OUTCOME_STOPPED);
            break;
        }
        memset(t->asked, 0, (size_t)together * sizeof *t->asked);
        for (int slot = 0; slot < together; slot++) {
            t->motion[slot].speed = (double)e->flow;
            if (t->motion[slot].wanted) give_growth(t, slot);
        }
        const int64_t periods = s->step(room, t->motion, periods_of(t, e, together), e->bound, e->n_directions,
                                        t->tangents, e->jacobians ? NULL : t->growth, resolve, t);
        for (int slot = 0; slot < together; slot++) {
            Outcome outcome;
            if (!t->motion[slot].wanted || !step_made(t, slot, periods, &outcome)) continue;
            journey_end(&t->job[slot], outcome);
            if (e->follow) {
                /* the next begins where this one ended */
                memcpy(m->core.run.at.x, t->motion[slot].x, MODEL_NX * sizeof(double));
                memcpy(m->core.run.at.memory, t->motion[slot].memory, sizeof t->motion[slot].memory);
            }
            going -= !next_run(t, slot, m, e, memory + slot * numbers, room);
        }
    }
    return STATUS_OK;
}
