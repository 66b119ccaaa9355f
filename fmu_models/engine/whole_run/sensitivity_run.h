/* A whole run with its derivatives in one call. */
#pragma once

#include "whole_run.h"

#include "../tangents/near_miss.h"

typedef struct {
    WholeRun run; /* its crossings are not used; references to record are states and outputs */
    RunStart start;
    /* states, parameters and inputs to differentiate by, at least one */
    int64_t n_directions;
    const uint32_t *directions;
    /* the first n_seeds directions, which name states, are mixtures seeds[direction * MODEL_NX + state] of states instead;
       nothing may hold at the start */
    int64_t n_seeds;
    const double *seeds;
    /* derivatives[(row * n_values + column) * n_directions + direction], event_derivatives[event * n_directions +
       direction] */
    double *derivatives, *event_derivatives;
    /* NULL, or [event]: the speed at which the indicator of each event fell, and its derivatives [event * n_directions +
       direction] */
    double *event_speeds, *event_speed_derivatives;
    /* NULL, or rates[row * MODEL_NX + state] of the states at the output times */
    double *rates;
    /* how near indicators come to zero between events; none are looked for if there is no room */
    NearMisses misses;
    /* stickslip_sensitivity_room(n_directions) bytes, kept from call to call */
    void *room;
    /* progress, zero at the first call */
    int64_t started;
    /* directions by which the derivatives are one-sided so far */
    int64_t corners;
} SensitivityRun;

WHOLE_RUN_EXPORT int64_t stickslip_sensitivity_room(int64_t n_directions);
WHOLE_RUN_EXPORT int stickslip_sensitivity(void *instance, SensitivityRun *s);
