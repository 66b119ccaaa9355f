/*
 * Several FMUs as one: the contract with Python, which reads these structures here. The coupled system looks like an
 * FMU 2.0, so that the master integrates it, finds its events and slides along its surfaces like those of any other.
 *
 * The outputs y that feed others and the inputs u they feed are ordered by stages: a stage needs the inputs of earlier
 * ones only. The outputs of a stage that is a loop depend on its own inputs without a state between; they are found by
 * Newton's method.
 */
#pragma once

#include "fmi_calls.h"

/* outputs or inputs of one unit, next to one another */
typedef struct {
    int64_t unit, first, n;
    int64_t discrete; /* exchanged at events only */
} Group;

typedef struct {
    int64_t loop;
    int64_t first_read, n_reads;   /* groups of outputs */
    int64_t first_write, n_writes; /* groups of inputs */
    int64_t first_input, n_inputs; /* the same, counted by inputs: the unknowns of a loop */
    int64_t matrix;                /* where its matrix begins */
    int64_t ready;                 /* the matrix is factored */
} Stage;

typedef struct {
    int64_t n_units;
    const FmuInstance **fmus;
    const int64_t *first_state, *first_indicator;
    int64_t n_stages;
    Stage *stages;
    const Group *reads, *writes;
    const int32_t *output_types, *input_types;
    const uint32_t *output_references, *input_references;
    int64_t n_inputs;
    const int64_t *source; /* (n_inputs) output that feeds the input: u = factor y + offset */
    const double *factor, *offset;
    double *outputs, *inputs; /* y, u */
    double *scale, *step;     /* (n_inputs) largest value so far; of Newton's method */
    double *matrix;
    double *rates;  /* of one unit */
    int32_t *pivot; /* (n_inputs) */
    /* every variable of the units by its number in the coupled system */
    const int64_t *variable_unit;
    const int32_t *variable_types;
    const uint32_t *variable_references;
    double tolerance, start, stop, time;
    int64_t stale;                     /* the inputs belong to another time or state */
    int64_t changed;                   /* an input was changed by the last exchange */
    int64_t failed_unit, failed_stage; /* -1: none */
    int64_t newton_steps;
} Coupling;

/* event: discrete values too. Status of FMI */
int32_t coupling_exchange(Coupling *c, int32_t event);
int coupling_failed(Coupling *c, int64_t unit, int status); /* notes the unit; returns the status */
