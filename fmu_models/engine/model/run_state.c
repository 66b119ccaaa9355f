/* The state of a run: start values, and what an error says. */
#include "run_state.h"

#include "signals.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

const Tolerances run_default_tolerances = {
    .step = 1e-14,
    .slip = 1e-13,
    .lever = 1e-3,
    .energy = 1e-9,
    .margin = 1e-10,
    .importer = 1e-10,
    .drift = 0.0,
    .chatter = 1e-8,
    .accumulation_span = 1e-9,
    .graze = 1e-7,
    .max_iterations = 1000,
    .pace_steps = 1000000,
    .paced_least = 8192,
    .most_events = 1e9,
    .most_paces_left = 1000.0,
};

RunStatus run_fail(Run *r, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(r->message, sizeof r->message, format, arguments);
    va_end(arguments);
    return RUN_ERROR;
}

void run_name_contacts(const int *contact, int count, char *names, size_t size)
{
    names[0] = 0;
    for (int i = 0; i < count; i++) {
        const size_t used = strlen(names);
        snprintf(names + used, size - used, "%s'%s'", i ? ", " : "", model_contact_names[contact[i]]);
    }
}

void run_touched(Run *r)
{
    r->segment_valid = 0;
    memset(r->at.known, 0, sizeof r->at.known);
}

void run_parameters_changed(Run *r)
{
    run_touched(r);
    r->linear_known = 0;
    model_prepare(r->at.p, r->at.d);
    model_inertia(r->at.p, r->at.d, &r->jets, 0);
    model_inertia(r->at.p, r->at.d, &r->scratch, 0);
    run_place_signals(r);
}

/* the piece of signal i, from the knot at or before a time up to the next; returns when that comes */
static double place_signal(Point *at, int i, double time)
{
    Signal s;
    const int last = model_signal(at->p, at->d, i, &s) - 1;
    int k = last;
    if (!(s.period > 0.0)) return INFINITY;                  /* refused before anything moves */
    double cycle = floor((time - s.start) / s.period) + 1.0; /* one too late at least, whatever rounding does */
    while (signals_knot(at, i, cycle, 0) > time)
        cycle -= 1.0;
    while (k > 0 && (k == last || signals_knot(at, i, cycle, k) > time))
        k--;
    at->cycle[i] = cycle;
    at->piece[i] = (short)k;
    return signals_knot(at, i, cycle, k + 1);
}

void run_place_signals(Run *r)
{
    r->tick = INFINITY;
    for (int i = 0; i < MODEL_NS; i++)
        r->tick = fmin(r->tick, place_signal(&r->at, i, r->at.time));
    signals_load(&r->at);
}

void run_shift_time(Run *r, double by)
{
    double *const times[] = {&r->at.time,    &r->horizon,    &r->tick,       &r->segment_start, &r->accumulation_start,
                             &r->last_event, &r->paced_time, &r->pace_start, &r->goal};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        *times[i] += by;
    for (int c = 0; c < MODEL_NC; c++) {
        r->at.settles[c] += by;
        r->closings[c].struck += by;
        r->closings[c].closed += by;
    }
    for (int i = 0; i < MODEL_NS; i++) {
        Signal s;
        model_signal(r->at.p, r->at.d, i, &s);
        r->at.cycle[i] += round(by / s.period);
    }
    if (!(r->tick > r->at.time)) r->tick = nextafter(r->at.time, INFINITY); /* rounding has taken what was left */
}

void run_reset(Run *r)
{
    memset(r, 0, offsetof(Run, linear));
    r->tolerances = run_default_tolerances;
    r->horizon = INFINITY;
    r->goal = -INFINITY;
    memcpy(r->at.p, model_start_parameters, sizeof r->at.p);
    memcpy(r->at.u, model_start_inputs, sizeof r->at.u);
    memcpy(r->at.x, model_start_states, sizeof r->at.x);
    run_parameters_changed(r);
}

RunStatus run_check_finite(Run *r, const char *what, const double *values, int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(values[i])) return run_fail(r, "%s %d is not finite at t = %.17g", what, i, r->at.time);
    return RUN_OK;
}

RARE RunStatus run_check_mass(Run *r, const Jets *j)
{
    for (int i = 0; i < MODEL_NV && MODEL_NM > 0; i++) {
        if (!(j->factor[model_mass_row[i] + i] > 0.0)) {
            return run_fail(
                r,
                "the mass matrix is not positive definite at t = %.17g: some motion has no positive kinetic "
                "energy there. Look at the signs and cross terms of the kinetic energy",
                r->at.time);
        }
    }
    return RUN_OK;
}
