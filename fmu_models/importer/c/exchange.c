/*
 * The exchange of values between units: stage by stage read outputs, convert, write inputs; a loop by Newton's method,
 * with a matrix that is kept while it serves.
 */
#include "exchange.h"

#include "../../engine/model/traps.h"
#include "linear.h"

#include <math.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

enum { NEWTON_STEPS = 50 };
static const double newton_exact = 1e-15;    /* relative to the largest value so far: nothing is left to gain */
static const double newton_rounding = 1e-11; /* below it a step that gains nothing any more is rounding */
static const double newton_slow = 0.1;       /* ratio of steps from which a new matrix pays */
static const double same_input = 1e-12;      /* relative: an input of a loop that differs by less has not changed */

int coupling_failed(Coupling *c, int64_t unit, int status)
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
            /* rates first, then the point again: see field.c. Those that fail do so again as rates of the whole system */
            int rates = event ? FMI_OK : fmi_derivatives(c->fmus[g->unit], c->rates);
            const int asked = !event && rates <= FMI_ERROR && c->fmus[g->unit]->n_states; /* none of a Co-Simulation */
            if (asked) rates = fmi_set_time(c->fmus[g->unit], c->time);
            if (rates > FMI_ERROR) return coupling_failed(c, g->unit, rates);
            const Variables variables = {g->n, c->output_types + g->first, c->output_references + g->first, NULL};
            status = coupling_failed(c, g->unit, fmi_read(c->fmus[g->unit], &variables, c->outputs + g->first));
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
            const Variables variables = {g->n, c->input_types + g->first, c->input_references + g->first, NULL};
            status = coupling_failed(c, g->unit, fmi_write(c->fmus[g->unit], &variables, c->inputs + g->first));
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
    const FmuInstance *fmu = c->fmus[unit];
    const double seed = 1.0;
    for (int64_t i = s->first_read; i < s->first_read + s->n_reads; i++) {
        const Group *g = c->reads + i;
        double *values = c->outputs + g->first;
        int status = FMI_OK;
        memset(values, 0, (size_t)g->n * sizeof *values);
        if (g->unit == unit && fmu->fmi == 2) {
            status = (int)((fmi2GetDirectionalDerivativeTYPE *)fmu->function[F_DIRECTIONAL])(
                fmu->instance, c->output_references + g->first, (size_t)g->n, c->input_references + input, 1, &seed,
                values);
        } else if (g->unit == unit) {
            status = (int)((fmi3GetDirectionalDerivativeTYPE *)fmu->function[F_DIRECTIONAL])(
                fmu->instance, c->output_references + g->first, (size_t)g->n, c->input_references + input, 1, &seed, 1,
                values, (size_t)g->n);
        }
        if (status >= FMI_DISCARD) return 0;
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

/* factors of the matrix of a loop, whose entries are of order one; 0: singular */
static int factor(double *a, int *pivot, int n)
{
    if (!linear_real_factor(a, linear_dense(n), pivot)) return 0;
    for (int k = 0; k < n; k++)
        if (!(fabs(a[k * n + k]) > 1e-14)) return 0;
    return 1;
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
            const FmuInstance *fmu = c->fmus[g->unit];
            const int offered = fmu->directional && fmu->function[F_DIRECTIONAL];
            if (!offered || !column_by_unit(c, s, g->unit, input, column)) {
                const int status = column_by_difference(c, s, input, column);
                if (status >= FMI_DISCARD) return status;
            }
        }
    }
    for (int64_t i = 0; i < n * n; i++)
        a[i] = (i % (n + 1) == 0 ? 1.0 : 0.0) - a[i];
    s->ready = factor(a, c->pivot + s->first_input, (int)n);
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
            if (status < FMI_DISCARD) status = write_stage(c, s, 0);
            renewed = 1;
        }
        status = status < FMI_DISCARD ? read_stage(c, s, 0) : status;
        if (status >= FMI_DISCARD) return s->ready ? status : give_up(c, s);
        for (int64_t i = 0; i < n; i++)
            step[i] = fed(c, s->first_input + i) - u[i];
        linear_real_solve(c->matrix + s->matrix, linear_dense((int)n), c->pivot + s->first_input, step);
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
        if (size <= newton_exact || (size <= newton_rounding && size > 0.5 * last)) return write_stage(c, s, 0);
        s->ready = renewed || size <= newton_slow * last;
        renewed = 0;
        last = size;
    }
    return give_up(c, s);
}

EXPORT int32_t coupling_exchange(Coupling *c, int32_t event)
{
    TRAPS_REST;
    int status = FMI_OK;
    c->changed = 0;
    for (int64_t i = 0; i < c->n_stages && status < FMI_DISCARD; i++) {
        Stage *s = c->stages + i;
        const int64_t end = s->first_input + s->n_inputs;
        if (s->loop) {
            double before = 0.0;
            for (int64_t k = s->first_input; k < end; k++)
                before += fabs(c->inputs[k]);
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
