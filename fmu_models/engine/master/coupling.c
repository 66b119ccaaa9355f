/*
 * The coupled system as an FMU 2.0 (see coupling.h), and its exchange of values.
 *
 *     exchange:  stage by stage: read outputs, convert, write inputs; a loop by Newton's method with a matrix that is kept while it serves
 *     evaluate:  time and states into all units, exchange, derivatives or indicators of all
 *     event:     all units enter event mode; every update is one of all units, with an exchange before and after it; another is needed as
 *                long as a unit asks for it or an input has changed
 */
#include "coupling.h"

#include <math.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#define EXPORT __attribute__((visibility("default")))

enum { NEWTON_STEPS = 50, BUFFER = 64 };
static const double newton_exact = 1e-15;       /* relative to the largest value so far: nothing is left to gain */
static const double newton_rounding = 1e-11;    /* below it a step that gains nothing any more is rounding */
static const double newton_slow = 0.1;          /* ratio of steps from which a new matrix pays */
static const double same_input = 1e-12;         /* relative: an input of a loop that differs by less has not changed */

static int worse(int one, int two)
{
    return one > two ? one : two;
}

static int failed(Coupling *c, int64_t unit, int status)
{
    c->failed_unit = status >= FMI_DISCARD ? unit : c->failed_unit;
    return status;
}

static int read_stage(Coupling *c, const Stage *s, int event)
{
    int status = FMI_OK;
    for (int64_t i = s->first_read; i < s->first_read + s->n_reads && status < FMI_DISCARD; i++) {
        const Group *g = c->reads + i;
        if (event || !g->discrete) {
            const Variables variables = {g->n, c->output_types + g->first, c->output_references + g->first};
            status = failed(c, g->unit, face_read(c->faces[g->unit], &variables, c->outputs + g->first));
        }
    }
    return status;
}

static int write_stage(Coupling *c, const Stage *s, int event)
{
    int status = FMI_OK;
    for (int64_t i = s->first_write; i < s->first_write + s->n_writes && status < FMI_DISCARD; i++) {
        const Group *g = c->writes + i;
        if (event || !g->discrete) {
            const Variables variables = {g->n, c->input_types + g->first, c->input_references + g->first};
            status = failed(c, g->unit, face_write(c->faces[g->unit], &variables, c->inputs + g->first));
        }
    }
    return status;
}

static double fed(const Coupling *c, int64_t input)
{
    return c->factor[input] * c->outputs[c->source[input]] + c->offset[input];
}

/* a column of the matrix from the directional derivatives of the unit that has the input; 0: it offers none */
static int column_by_unit(Coupling *c, const Stage *s, int64_t unit, int64_t input, double *column)
{
    const Face *face = c->faces[unit];
    const double seed = 1.0;
    for (int64_t i = s->first_read; i < s->first_read + s->n_reads; i++) {
        const Group *g = c->reads + i;
        double *values = c->outputs + g->first;
        int status = FMI_OK;
        memset(values, 0, (size_t)g->n * sizeof *values);
        if (g->unit == unit && face->fmi == 2) {
            status = (int)((fmi2GetDirectionalDerivativeTYPE *)face->function[F_DIRECTIONAL])(
                face->instance, c->output_references + g->first, (size_t)g->n, c->input_references + input, 1, &seed, values);
        } else if (g->unit == unit) {
            status = (int)((fmi3GetDirectionalDerivativeTYPE *)face->function[F_DIRECTIONAL])(
                face->instance, c->output_references + g->first, (size_t)g->n, c->input_references + input, 1, &seed, 1, values,
                (size_t)g->n);
        }
        if (status >= FMI_DISCARD) {
            return 0;
        }
    }
    for (int64_t i = 0; i < s->n_inputs; i++) {
        const int64_t to = s->first_input + i;
        column[i * s->n_inputs] = c->factor[to] * c->outputs[c->source[to]];
    }
    return 1;
}

static int column_by_difference(Coupling *c, const Stage *s, int64_t input, double *column)
{
    const double value = c->inputs[input];
    const double shift = 1e-7 * fmax(c->scale[input], 1e-3);
    int status = FMI_OK;
    for (int side = 1; side >= -1 && status < FMI_DISCARD; side -= 2) {
        c->inputs[input] = value + side * shift;
        status = write_stage(c, s, 0);
        status = status < FMI_DISCARD ? read_stage(c, s, 0) : status;
        for (int64_t i = 0; i < s->n_inputs; i++) {
            double *entry = column + i * s->n_inputs;
            const double part = side * fed(c, s->first_input + i) / (2.0 * shift);
            *entry = side == 1 ? part : *entry + part;
        }
    }
    c->inputs[input] = value;
    return status;
}

/* LU with row exchanges; 0: singular */
static int factor(double *a, int32_t *pivot, int64_t n)
{
    for (int64_t k = 0; k < n; k++) {
        int64_t best = k;
        for (int64_t i = k + 1; i < n; i++) {
            best = fabs(a[i * n + k]) > fabs(a[best * n + k]) ? i : best;
        }
        pivot[k] = (int32_t)best;
        if (!(fabs(a[best * n + k]) > 1e-14)) {
            return 0;
        }
        for (int64_t j = 0; j < n && best != k; j++) {
            const double kept = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = kept;
        }
        for (int64_t i = k + 1; i < n; i++) {
            a[i * n + k] /= a[k * n + k];
            for (int64_t j = k + 1; j < n; j++) {
                a[i * n + j] -= a[i * n + k] * a[k * n + j];
            }
        }
    }
    return 1;
}

static void solve(const double *a, const int32_t *pivot, int64_t n, double *b)
{
    for (int64_t k = 0; k < n; k++) {
        const double kept = b[pivot[k]];
        b[pivot[k]] = b[k];
        b[k] = kept;
    }
    for (int64_t i = 0; i < n; i++) {
        for (int64_t j = 0; j < i; j++) {
            b[i] -= a[i * n + j] * b[j];
        }
    }
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t j = i + 1; j < n; j++) {
            b[i] -= a[i * n + j] * b[j];
        }
        b[i] /= a[i * n + i];
    }
}

/* the matrix d(u - fed(u))/du, factored */
static int make_matrix(Coupling *c, Stage *s)
{
    const int64_t n = s->n_inputs;
    double *a = c->matrix + s->matrix;
    for (int64_t w = s->first_write; w < s->first_write + s->n_writes; w++) {
        const Group *g = c->writes + w;
        for (int64_t input = g->first; input < g->first + g->n; input++) {
            double *column = a + (input - s->first_input);
            const Face *face = c->faces[g->unit];
            const int offered = face->directional && face->function[F_DIRECTIONAL];
            if (!offered || !column_by_unit(c, s, g->unit, input, column)) {
                const int status = column_by_difference(c, s, input, column);
                if (status >= FMI_DISCARD) {
                    return status;
                }
            }
        }
    }
    for (int64_t i = 0; i < n * n; i++) {
        a[i] = (i % (n + 1) == 0 ? 1.0 : 0.0) - a[i];
    }
    s->ready = factor(a, c->pivot + s->first_input, n);
    return s->ready ? FMI_OK : FMI_DISCARD;
}

static int give_up(Coupling *c, Stage *s)
{
    s->ready = 0;
    c->failed_stage = s - c->stages;
    return FMI_DISCARD;
}

/* Newton's method for u = fed(u); what it starts from is the last solution */
static int solve_loop(Coupling *c, Stage *s)
{
    const int64_t n = s->n_inputs;
    double *u = c->inputs + s->first_input, *step = c->step + s->first_input, *scale = c->scale + s->first_input;
    double last = INFINITY;
    int renewed = 0;
    for (int round = 0; round < NEWTON_STEPS; round++) {
        int status = write_stage(c, s, 0);
        if (!s->ready && status < FMI_DISCARD) {
            status = make_matrix(c, s);
            if (status < FMI_DISCARD) {
                status = write_stage(c, s, 0);
            }
            renewed = 1;
        }
        status = status < FMI_DISCARD ? read_stage(c, s, 0) : status;
        if (status >= FMI_DISCARD) {
            return s->ready ? status : give_up(c, s);
        }
        for (int64_t i = 0; i < n; i++) {
            step[i] = fed(c, s->first_input + i) - u[i];
        }
        solve(c->matrix + s->matrix, c->pivot + s->first_input, n, step);
        c->newton_steps++;
        double size = 0.0;
        for (int64_t i = 0; i < n; i++) {
            u[i] += step[i];
            scale[i] = fmax(scale[i], isfinite(u[i]) ? fabs(u[i]) : 0.0);
            const double part = fabs(step[i]) / fmax(scale[i], 1e-300);
            size = isfinite(u[i]) && part <= 1e300 ? fmax(size, step[i] == 0.0 ? 0.0 : part) : INFINITY;
        }
        if (!isfinite(size)) {
            memset(u, 0, (size_t)n * sizeof *u);
            return give_up(c, s);
        }
        if (size <= newton_exact || (size <= newton_rounding && size > 0.5 * last)) {
            return write_stage(c, s, 0);
        }
        s->ready = renewed || size <= newton_slow * last;
        renewed = 0;
        last = size;
    }
    return give_up(c, s);
}

EXPORT int32_t coupling_exchange(Coupling *c, int32_t event)
{
    int status = FMI_OK;
    c->changed = 0;
    for (int64_t i = 0; i < c->n_stages && status < FMI_DISCARD; i++) {
        Stage *s = c->stages + i;
        const int64_t end = s->first_input + s->n_inputs;
        if (s->loop) {
            double before = 0.0;
            for (int64_t k = s->first_input; k < end; k++) {
                before += fabs(c->inputs[k]);
            }
            status = solve_loop(c, s);
            double after = 0.0, most = 0.0;
            for (int64_t k = s->first_input; k < end; k++) {
                after += fabs(c->inputs[k]);
                most = fmax(most, c->scale[k]);
            }
            c->changed |= fabs(after - before) > same_input * most;
            continue;
        }
        status = read_stage(c, s, event);
        for (int64_t k = s->first_input; k < end; k++) {
            const double value = fed(c, k);
            c->changed |= value != c->inputs[k];
            c->inputs[k] = value;
        }
        status = status < FMI_DISCARD ? write_stage(c, s, event) : status;
    }
    c->stale = status >= FMI_DISCARD;
    return status;
}

static int fresh(Coupling *c)
{
    return c->stale ? coupling_exchange(c, 0) : FMI_OK;
}

static int all_plain(Coupling *c, Function function)
{
    int status = FMI_OK;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {
        status = failed(c, i, face_plain(c->faces[i], function));
    }
    return status;
}

#define CALL(NAME) static fmi2Status coupled_##NAME
#define RETURN(STATUS) return (fmi2Status)(STATUS)

CALL(reset)(fmi2Component m)
{
    Coupling *c = m;
    for (int64_t i = 0; i < c->n_stages; i++) {
        c->stages[i].ready = 0;
    }
    memset(c->inputs, 0, (size_t)c->n_inputs * sizeof *c->inputs);
    memset(c->scale, 0, (size_t)c->n_inputs * sizeof *c->scale);
    RETURN(all_plain(c, F_RESET));
}

CALL(setup)(fmi2Component m, fmi2Boolean given, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
{
    Coupling *c = m;
    c->tolerance = given ? tolerance : 1e-8;
    c->start = start;
    c->stop = ends ? stop : INFINITY;
    RETURN(FMI_OK);
}

CALL(enter_initialization)(fmi2Component m)
{
    Coupling *c = m;
    int status = FMI_OK;
    c->failed_unit = c->failed_stage = -1;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {
        c->next_times[i] = INFINITY;
        status = failed(c, i, face_initialize(c->faces[i], c->start, c->stop, c->tolerance));
    }
    RETURN(status);
}

CALL(exit_initialization)(fmi2Component m)
{
    const int status = coupling_exchange(m, 1);
    RETURN(status >= FMI_DISCARD ? status : all_plain(m, F_EXIT_INITIALIZATION));
}

CALL(enter_event)(fmi2Component m)
{
    const int status = fresh(m);
    RETURN(status >= FMI_DISCARD ? status : all_plain(m, F_ENTER_EVENT));
}

CALL(update)(fmi2Component m, fmi2EventInfo *info)
{
    Coupling *c = m;
    Update all = {0, 0, 0, 0, INFINITY};
    int status = coupling_exchange(c, 1);
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {
        Update one = {0, 0, 0, 0, INFINITY};
        status = failed(c, i, face_update(c->faces[i], &one));
        all.again |= one.again;
        all.terminate |= one.terminate;
        all.nominals_changed |= one.nominals_changed;
        all.states_changed |= one.states_changed;
        all.next_time = fmin(all.next_time, one.next_time);
        if (one.terminate) {
            c->failed_unit = i;
        }
    }
    /* a loop may have another solution after the event */
    for (int64_t i = 0; i < c->n_stages; i++) {
        c->stages[i].ready = 0;
    }
    status = status < FMI_DISCARD && !all.terminate ? coupling_exchange(c, 1) : status;
    info->newDiscreteStatesNeeded = all.again || c->changed;
    info->terminateSimulation = all.terminate;
    info->nominalsOfContinuousStatesChanged = all.nominals_changed;
    info->valuesOfContinuousStatesChanged = all.states_changed;
    info->nextEventTimeDefined = isfinite(all.next_time);
    info->nextEventTime = all.next_time;
    RETURN(status);
}

CALL(enter_continuous)(fmi2Component m)
{
    ((Coupling *)m)->stale = 1;
    RETURN(all_plain(m, F_ENTER_CONTINUOUS));
}

CALL(completed)(fmi2Component m, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *terminate)
{
    Coupling *c = m;
    int status = fresh(c);
    (void)no_set;
    *event = *terminate = 0;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {
        int enters = 0, ends = 0;
        if (c->faces[i]->completes) {
            status = failed(c, i, face_completed(c->faces[i], &enters, &ends));
        }
        *event |= enters;
        *terminate |= ends;
    }
    RETURN(status);
}

CALL(set_time)(fmi2Component m, fmi2Real t)
{
    Coupling *c = m;
    int status = FMI_OK;
    c->stale = 1;
    for (int64_t i = 0; i < c->n_units; i++) {
        status = worse(status, failed(c, i, face_set_time(c->faces[i], t)));
    }
    RETURN(status);
}

CALL(set_states)(fmi2Component m, const fmi2Real *x, size_t n)
{
    Coupling *c = m;
    int status = FMI_OK;
    (void)n;
    c->stale = 1;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {
        status = failed(c, i, face_set_states(c->faces[i], x + c->first_state[i]));
    }
    RETURN(status);
}

/* getters of all units into one vector */
#define GATHER(NAME, EXCHANGE, FACE, FIRST)                                            \
    CALL(NAME)(fmi2Component m, fmi2Real *values, size_t n)                            \
    {                                                                                  \
        Coupling *c = m;                                                               \
        int status = EXCHANGE ? fresh(c) : FMI_OK;                                     \
        (void)n;                                                                       \
        for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {             \
            status = failed(c, i, FACE(c->faces[i], values + c->FIRST[i]));            \
        }                                                                              \
        RETURN(status);                                                                \
    }
GATHER(get_states, 0, face_get_states, first_state)
GATHER(derivatives, 1, face_derivatives, first_state)
GATHER(indicators, 1, face_indicators, first_indicator)
GATHER(nominals, 0, face_nominals, first_state)

/* the next variables from i on that belong to one unit */
static int64_t same_unit(const Coupling *c, const fmi2ValueReference *reference, int64_t i, int64_t n, int32_t *types, uint32_t *references)
{
    int64_t count = 0;
    const int64_t unit = c->variable_unit[reference[i]];
    while (i + count < n && count < BUFFER && c->variable_unit[reference[i + count]] == unit) {
        types[count] = c->variable_types[reference[i + count]];
        references[count] = c->variable_references[reference[i + count]];
        count++;
    }
    return count;
}

CALL(get)(fmi2Component m, const fmi2ValueReference *reference, size_t n, fmi2Real *values)
{
    Coupling *c = m;
    int32_t types[BUFFER];
    uint32_t references[BUFFER];
    int status = fresh(c);
    for (int64_t i = 0; i < (int64_t)n && status < FMI_DISCARD;) {
        const Variables variables = {same_unit(c, reference, i, (int64_t)n, types, references), types, references};
        const int64_t unit = c->variable_unit[reference[i]];
        status = failed(c, unit, face_read(c->faces[unit], &variables, values + i));
        i += variables.n;
    }
    RETURN(status);
}

CALL(set)(fmi2Component m, const fmi2ValueReference *reference, size_t n, const fmi2Real *values)
{
    Coupling *c = m;
    int32_t types[BUFFER];
    uint32_t references[BUFFER];
    int status = FMI_OK;
    c->stale = 1;
    for (int64_t i = 0; i < (int64_t)n && status < FMI_DISCARD;) {
        const Variables variables = {same_unit(c, reference, i, (int64_t)n, types, references), types, references};
        const int64_t unit = c->variable_unit[reference[i]];
        status = failed(c, unit, face_write(c->faces[unit], &variables, values + i));
        i += variables.n;
    }
    RETURN(status);
}

CALL(terminate)(fmi2Component m)
{
    RETURN(all_plain(m, F_TERMINATE));
}

#define PUT(FUNCTION, NAME) face->function[FUNCTION] = (void *)coupled_##NAME
/* the functions of the coupled system; its numbers are filled in by Python */
EXPORT void coupling_face(Face *face, Coupling *c)
{
    face->fmi = 2;
    face->instance = c;
    PUT(F_RESET, reset);
    PUT(F_SETUP, setup);
    PUT(F_ENTER_INITIALIZATION, enter_initialization);
    PUT(F_EXIT_INITIALIZATION, exit_initialization);
    PUT(F_ENTER_EVENT, enter_event);
    PUT(F_UPDATE, update);
    PUT(F_ENTER_CONTINUOUS, enter_continuous);
    PUT(F_COMPLETED, completed);
    PUT(F_SET_TIME, set_time);
    PUT(F_SET_STATES, set_states);
    PUT(F_GET_STATES, get_states);
    PUT(F_GET_DERIVATIVES, derivatives);
    PUT(F_GET_INDICATORS, indicators);
    PUT(F_NOMINALS, nominals);
    PUT(F_TERMINATE, terminate);
    PUT(F_GETTERS, get);
    PUT(F_SETTERS, set);
}

/* for the co-simulation of units one by one */
EXPORT int32_t coupling_read(const Face *face, const Variables *variables, double *values)
{
    return face_read(face, variables, values);
}

EXPORT int32_t coupling_write(const Face *face, const Variables *variables, const double *values)
{
    return face_write(face, variables, values);
}

EXPORT int32_t coupling_plain(const Face *face, int32_t function)
{
    return face_plain(face, (Function)function);
}

EXPORT int32_t coupling_update(const Face *face, Update *update)
{
    return face_update(face, update);
}

EXPORT int32_t coupling_do_step(const Face *face, double t, double length, Stepped *stepped)
{
    return face_do_step(face, t, length, stepped);
}
