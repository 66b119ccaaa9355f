/* The variables of an instance: what a value reference means, reading, writing and directional derivatives. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "variables.h"

#include "../events/contact_placement.h"
#include "../events/model_exchange.h"
#include "../events/run.h"
#include "../tangents/point_derivative.h"
#include "../model/traps.h"

static const char *const kind_names[] = {"the time",
                                         "a parameter",
                                         "an input",
                                         "the rate of an input",
                                         "a state",
                                         "the memory of a stop",
                                         "a derivative",
                                         "an output",
                                         "the state of a contact",
                                         "an indicator",
                                         "a clock",
                                         "nothing"};

int variables_memory_contact(int i)
{
    int found = 0;
    for (int c = 0; c < MODEL_NC; c++)
        if (model_contact_remembers[c] && found++ == i) return c;
    return found;
}

int variables_clock(int i, int *tick)
{
    int found = 0;
    for (int c = 0; c < MODEL_NC; c++)
        for (*tick = TICK_STICK; *tick <= TICK_RESET; *tick *= 2)
            if (model_contact_clocks[c] & *tick && found++ == i) return c;
    return found;
}

Kind variables_locate(uint32_t vr, int *index)
{
    const int counts[] = {
        1,        MODEL_NP, MODEL_SET_INPUTS, MODEL_SET_INPUTS, MODEL_NX, variables_memory_contact(MODEL_NC),
        MODEL_NX, MODEL_NY, MODEL_NC,         MODEL_NI};
    long rest = (long)vr - 1;
    for (int kind = TIME; kind < CLOCK; kind++) {
        if (rest >= 0 && rest < counts[kind]) {
            *index = (int)rest;
            return (Kind)kind;
        }
        rest -= counts[kind];
    }
    if (rest >= 0 && rest < variables_clock(INT_MAX, index)) {
        *index = (int)rest;
        return CLOCK;
    }
    *index = 0;
    return UNKNOWN;
}

int variables_is_intermediate(uint32_t vr)
{
    int i;
    Kind kind = variables_locate(vr, &i);
    return kind == OUTPUT || kind == STATE || kind == DERIVATIVE || kind == INPUT;
}

uint32_t variables_rate_of(uint32_t vr)
{
    int i;
    return variables_locate(vr, &i) == INPUT ? vr + MODEL_SET_INPUTS : 0;
}

/* RUN_OK once e holds what a variable of this kind is read from */
static RunStatus evaluate(Run *r, Kind kind, Evaluation *e)
{
    if (kind == DERIVATIVE && !e->has_derivatives) {
        e->has_derivatives = 1;
        return exchange_derivatives(r, e->derivatives);
    }
    if (kind == OUTPUT && !e->has_outputs) {
        e->has_outputs = 1;
        return run_outputs(r, e->outputs);
    }
    if (kind == INDICATOR && !e->has_indicators) {
        e->has_indicators = 1;
        return exchange_indicators(r, e->indicators);
    }
    return RUN_OK;
}

static double read_value(const Run *r, Kind kind, int i, const Evaluation *e)
{
    switch (kind) {
    case TIME: return r->at.time;
    case PARAMETER: return r->at.p[i];
    case INPUT: return r->at.u[i];
    case RATE: return r->at.du[i];
    case STATE: return r->at.x[i];
    case MEMORY: return r->at.memory[variables_memory_contact(i)];
    case DERIVATIVE: return e->derivatives[i];
    case OUTPUT: return e->outputs[i];
    case CONTACT: return r->at.state[i];
    case INDICATOR: return e->indicators[i];
    case CLOCK:
    case UNKNOWN: break;
    }
    return NAN;
}

int variables_value(Instance *m, uint32_t vr, Evaluation *e, double *value)
{
    int i;
    Kind kind = variables_locate(vr, &i);
    if (kind >= CLOCK || evaluate(&m->core.run, kind, e) == RUN_ERROR) return 0;
    *value = read_value(&m->core.run, kind, i, e);
    return 1;
}

/* values that follow from others exist once the contact states have been chosen */
static Status check_readable(Instance *m, const char *function, Kind kind)
{
    if (kind < DERIVATIVE) return STATUS_OK;
    if (m->core.phase == PHASE_INSTANTIATED)
        return instance_refuse(m, "%s: %s is known only after initialization has begun", function, kind_names[kind]);
    return m->core.phase == PHASE_INITIALIZATION ? instance_settle(m, function, NULL) : STATUS_OK;
}

Status variables_get(Instance *m, const char *function, const uint32_t *vr, size_t n, double *value)
{
    TRAPS_REST;
    Evaluation e = {0};
    if (instance_enter(m, PHASES_ALL, function)) return STATUS_ERROR;
    if (instance_array(m, vr, n, function, "value references")) return STATUS_ERROR;
    if (instance_array(m, value, n, function, "values")) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        int i;
        Kind kind = variables_locate(vr[k], &i);
        if (kind >= CLOCK || kind == CONTACT)
            return instance_refuse(m, "%s: value reference %u is %s, not a real variable", function, (unsigned)vr[k],
                                   kind_names[kind]);
        if (check_readable(m, function, kind)) return STATUS_ERROR;
        if (evaluate(&m->core.run, kind, &e) == RUN_ERROR)
            return instance_refuse(m, "%s: %s", function, m->core.run.message);
        value[k] = read_value(&m->core.run, kind, i, &e);
    }
    return STATUS_OK;
}

Status variables_get_contacts(Instance *m, const char *function, const uint32_t *vr, size_t n, int32_t *value)
{
    if (instance_enter(m, PHASES_ALL, function)) return STATUS_ERROR;
    if (instance_array(m, vr, n, function, "value references")) return STATUS_ERROR;
    if (instance_array(m, value, n, function, "values")) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        int i;
        Kind kind = variables_locate(vr[k], &i);
        if (kind != CONTACT)
            return instance_refuse(m, "%s: value reference %u is %s, not the state of a contact", function,
                                   (unsigned)vr[k], kind_names[kind]);
        if (check_readable(m, function, kind)) return STATUS_ERROR;
        value[k] = m->core.run.at.state[i];
    }
    return STATUS_OK;
}

static Status check_writable(Instance *m, const char *function, uint32_t vr, double value)
{
    int i, phases = 0;
    Kind kind = variables_locate(vr, &i);
    switch (kind) {
    case PARAMETER: phases = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_EVENT | PHASE_STEP; break;
    case INPUT:
    case RATE:
        phases = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASES_RUNNING;
        if (kind == INPUT && m->asking) phases |= PHASE_INTERMEDIATE;
        break;
    case STATE:
    case MEMORY: phases = PHASE_INSTANTIATED | PHASE_INITIALIZATION; break;
    default:
        return instance_refuse(m, "%s: value reference %u is %s and cannot be set", function, (unsigned)vr,
                               kind_names[kind]);
    }
    if (instance_enter(m, phases, function)) return STATUS_ERROR;
    if (!isfinite(value))
        return instance_refuse(m, "%s: the value of reference %u is not finite", function, (unsigned)vr);
    return STATUS_OK;
}

/* where a value is kept; of an input its derivative of some order */
static double *target_of(Run *r, uint32_t vr, int order, Kind *kind)
{
    int i;
    *kind = variables_locate(vr, &i);
    switch (*kind) {
    case PARAMETER: return &r->at.p[i];
    case RATE: return &r->at.du[i];
    case INPUT: return order == 0 ? &r->at.u[i] : order == 1 ? &r->at.du[i] : &r->at.bend[i][order - 2];
    case MEMORY: return &r->at.memory[variables_memory_contact(i)];
    default: return &r->at.x[i];
    }
}

/* whether inputs have more than a rate */
static int are_curved(const Point *at)
{
    int curved = 0;
    for (int i = 0; i < MODEL_SET_INPUTS; i++)
        for (int n = 2; n <= MODEL_INPUT_DEGREE; n++)
            curved |= at->bend[i][n - 2] != 0.0;
    return curved;
}

static Status keep_asked(Instance *m, const uint32_t *vr, size_t n, const double *value)
{
    int i;
    for (size_t k = 0; k < n; k++) {
        variables_locate(vr[k], &i);
        m->asked[i] = value[k];
    }
    return STATUS_OK;
}

/* values, or derivatives of inputs where orders are given */
static Status write_values(Instance *m, const char *function, const uint32_t *vr, size_t n, const int32_t *order,
                           const double *value)
{
    TRAPS_REST;
    int parameters = 0, others = 0;
    if (instance_enter(m, PHASES_ALL, function)) return STATUS_ERROR;
    /* a start has no contact states yet that values could end */
    const int chosen = m->core.settled && m->core.phase & (PHASE_EVENT | PHASE_STEP);
    if (instance_array(m, vr, n, function, "value references")) return STATUS_ERROR;
    if (instance_array(m, value, n, function, "values")) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++)
        if (check_writable(m, function, vr[k], value[k])) return STATUS_ERROR;
    if (m->asking) return keep_asked(m, vr, n, value);
    /* the event belongs to the values before: a jump of an input at the same instant comes after it */
    if (n && instance_resolve(m, function)) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        Run *r = &m->core.run;
        Kind kind;
        double *target = target_of(r, vr[k], order ? order[k] : 0, &kind);
        /* the derivative of a rate is left out: importers tell those of all inputs, and the input's own say more */
        if (*target == value[k] || (order && kind == RATE)) continue;
        if (chosen && !parameters && !others) placement_note_slips(r);
        *target = value[k];
        if (kind == PARAMETER)
            parameters = 1;
        else
            others = 1;
    }
    if (parameters) run_parameters_changed(&m->core.run);
    if (others) run_touched(&m->core.run);
    if (order) m->core.run.at.curved = are_curved(&m->core.run.at);
    /* an input that moves in continuous time is watched by the indicators: no new choice of contact states here */
    if ((parameters || others) && m->core.phase != PHASE_CONTINUOUS) m->core.settled = 0;
    return STATUS_OK;
}

RARE Status variables_set(Instance *m, const char *function, const uint32_t *vr, size_t n, const double *value)
{
    return write_values(m, function, vr, n, NULL, value);
}

Status variables_set_input_derivatives(Instance *m, const char *function, const uint32_t *vr, size_t n,
                                       const int32_t *order, const double *value)
{
    int i, phases = PHASE_INSTANTIATED | PHASE_INITIALIZATION | PHASE_STEP;
    if (instance_enter(m, phases, function) || instance_array(m, vr, n, function, "value references")
        || instance_array(m, order, n, function, "orders"))
        return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        const Kind kind = variables_locate(vr[k], &i);
        if (kind != INPUT && kind != RATE)
            return instance_refuse(m, "%s: value reference %u is not an input", function, (unsigned)vr[k]);
        if (order[k] < 1 || order[k] > MODEL_INPUT_DEGREE)
            return instance_refuse(m, "%s: order %d; orders 1 to %d are used", function, (int)order[k],
                                   MODEL_INPUT_DEGREE);
    }
    return write_values(m, function, vr, n, order, value);
}

/* derivatives of outputs in time of one order; of those that depend on derivatives of inputs which the FMU cannot know
   others in a second place */
static void time_derivatives(Instance *m, int order, TimeDerivatives found[2])
{
    Run *r = &m->core.run;
    run_time_derivatives(r, order, &found[0]);
    found[1] = found[0];
    if (order < m->input_order) return;
    const Point before = r->at;
    for (int i = 0; i < MODEL_SET_INPUTS; i++)
        for (int n = m->input_order + 1; n <= order + 1; n++)
            r->at.bend[i][n - 2] = 0x1p20 * (i + n);
    r->at.curved = 1;
    run_time_derivatives(r, order, &found[1]);
    r->at = before;
}

static double derivative_of(const TimeDerivatives *found, uint32_t vr)
{
    int i;
    const Kind kind = variables_locate(vr, &i);
    return (kind == STATE ? found->states : kind == OUTPUT ? found->outputs : found->rates)[i];
}

Status variables_output_derivatives(Instance *m, const char *function, const uint32_t *vr, size_t n,
                                    const int32_t *order, double *value)
{
    TRAPS_REST;
    int i, phases = PHASE_STEP | PHASE_INTERMEDIATE | PHASE_EVENT | PHASE_TERMINATED;
    TimeDerivatives found[2] = {{{0}, {0}, {0}}, {{0}, {0}, {0}}};
    if (instance_enter(m, m && m->core.co_simulation ? phases : 0, function)) return STATUS_ERROR;
    if (instance_array(m, vr, n, function, "value references") || instance_array(m, order, n, function, "orders")
        || instance_array(m, value, n, function, "values"))
        return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        Kind kind = variables_locate(vr[k], &i);
        if (kind != OUTPUT && kind != STATE && kind != DERIVATIVE)
            return instance_refuse(m, "%s: value reference %u is %s, not a continuous output", function,
                                   (unsigned)vr[k], kind_names[kind]);
        if (order[k] < 1 || order[k] > MOST_OUTPUT_ORDER)
            return instance_refuse(m, "%s: order %d; orders 1 to %d are given", function, (int)order[k],
                                   MOST_OUTPUT_ORDER);
    }
    for (size_t k = 0; k < n; k++) {
        if (k == 0 || order[k] != order[k - 1]) time_derivatives(m, order[k], found);
        value[k] = derivative_of(&found[0], vr[k]);
        if (!isfinite(value[k]))
            return instance_refuse(m, "%s: output %u has no finite derivative of order %d at time %.17g", function,
                                   (unsigned)vr[k], (int)order[k], m->core.run.at.time);
        if (value[k] != derivative_of(&found[1], vr[k])) {
            instance_refuse(m, "%s: derivative %d of output %u depends on those of inputs beyond order %d", function,
                            (int)order[k], (unsigned)vr[k], m->input_order);
            return STATUS_DISCARD;
        }
    }
    return STATUS_OK;
}

Status variables_none(Instance *m, const char *function, size_t n, const char *type)
{
    if (instance_enter(m, PHASES_ALL, function)) return STATUS_ERROR;
    return n ? instance_refuse(m, "%s: the model has no variables %s", function, type) : STATUS_OK;
}

/* the direction of one known variable, so many times */
static Status add_known(Instance *m, const char *function, uint32_t vr, double seed, Direction *along)
{
    int i;
    Kind kind = variables_locate(vr, &i);
    if (!isfinite(seed)) return instance_refuse(m, "%s: the seed of %u is not finite", function, (unsigned)vr);
    switch (kind) {
    case TIME: along->time += seed; return STATUS_OK;
    case PARAMETER: along->p[i] += seed; return STATUS_OK;
    case INPUT: along->u[i] += seed; return STATUS_OK;
    case RATE: along->du[i] += seed; return STATUS_OK;
    case STATE: along->x[i] += seed; return STATUS_OK;
    case MEMORY: along->memory[variables_memory_contact(i)] += seed; return STATUS_OK;
    default:
        return instance_refuse(m, "%s: known %u is %s; only what can be set is supported, and the time", function,
                               (unsigned)vr, kind_names[kind]);
    }
}

static Status enter_derivatives(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                                const uint32_t *known, size_t n_known)
{
    int i;
    if (instance_enter(m, PHASES_READABLE & ~PHASE_FAILED, function)) return STATUS_ERROR;
    if (instance_array(m, unknown, n_unknown, function, "unknowns")) return STATUS_ERROR;
    if (instance_array(m, known, n_known, function, "knowns")) return STATUS_ERROR;
    for (size_t k = 0; k < n_unknown; k++) {
        Kind kind = variables_locate(unknown[k], &i);
        if (kind != DERIVATIVE && kind != OUTPUT && kind != STATE)
            return instance_refuse(m, "%s: unknown %u is %s; only states, derivatives and outputs are supported",
                                   function, (unsigned)unknown[k], kind_names[kind]);
    }
    if (m->core.phase == PHASE_INITIALIZATION && instance_settle(m, function, NULL)) return STATUS_ERROR;
    if (!m->derivatives) m->derivatives = calloc(1, point_derivative_room());
    return m->derivatives ? STATUS_OK : instance_refuse(m, "%s: out of memory", function);
}

static Status read_derivatives(Instance *m, const char *function, const Direction *along, const uint32_t *unknown,
                               size_t n, double *value)
{
    int i;
    double dx[MODEL_ROOM(MODEL_NX)] = {0}, dy[MODEL_ROOM(MODEL_NY)] = {0};
    point_derivative(&m->core.run, along, m->derivatives, dx, dy);
    for (size_t k = 0; k < n; k++) {
        const Kind kind = variables_locate(unknown[k], &i);
        value[k] = (kind == STATE ? along->x : kind == OUTPUT ? dy : dx)[i];
        if (!isfinite(value[k]))
            return instance_refuse(m, "%s: unknown %u has no finite derivative at time %.17g", function,
                                   (unsigned)unknown[k], m->core.run.at.time);
    }
    return STATUS_OK;
}

Status variables_directional(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                             const uint32_t *known, size_t n_known, const double *seed, double *sensitivity)
{
    TRAPS_REST;
    Direction along = {0};
    if (enter_derivatives(m, function, unknown, n_unknown, known, n_known)) return STATUS_ERROR;
    if (instance_array(m, seed, n_known, function, "seed")) return STATUS_ERROR;
    if (instance_array(m, sensitivity, n_unknown, function, "sensitivity")) return STATUS_ERROR;
    for (size_t k = 0; k < n_known; k++)
        if (add_known(m, function, known[k], seed[k], &along)) return STATUS_ERROR;
    return read_derivatives(m, function, &along, unknown, n_unknown, sensitivity);
}

Status variables_adjoint(Instance *m, const char *function, const uint32_t *unknown, size_t n_unknown,
                         const uint32_t *known, size_t n_known, const double *seed, double *sensitivity)
{
    TRAPS_REST;
    double *column = NULL;
    Status status = STATUS_OK;
    if (enter_derivatives(m, function, unknown, n_unknown, known, n_known)) return STATUS_ERROR;
    if (instance_array(m, seed, n_unknown, function, "seed")) return STATUS_ERROR;
    if (instance_array(m, sensitivity, n_known, function, "sensitivity")) return STATUS_ERROR;
    for (size_t i = 0; i < n_unknown; i++)
        if (!isfinite(seed[i])) return instance_refuse(m, "%s: seed %zu is not finite", function, i);
    if (n_unknown == 0 || n_known == 0) {
        for (size_t k = 0; k < n_known; k++)
            sensitivity[k] = 0.0;
        return STATUS_OK;
    }
    column = calloc(n_unknown, sizeof *column);
    if (!column) return instance_refuse(m, "%s: out of memory", function);
    for (size_t k = 0; k < n_known && status == STATUS_OK; k++) {
        Direction along = {0};
        status = add_known(m, function, known[k], 1.0, &along);
        if (status == STATUS_OK) status = read_derivatives(m, function, &along, unknown, n_unknown, column);
        sensitivity[k] = 0.0;
        for (size_t i = 0; i < n_unknown && status == STATUS_OK; i++)
            sensitivity[k] += seed[i] * column[i];
    }
    free(column);
    return status;
}
