/*
 * The native face: a whole run in one call, for a program that has opened the FMU as Co-Simulation and left its
 * initialization mode (fmu_models/simulation/run.py). Nothing is allocated while stepping.
 *
 *     repeat   at a knot: set the inputs and their rates, choose contact states again
 *              advance to the next knot or output time, note every change of contact state
 *              at an output time, or where a state crosses the level watched: record the values asked for
 *              (after the changes at that very time)
 *     until    all output times are done; a buffer is or could become too full, or the allowance of steps is used up
 *
 * In the last cases it returns NATIVE_MORE; the caller empties the buffers and calls again with the same request.
 */
#include <math.h>

#include "instance.h"

#if defined(_WIN32)
#define NATIVE_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define NATIVE_EXPORT __attribute__((visibility("default")))
#else
#define NATIVE_EXPORT
#endif

enum { NATIVE_DONE = 0, NATIVE_MORE = 1, NATIVE_ERROR = 2 };

/* mirrored by simulation/native.py; changes with what this file and sensitivity.c offer */
enum { NATIVE_VERSION = 4 };

typedef struct {
    /* what to record: value references, ascending times, and values[row * n_values + column] */
    int64_t n_times, n_values;
    const double *times;
    const uint32_t *references;
    double *values;
    /* inputs from knot k on: knot_values[k * n_inputs + i] + knot_rates[k * n_inputs + i] * (time - knot_times[k]) */
    int64_t n_knots, n_inputs;
    const double *knot_times;
    const uint32_t *inputs;
    const double *knot_values, *knot_rates;
    /* buffer of changes of contact state */
    int64_t event_capacity, n_events;
    ContactEvent *events;
    /* the state whose crossings of a level are recorded, and rows of n_values for them; watches nothing if there is no room */
    int64_t crossing_capacity, n_crossings;
    double *crossings;
    double level;
    int32_t direction;
    uint32_t crossing_state;
    /* steps of the engine after which to return for a while */
    int64_t allowance;
    /* progress, zero at the first call */
    int64_t next_time, next_knot;
    /* counters of the engine since the instance was reset */
    int64_t steps, n_changes, evaluations;
} NativeRun;

static void note(void *context, const ContactEvent *event) {
    NativeRun *run = context;
    if (run->n_events < run->event_capacity) run->events[run->n_events] = *event;
    run->n_events++;
}

/* inputs of the next knot; nothing to choose again where they go on as before */
static Status pass_knot(Instance *m, NativeRun *run) {
    const double *values = run->knot_values + run->next_knot * run->n_inputs;
    const double *rates = run->knot_rates + run->next_knot * run->n_inputs;
    for (int64_t i = 0; i < run->n_inputs; i++) {
        uint32_t rate = instance_rate_of(run->inputs[i]);
        if (!rate) return instance_refuse(m, "%s: value reference %u is not an input", __func__, (unsigned)run->inputs[i]);
        if (instance_set(m, __func__, &run->inputs[i], 1, &values[i])) return STATUS_ERROR;
        if (instance_set(m, __func__, &rate, 1, &rates[i])) return STATUS_ERROR;
    }
    run->next_knot++;
    m->core.run.horizon = run->next_knot < run->n_knots ? run->knot_times[run->next_knot] : INFINITY;
    return STATUS_OK;
}

static Status record(Instance *m, const NativeRun *run, double *row) {
    Evaluation e = {0};
    for (int64_t k = 0; k < run->n_values; k++)
        if (!instance_value(m, run->references[k], &e, &row[k]))
            return instance_refuse(m, "%s: value reference %u cannot be read at time %g", __func__,
                                   (unsigned)run->references[k], m->core.run.at.time);
    return STATUS_OK;
}

static Status watch(Instance *m, const NativeRun *run) {
    int state;
    if (instance_locate(run->crossing_state, &state) != STATE)
        return instance_refuse(m, "%s: value reference %u is not a state", __func__, (unsigned)run->crossing_state);
    section_watch(&m->core.run, state, run->level, run->direction);
    return STATUS_OK;
}

/* room that must be left for events: an instant may change every contact as often as the engine iterates */
static int64_t event_reserve(const Run *r) { return (int64_t)r->tolerances.max_iterations * MODEL_NC; }

static Status check_event_room(Instance *m, const NativeRun *run) {
    int64_t reserve = event_reserve(&m->core.run);
    if (run->event_capacity > reserve) return STATUS_OK;
    return instance_refuse(m, "%s: room for %lld events, at least %lld needed", __func__, (long long)run->event_capacity,
                           (long long)reserve + 1);
}

static int engine_failed(Instance *m) {
    m->core.phase = PHASE_FAILED;
    instance_refuse(m, "at time %.10g: %s", m->core.run.at.time, m->core.run.message);
    return NATIVE_ERROR;
}

static int proceed(Instance *m, NativeRun *run) {
    Run *r = &m->core.run;
    int64_t reserve = event_reserve(r);
    long last_step = r->steps + (long)run->allowance;
    if (check_event_room(m, run)) return NATIVE_ERROR;
    int watches = run->crossing_capacity > 0;
    r->goal = watches || !run->n_times ? -INFINITY : run->times[run->n_times - 1]; /* a section may stop early */
    r->pause_at = last_step;
    while (run->next_time < run->n_times) {
        if (run->n_events >= run->event_capacity - reserve || r->steps >= last_step) return NATIVE_MORE;
        if (watches && run->n_crossings == run->crossing_capacity) return NATIVE_MORE;
        while (run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= r->at.time)
            if (pass_knot(m, run)) return NATIVE_ERROR;
        if (instance_settle(m, __func__, NULL)) return NATIVE_ERROR;
        if (watches && !r->section.watched && watch(m, run)) return NATIVE_ERROR;
        double end = run->times[run->next_time];
        int knot_first = run->next_knot < run->n_knots && run->knot_times[run->next_knot] <= end;
        if (knot_first) end = run->knot_times[run->next_knot];
        if (r->at.time < end) {
            RunStatus status = run_advance(r, end, 1, note, run);
            if (status == RUN_ERROR) return engine_failed(m);
            if (status == RUN_CROSSING) {
                if (record(m, run, run->crossings + run->n_crossings * run->n_values)) return NATIVE_ERROR;
                run->n_crossings++;
                continue;
            }
            if (status == RUN_PAUSED) return NATIVE_MORE;
            if (status == RUN_EVENT && r->at.time < end) continue;
        }
        if (knot_first) continue;
        if (record(m, run, run->values + run->next_time * run->n_values)) return NATIVE_ERROR;
        run->next_time++;
    }
    return NATIVE_DONE;
}

NATIVE_EXPORT int stickslip_native_version(void);
NATIVE_EXPORT int stickslip_simulate(void *instance, NativeRun *run);

int stickslip_native_version(void) { return NATIVE_VERSION; }

static void count(const Instance *m, NativeRun *run) {
    run->steps = m->core.run.steps;
    run->n_changes = m->core.run.events;
    run->evaluations = m->core.run.evaluations;
}

int stickslip_simulate(void *instance, NativeRun *run) {
    Instance *m = instance;
    if (!run || instance_enter(m, PHASE_STEP, __func__)) return NATIVE_ERROR;
    int status = proceed(m, run);
    if (status != NATIVE_MORE) m->core.run.section.watched = 0;
    m->core.run.pause_at = 0;
    count(m, run);
    return status;
}
