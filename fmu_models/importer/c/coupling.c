/*
 * The coupled system as an FMU 2.0 (see exchange.h).
 *
 *     evaluate:  time and states into all units, exchange, derivatives or indicators of all
 *     event:     all units enter event mode; every update is one of all units, with an exchange before and after it;
 *                another is needed as long as a unit asks for it or an input has changed
 */
#include "exchange.h"

#include <math.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

enum { BUFFER = 64 }; /* variables read in one call */

static int worse(int one, int two) { return one > two ? one : two; }

static int fresh(Coupling *c) { return c->stale ? coupling_exchange(c, 0) : FMI_OK; }

static int all_plain(Coupling *c, Function function)
{
    int status = FMI_OK;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++)
        status = coupling_failed(c, i, fmi_plain(c->fmus[i], function));
    return status;
}

#define CALL(NAME) static fmi2Status coupled_##NAME
#define RETURN(STATUS) return (fmi2Status)(STATUS)

CALL(reset)(fmi2Component m)
{
    Coupling *c = m;
    for (int64_t i = 0; i < c->n_stages; i++)
        c->stages[i].ready = 0;
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
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++)
        status = coupling_failed(c, i, fmi_initialize(c->fmus[i], c->start, c->stop, c->tolerance));
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
        status = coupling_failed(c, i, fmi_update(c->fmus[i], &one));
        all.again |= one.again;
        all.terminate |= one.terminate;
        all.nominals_changed |= one.nominals_changed;
        all.states_changed |= one.states_changed;
        /* a time that is none stays, for the run to refuse it */
        if (!(all.next_time <= one.next_time) && !isnan(all.next_time)) all.next_time = one.next_time;
        if (one.terminate) c->failed_unit = i;
    }
    /* a loop may have another solution after the event */
    for (int64_t i = 0; i < c->n_stages; i++)
        c->stages[i].ready = 0;
    status = status < FMI_DISCARD && !all.terminate ? coupling_exchange(c, 1) : status;
    info->newDiscreteStatesNeeded = all.again || c->changed;
    info->terminateSimulation = all.terminate;
    info->nominalsOfContinuousStatesChanged = all.nominals_changed;
    info->valuesOfContinuousStatesChanged = all.states_changed;
    info->nextEventTimeDefined = all.next_time != INFINITY;
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
        if (c->fmus[i]->completes) status = coupling_failed(c, i, fmi_completed(c->fmus[i], &enters, &ends));
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
    c->time = t;
    for (int64_t i = 0; i < c->n_units; i++)
        status = worse(status, coupling_failed(c, i, fmi_set_time(c->fmus[i], t)));
    RETURN(status);
}

CALL(set_states)(fmi2Component m, const fmi2Real *x, size_t n)
{
    Coupling *c = m;
    int status = FMI_OK;
    (void)n;
    c->stale = 1;
    for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++)
        status = coupling_failed(c, i, fmi_set_states(c->fmus[i], x + c->first_state[i]));
    RETURN(status);
}

/* getters of all units into one vector */
#define GATHER(NAME, EXCHANGE, FACE, FIRST)                                                                            \
    CALL(NAME)(fmi2Component m, fmi2Real * values, size_t n)                                                           \
    {                                                                                                                  \
        Coupling *c = m;                                                                                               \
        int status = EXCHANGE ? fresh(c) : FMI_OK;                                                                     \
        (void)n;                                                                                                       \
        for (int64_t i = 0; i < c->n_units && status < FMI_DISCARD; i++) {                                             \
            status = coupling_failed(c, i, FACE(c->fmus[i], values + c->FIRST[i]));                                    \
        }                                                                                                              \
        RETURN(status);                                                                                                \
    }
GATHER(get_states, 0, fmi_get_states, first_state)
GATHER(derivatives, 1, fmi_derivatives, first_state)
GATHER(indicators, 1, fmi_indicators, first_indicator)
GATHER(nominals, 0, fmi_nominals, first_state)

/* the next variables from i on that belong to one unit */
static int64_t same_unit(const Coupling *c, const fmi2ValueReference *reference, int64_t i, int64_t n, int32_t *types,
                         uint32_t *references)
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

static int coupled_pass(Coupling *c, const fmi2ValueReference *reference, int64_t n, double *values, int writing)
{
    int32_t types[BUFFER];
    uint32_t references[BUFFER];
    int status = FMI_OK;
    for (int64_t i = 0; i < n && status < FMI_DISCARD;) {
        const Variables variables = {same_unit(c, reference, i, n, types, references), types, references, NULL};
        const int64_t unit = c->variable_unit[reference[i]];
        const FmuInstance *fmu = c->fmus[unit];
        status = coupling_failed(
            c, unit, writing ? fmi_write(fmu, &variables, values + i) : fmi_read(fmu, &variables, values + i));
        i += variables.n;
    }
    return status;
}

CALL(get)(fmi2Component m, const fmi2ValueReference *reference, size_t n, fmi2Real *values)
{
    const int status = fresh(m);
    RETURN(status < FMI_DISCARD ? coupled_pass(m, reference, (int64_t)n, values, 0) : status);
}

CALL(set)(fmi2Component m, const fmi2ValueReference *reference, size_t n, const fmi2Real *values)
{
    ((Coupling *)m)->stale = 1;
    RETURN(coupled_pass(m, reference, (int64_t)n, (double *)values, 1));
}

CALL(terminate)(fmi2Component m) { RETURN(all_plain(m, F_TERMINATE)); }

#define PUT(FUNCTION, NAME) fmu->function[FUNCTION] = (void *)coupled_##NAME
/* the functions of the coupled system; its numbers are filled in by Python */
EXPORT void coupling_fill(FmuInstance *fmu, Coupling *c)
{
    fmu->fmi = 2;
    fmu->instance = c;
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
