/* The variables of an instance. */
#pragma once

#include "instance.h"

/* what a value reference means; they are consecutive from 1, in this order (fmu_models/codegen/variables.py) */
typedef enum {
    TIME,
    PARAMETER,
    INPUT,
    RATE,
    STATE,
    MEMORY,
    DERIVATIVE,
    OUTPUT,
    CONTACT,
    INDICATOR,
    CLOCK,
    UNKNOWN
} Kind;

/* a result of the engine for the present values, computed when first asked for */
typedef struct {
    int has_derivatives, has_outputs, has_indicators;
    double derivatives[MODEL_ROOM(MODEL_NX)];
    double outputs[MODEL_ROOM(MODEL_NY)];
    double indicators[MODEL_ROOM(MODEL_NI)];
} Evaluation;

/* highest order of derivatives of outputs in time */
typedef enum { MOST_OUTPUT_ORDER = 5 } Most;

Status variables_get(Instance *m, const char *function, const uint32_t *vr, size_t n, double *value);
Status variables_set(Instance *m, const char *function, const uint32_t *vr, size_t n, const double *value);
Status variables_get_contacts(Instance *m, const char *function, const uint32_t *vr, size_t n, int32_t *value);
/* derivatives of inputs in time, each of its order, from 1 to MODEL_INPUT_DEGREE (Co-Simulation) */
Status variables_set_input_derivatives(Instance *m, const char *function, const uint32_t *vr, size_t n,
                                       const int32_t *order, const double *value);
/* derivatives of outputs in time, each of its order, at the present time (Co-Simulation); STATUS_DISCARD where one
   depends on derivatives of inputs that the FMU cannot know */
Status variables_output_derivatives(Instance *m, const char *function, const uint32_t *vr, size_t n,
                                    const int32_t *order, double *value);
/* what a value reference means, and the index among its kind */
Kind variables_locate(uint32_t vr, int *index);
/* the contact of memory number i, or how many memories there are if i is beyond them */
int variables_memory_contact(int i);
/* the contact of clock number i and the tick that it has, or how many clocks there are if i is beyond them */
int variables_clock(int i, int *tick);
/* what may be accessed inside a step: inputs, and what follows from the states */
int variables_is_intermediate(uint32_t vr);
/* reference of the rate of an input, 0 for the reference of anything else */
uint32_t variables_rate_of(uint32_t vr);
/* refuse any reference: the model has no variables of that type (or none that can be set) */
Status variables_none(Instance *m, const char *function, size_t n, const char *type);
/* the value of one variable of any type; 0 if there is none. Needs a settled instance that is past its
   initialization */
int variables_value(Instance *m, uint32_t vr, Evaluation *e, double *value);

/* derivatives of rates and outputs by all that can be set, and by time: seed has n_known numbers, sensitivity n_unknown;
   adjoint ones the other way round */
Status variables_directional(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                             const uint32_t *known, size_t n_known, const double *seed, double *sensitivity);
Status variables_adjoint(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                         const uint32_t *known, size_t n_known, const double *seed, double *sensitivity);
