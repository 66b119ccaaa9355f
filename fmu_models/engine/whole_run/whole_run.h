/* A whole run of an instance in one call: the contract with the program that asks for it, which reads these structures
   here. */
#pragma once

#include "restart.h"

typedef struct {
    /* where the instance is taken first; NULL if it is there, as after the first call */
    const RunStart *start;
    /* what to record: value references, ascending times, and values[row * n_values + column] */
    int64_t n_times, n_values;
    const double *times;
    const uint32_t *references;
    double *values;
    /* inputs from knot k on: knot_values[k * n_inputs + i] + knot_rates[k * n_inputs + i] * (time - knot_times[k]) */
    int64_t n_knots, n_inputs;
    /* both sides of instants with events between the output times: [side][before, after][time, then n_values]; none if
       there is no room */
    int64_t side_capacity, n_sides;
    double *sides;
    /* steps of the engine after which to return for a while */
    int64_t allowance;
    /* progress, zero at the first call */
    int64_t next_time, next_knot;
    /* buffer of changes of contact state */
    int64_t n_events, event_capacity;
    ContactEvent *events;
    const double *knot_times;
    const uint32_t *inputs;
    const double *knot_values, *knot_rates;
    /* the state whose crossings of a level are recorded, and rows of n_values for them; watches nothing if there is no
       room */
    int64_t crossing_capacity, n_crossings;
    double *crossings;
    double level;
    int32_t direction;
    uint32_t crossing_state;
    Section section;
    /* counters of the engine since the instance was reset */
    int64_t steps, n_changes, evaluations;
} WholeRun;

WHOLE_RUN_EXPORT int stickslip_simulate(void *instance, WholeRun *run);

/* the parts that a run with derivatives has too */
/* keep an event, as an EventSink */
void whole_run_note(void *context, const ContactEvent *event);
/* inputs of the next knot */
Status whole_run_pass_knot(Instance *m, WholeRun *run);
/* choose contact states again once knots have been passed, and keep what changes as events */
Status whole_run_settle(Instance *m, WholeRun *run);
/* room that must be left for events: an instant may change every contact as often as the engine iterates */
int64_t whole_run_event_reserve(const Run *r);
Status whole_run_check_event_room(Instance *m, const WholeRun *run);
int whole_run_engine_failed(Instance *m);
/* the counters of the engine into those of the run */
void whole_run_count(const Instance *m, WholeRun *run);
