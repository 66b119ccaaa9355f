/* An instance: its life, time stepping and the messages it writes. Contract in instance.h. */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

#include "../events/model_exchange.h"
#include "../events/run.h"
#include "../events/transition.h"
#include "../model/signals.h"
#include "../model/traps.h"

RARE Instance *instance_new(const char *name, const char *token, int co_simulation, Say say, void (*logger)(void),
                            void *environment, int logging, int quiet)
{
    TRAPS_REST;
    Instance *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    m->core.co_simulation = co_simulation;
    m->say = say;
    m->logger = logger;
    m->environment = environment;
    m->categories = logging ? LOG_ALL : 0;
    m->input_order = 1;
    m->quiet = quiet;
    snprintf(m->name, sizeof m->name, "%s", name && name[0] ? name : MODEL_NAME);
    if (!token || strcmp(token, MODEL_TOKEN) != 0) {
        instance_refuse(m, "instantiate: the token is '%s' but this FMU has '%s'; take it from modelDescription.xml",
                        token ? token : "NULL", MODEL_TOKEN);
        free(m);
        return NULL;
    }
    instance_reset(m);
    return m;
}

void instance_free(Instance *m)
{
    if (!m || instance_enter(m, PHASES_SETTABLE, __func__)) return;
    while (m->fmu_states) {
        FmuState *next = m->fmu_states->next;
        free(m->fmu_states);
        m->fmu_states = next;
    }
    free(m->derivatives);
    free(m);
}

Status instance_refuse(Instance *m, const char *format, ...)
{
    char message[512];
    va_list arguments;
    if (!m->logger || (m->quiet && !(m->categories & LOG_ERROR))) return STATUS_ERROR;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    m->say(m, STATUS_ERROR, "logStatusError", message);
    return STATUS_ERROR;
}

static int is_wanted(const Instance *m, LogCategory category) { return m->logger && m->categories & category; }

Status instance_not_provided(Instance *m, const char *function, const char *reason)
{
    return m ? instance_refuse(m, "%s: %s", function, reason) : STATUS_ERROR;
}

static void say_event(Instance *m, const ContactEvent *event)
{
    char message[512];
    int used = snprintf(message, sizeof message, "t = %.10g: %s_state %s %d", event->time,
                        model_contact_names[event->contact], event->before == event->after ? "stays" : "becomes",
                        event->after);
    if (event->work != 0.0 && used < (int)sizeof message)
        snprintf(message + used, sizeof message - (size_t)used, ", impact with work %.6g J", event->work);
    m->say(m, STATUS_OK, "logEvents", message);
}

/* the ticks of an event among those of the clocks of its contact */
static int ticks_of(const Run *r, const ContactEvent *event)
{
    const int c = event->contact;
    int ticks = (r->struck[c] ? TICK_IMPACT : 0) | (event->reset ? TICK_RESET : 0);
    if (event->after != event->before) {
        switch (event->after) {
        case CONTACT_STICK: ticks |= TICK_STICK; break;
        case CONTACT_SLIP_MINUS:
        case CONTACT_SLIP_PLUS: ticks |= TICK_SLIP; break;
        case CONTACT_TOUCHING:
            ticks |= event->before == CONTACT_AWAY && model_contact_compliant[c] ? TICK_IMPACT : 0;
            break;
        default: break;
        }
    }
    return ticks & model_contact_clocks[c];
}

void instance_note(void *instance, const ContactEvent *event)
{
    Instance *m = instance;
    m->core.ticks[event->contact] |= (unsigned char)ticks_of(&m->core.run, event);
    if (is_wanted(m, LOG_EVENT)) say_event(m, event);
}

static const char *phase_name(int phase)
{
    switch (phase) {
    case PHASE_INSTANTIATED: return "before initialization";
    case PHASE_INITIALIZATION: return "in initialization mode";
    case PHASE_EVENT: return "in event mode";
    case PHASE_CONTINUOUS: return "in continuous-time mode";
    case PHASE_STEP: return "in step mode";
    case PHASE_INTERMEDIATE: return "in intermediate update mode";
    case PHASE_TERMINATED: return "after termination";
    default: return "after an error";
    }
}

RARE Status instance_enter(Instance *m, int phases, const char *function)
{
    if (!m) return STATUS_ERROR;
    if (m->core.phase & phases) return STATUS_OK;
    return instance_refuse(m, "%s: not allowed %s of %s", function, phase_name(m->core.phase),
                           m->core.co_simulation ? "Co-Simulation" : "Model Exchange");
}

Status instance_array(Instance *m, const void *array, size_t n, const char *function, const char *what)
{
    if (array || n == 0) return STATUS_OK;
    return instance_refuse(m, "%s: %s is NULL", function, what);
}

Status instance_same(Instance *m, const char *function, size_t n, size_t n_values)
{
    if (n == n_values) return STATUS_OK;
    return instance_refuse(m, "%s: %zu values for %zu references of scalar variables", function, n_values, n);
}

static Status check_size(Instance *m, const char *function, size_t n, size_t expected, const char *what)
{
    if (n == expected) return STATUS_OK;
    return instance_refuse(m, "%s: %zu %s given, the model has %zu", function, n, what, expected);
}

Status instance_log(Instance *m, const char *function, int on, size_t n, const char *const categories[])
{
    static const char *const names[] = {"logStatusError", "logStatusWarning", "logEvents"};
    int wanted = n ? 0 : LOG_ALL;
    if (instance_enter(m, PHASES_ALL, function) || instance_array(m, categories, n, function, "categories"))
        return STATUS_ERROR;
    for (size_t i = 0; i < n; i++) {
        int k = 0;
        while (k < 3 && !(categories[i] && strcmp(categories[i], names[k]) == 0))
            k++;
        if (k == 3)
            return instance_refuse(m, "%s: unknown category '%s'; there are %s, %s and %s", function,
                                   categories[i] ? categories[i] : "NULL", names[0], names[1], names[2]);
        wanted |= 1 << k;
    }
    m->categories = on ? wanted : 0;
    return STATUS_OK;
}

/* the finest tolerance that makes a difference */
static double resolved(Instance *m, const char *function, double tolerance)
{
    char message[256];
    if (tolerance >= DBL_EPSILON) return tolerance;
    if (is_wanted(m, LOG_WARNING)) {
        snprintf(message, sizeof message, "%s: tolerance %g is finer than numbers are; %g is used", function, tolerance,
                 DBL_EPSILON);
        m->say(m, STATUS_WARNING, "logStatusWarning", message);
    }
    return DBL_EPSILON;
}

Status instance_failed(Instance *m, const char *function)
{
    m->core.phase = PHASE_FAILED;
    return instance_refuse(m, "%s: at time %.17g: %s", function, m->core.run.at.time, m->core.run.message);
}

static RARE Status check_parameters(Instance *m, const char *function)
{
    const char *violation = model_violation(m->core.run.at.p);
    return violation ? instance_refuse(m, "%s: %s", function, violation) : STATUS_OK;
}

RARE Status instance_reset(Instance *m)
{
    TRAPS_REST;
    run_reset(&m->core.run);
    m->core.phase = PHASE_INSTANTIATED;
    m->core.settled = m->core.event_pending = 0;
    memset(m->core.ticks, 0, sizeof m->core.ticks);
    m->core.stop_defined = 0;
    m->core.start_time = m->core.stop_time = 0.0;
    return STATUS_OK;
}

Status instance_set_up(Instance *m, const char *function, int tolerance_defined, double tolerance, double start_time,
                       int stop_defined, double stop_time)
{
    TRAPS_REST;
    Core *core = &m->core;
    if (!isfinite(start_time)) return instance_refuse(m, "%s: the start time is not finite", function);
    if (stop_defined && !(stop_time >= start_time))
        return instance_refuse(m, "%s: stop time %g lies before start time %g", function, stop_time, start_time);
    if (tolerance_defined && !(tolerance > 0.0))
        return instance_refuse(m, "%s: tolerance %g is not positive", function, tolerance);
    if (tolerance_defined) tolerance = resolved(m, function, tolerance);
    /* the default is so cheap that a looser request would save nothing, and sharp events need it */
    core->run.tolerances = run_default_tolerances;
    core->run.tolerances.drift = core->co_simulation ? 0.0 : tolerance_defined ? tolerance : 1e-6;
    if (tolerance_defined && tolerance < core->run.tolerances.step) core->run.tolerances.step = tolerance;
    core->run.at.time = core->start_time = core->first_step = start_time;
    core->iterations = 0;
    core->stop_defined = stop_defined;
    core->stop_time = stop_time;
    core->settled = 0;
    run_touched(&core->run);
    return STATUS_OK;
}

RARE Status instance_exit_initialization(Instance *m, const char *function)
{
    TRAPS_REST;
    if (instance_settle(m, function, NULL)) return STATUS_ERROR;
    m->core.phase = m->core.co_simulation && !m->event_mode_used ? PHASE_STEP : PHASE_EVENT;
    return STATUS_OK;
}

RARE Status instance_settle(Instance *m, const char *function, int *changed)
{
    TRAPS_REST;
    Core *core = &m->core;
    signed char before[MODEL_ROOM(MODEL_NC)];
    if (changed) *changed = 0;
    if (core->settled) return STATUS_OK;
    if (check_parameters(m, function)) return STATUS_ERROR;
    if (core->phase == PHASE_INITIALIZATION) {
        /* start values can still be mended and the mode left again: no failure of the run yet */
        if (run_initialize(&core->run) == RUN_ERROR) return instance_refuse(m, "%s: %s", function, core->run.message);
        if (changed) *changed = 1;
    } else {
        memcpy(before, core->run.at.state, sizeof before);
        if (run_reconsider(&core->run, changed) == RUN_ERROR) return instance_failed(m, function);
        transition_tell(&core->run, before, instance_note, m);
    }
    core->settled = 1;
    return STATUS_OK;
}

RARE Status instance_enter_event(Instance *m, const char *function)
{
    TRAPS_REST;
    int from = m && m->core.co_simulation && m->event_mode_used ? PHASE_STEP : PHASE_CONTINUOUS;
    if (instance_enter(m, from, function)) return STATUS_ERROR;
    m->core.phase = PHASE_EVENT;
    m->core.event_pending = !m->core.co_simulation;
    m->core.event_moved = 0;
    return STATUS_OK;
}

RARE Status instance_resolve(Instance *m, const char *function)
{
    TRAPS_REST;
    Core *core = &m->core;
    signed char before[MODEL_ROOM(MODEL_NC)];
    int moved = 0;
    if (!core->event_pending) return STATUS_OK;
    core->event_pending = 0;
    memcpy(before, core->run.at.state, sizeof before);
    if (exchange_event(&core->run, &moved) == RUN_ERROR) return instance_failed(m, function);
    transition_tell(&core->run, before, instance_note, m);
    core->event_moved |= moved;
    if (core->run.tick > core->run.at.time) return STATUS_OK;
    if (transition_tick(&core->run, instance_note, m) == RUN_ERROR) return instance_failed(m, function);
    core->event_moved = 1; /* the rates may have jumped */
    return STATUS_OK;
}

Status instance_evaluate(Instance *m, const char *function)
{
    TRAPS_REST;
    int moved = 0;
    if (check_parameters(m, function) || instance_resolve(m, function)) return STATUS_ERROR;
    /* values that were set make the rates jump, although no state moves: importers that start their method anew only
       when they are told to must be told of that as well */
    m->core.event_moved |= !m->core.settled;
    if (instance_settle(m, function, &moved)) return STATUS_ERROR;
    m->core.event_moved |= moved;
    return STATUS_OK;
}

Status instance_update(Instance *m, const char *function, int *changed)
{
    TRAPS_REST;
    *changed = 0;
    if (instance_evaluate(m, function)) return STATUS_ERROR;
    *changed = m->core.event_moved;
    m->core.event_moved = 0;
    return STATUS_OK;
}

Status instance_set_time(Instance *m, const char *function, double time)
{
    TRAPS_REST;
    if (instance_enter(m, PHASE_EVENT | PHASE_CONTINUOUS, function)) return STATUS_ERROR;
    if (!isfinite(time)) return instance_refuse(m, "%s: the time is not finite", function);
    if (time == m->core.run.at.time) return STATUS_OK;
    m->core.run.at.time = time;
    signals_load(&m->core.run.at);
    run_touched(&m->core.run);
    return STATUS_OK;
}

Status instance_set_states(Instance *m, const char *function, const double *x, size_t n)
{
    if (instance_enter(m, PHASE_CONTINUOUS, function)) return STATUS_ERROR;
    if (check_size(m, function, n, MODEL_FLOWING, "states") || instance_array(m, x, n, function, "states"))
        return STATUS_ERROR;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i])) return instance_refuse(m, "%s: state %zu is not finite", function, i);
    if (n) memcpy(m->core.run.at.x, x, n * sizeof *x);
    run_touched(&m->core.run);
    return STATUS_OK;
}

/* Model Exchange results exist from initialization on; there they need contact states that fit the start values */
static Status check_result(Instance *m, const char *function, const void *result, size_t n, size_t expected,
                           const char *what)
{
    int phases = PHASES_READABLE & ~PHASE_STEP;
    if (instance_enter(m, phases, function) || check_size(m, function, n, expected, what)) return STATUS_ERROR;
    if (instance_array(m, result, n, function, what)) return STATUS_ERROR;
    return m->core.phase == PHASE_INITIALIZATION ? instance_settle(m, function, NULL) : STATUS_OK;
}

static Status checked(Instance *m, const char *function, RunStatus status)
{
    return status == RUN_ERROR ? instance_refuse(m, "%s: %s", function, m->core.run.message) : STATUS_OK;
}

Status instance_states(Instance *m, const char *function, double *x, size_t n)
{
    if (check_result(m, function, x, n, MODEL_FLOWING, "states")) return STATUS_ERROR;
    if (n) memcpy(x, m->core.run.at.x, n * sizeof *x);
    return STATUS_OK;
}

Status instance_nominals(Instance *m, const char *function, double *x, size_t n)
{
    if (check_result(m, function, x, n, MODEL_FLOWING, "nominal values")) return STATUS_ERROR;
    if (n) memcpy(x, model_nominal_states, n * sizeof *x);
    return STATUS_OK;
}

Status instance_derivatives(Instance *m, const char *function, double *dx, size_t n)
{
    TRAPS_REST;
    if (check_result(m, function, dx, n, MODEL_FLOWING, "derivatives")) return STATUS_ERROR;
    return n ? checked(m, function, exchange_derivatives(&m->core.run, dx)) : STATUS_OK;
}

Status instance_indicators(Instance *m, const char *function, double *z, size_t n)
{
    TRAPS_REST;
    if (check_result(m, function, z, n, MODEL_NI, "event indicators")) return STATUS_ERROR;
    return n ? checked(m, function, exchange_indicators(&m->core.run, z)) : STATUS_OK;
}
