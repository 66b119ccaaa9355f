/*
 * The clocks of an FMU (FMI 3).
 *
 *     periodic     at start + shift + k * interval
 *     changing     the FMU tells the interval to the next tick at each tick
 *     countdown    it tells it at any event, relative to that event
 *     asked        at the times that the user gives
 *     output       the FMU ticks, in event mode
 *
 *     an instant:  clocks that are due are set; the FMU's own are read; variables that have one of them are read
 *                  discrete states are updated; intervals are asked for; once more where the FMU wants it, or where a
 *                  clock is due again
 */
#include "ticking.h"

#include "field.h"

#include "fmi3FunctionTypes.h"

#include <math.h>
#include <string.h>

static Outcome failed_call(Master *m, Function function, int status)
{
    return status >= FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->t, function, status) : FINE;
}

/* a number of a clock that is none for it: its interval, or its shift */
static Outcome bad_clock(Master *m, const MasterClock *clock, double value, int is_shift)
{
    m->run->report_other = is_shift;
    return field_report(m, RUN_BAD_CLOCK, m->t, clock - m->run->clocks, value);
}

static void note_tick(Master *m, MasterClock *clock)
{
    Run *r = m->run;
    clock->ticks++;
    if (r->n_ticks < r->tick_capacity) r->ticks[r->n_ticks++] = (MasterTick){m->t, clock - r->clocks};
}

/* the FMU tells when the clock ticks next, relative to now */
static Outcome ask_interval(Master *m, MasterClock *clock)
{
    double interval = 0.0;
    int qualifier = 0;
    const Outcome outcome =
        failed_call(m, F_GET_INTERVAL, fmi_get_interval(m->fmu, clock->reference, &interval, &qualifier));
    /* a countdown that has not changed is counted already, or over */
    const int old = qualifier == fmi3IntervalUnchanged && clock->kind == CLOCK_COUNTDOWN;
    if (outcome != FINE || qualifier == fmi3IntervalNotYetKnown || old) return outcome;
    if (!(interval >= 0.0 && isfinite(interval))) return bad_clock(m, clock, interval, 0);
    if (clock->kind == CLOCK_PERIODIC)
        clock->interval = interval;
    else
        clock->next = m->t + interval;
    return FINE;
}

static Outcome begin_clock(Master *m, MasterClock *clock)
{
    Outcome outcome = FINE;
    clock->ticks = clock->later = 0;
    clock->next = INFINITY;
    if (clock->asks && clock->kind != CLOCK_OUTPUT && clock->kind != CLOCK_ASKED) outcome = ask_interval(m, clock);
    if (clock->kind == CLOCK_PERIODIC) {
        if (outcome == FINE && clock->asks)
            outcome = failed_call(m, F_GET_SHIFT, fmi_get_shift(m->fmu, clock->reference, &clock->shift));
        if (outcome == FINE && !(clock->interval > 0.0 && isfinite(clock->interval)))
            return bad_clock(m, clock, clock->interval, 0);
        if (outcome == FINE && !(clock->shift >= 0.0 && isfinite(clock->shift)))
            return bad_clock(m, clock, clock->shift, 1);
        clock->next = m->run->start + clock->shift;
    }
    if (clock->kind == CLOCK_ASKED && clock->n_times > 0) clock->next = clock->times[0];
    return outcome;
}

/* the variables that have one of the clocks, whose bits are set */
static Outcome read_clocked(Master *m, int64_t active)
{
    const Variables *all = &m->run->clocked;
    double *values = m->clocked;
    for (int64_t i = 0, size; i < all->n; i += size) {
        size = all->sizes[i];
        if (!(m->run->kept[i].clocks & active)) continue;
        const Variables one = {size, all->types + i, all->references + i, all->sizes + i};
        const Outcome outcome = failed_call(m, F_GETTERS, fmi_read(m->fmu, &one, values));
        if (outcome != FINE) return outcome;
        for (int64_t k = 0; k < size; k++)
            m->run->kept[i + k].value = values[k];
    }
    return FINE;
}

Outcome ticking_begin(Master *m)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    for (int64_t i = 0; i < r->n_clocks && outcome == FINE; i++)
        outcome = begin_clock(m, r->clocks + i);
    return outcome == FINE ? read_clocked(m, (int64_t)1 << MOST_CLOCKS) : outcome;
}

double ticking_next(const Master *m)
{
    const Run *r = m->run;
    double next = INFINITY;
    for (int64_t i = 0; i < r->n_clocks; i++)
        next = fmin(next, r->clocks[i].next);
    return next;
}

/* the clock ticks now, and later again */
static void tick_now(Master *m, MasterClock *clock)
{
    note_tick(m, clock);
    clock->later++;
    clock->next = INFINITY;
    if (clock->kind == CLOCK_PERIODIC)
        clock->next = m->run->start + clock->shift + (double)clock->later * clock->interval;
    else if (clock->kind == CLOCK_ASKED && clock->later < clock->n_times)
        clock->next = clock->times[clock->later];
}

/* the FMU's own clocks that tick; their bits are added */
static Outcome read_outputs(Master *m, int64_t *active)
{
    Run *r = m->run;
    for (int64_t i = 0; i < r->n_clocks; i++) {
        int ticks = 0;
        if (r->clocks[i].kind != CLOCK_OUTPUT) continue;
        if (failed_call(m, F_GET_CLOCK, fmi_get_clock(m->fmu, r->clocks[i].reference, &ticks)) != FINE) return STOP;
        if (ticks) {
            note_tick(m, r->clocks + i);
            *active |= (int64_t)1 << i;
        }
    }
    return FINE;
}

/* what the FMU tells of the clocks that have just ticked, and of countdowns */
static Outcome ask_intervals(Master *m, int64_t active, int countdowns)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    for (int64_t i = 0; i < r->n_clocks && outcome == FINE; i++) {
        const int kind = r->clocks[i].kind;
        if (kind == CLOCK_COUNTDOWN ? countdowns : kind == CLOCK_CHANGING && (active >> i & 1))
            outcome = ask_interval(m, r->clocks + i);
    }
    return outcome;
}

Outcome ticking_update(Master *m, int *nominals)
{
    const FmuInstance *fmu = m->fmu;
    Run *r = m->run;
    Update update = {1, 0, 0, 0, INFINITY};
    *nominals = 0;
    for (int round = 0; (update.again || ticking_next(m) <= m->t) && !m->terminate; round++) {
        int64_t active = 0;
        if (round > master_tolerances.event_iterations) return field_report(m, RUN_EVENT_ITERATION, m->t, -1, round);
        for (int64_t i = 0; i < r->n_clocks; i++) {
            if (r->clocks[i].next <= m->t) {
                tick_now(m, r->clocks + i);
                active |= (int64_t)1 << i;
                if (failed_call(m, F_SET_CLOCK, fmi_set_clock(fmu, r->clocks[i].reference)) != FINE) return STOP;
            }
        }
        if (read_outputs(m, &active) != FINE || (active && read_clocked(m, active) != FINE)) return STOP;
        if (failed_call(m, F_UPDATE, fmi_update(fmu, &update)) != FINE || ask_intervals(m, active, 1) != FINE)
            return STOP;
        *nominals |= update.nominals_changed;
        m->terminate |= update.terminate;
    }
    if (isnan(update.next_time)) return field_report(m, RUN_BAD_EVENT_TIME, m->t, -1, update.next_time);
    m->next_event = fmin(update.next_time, ticking_next(m));
    return FINE;
}

void ticking_record(Master *m)
{
    Run *r = m->run;
    for (int64_t i = 0; i < r->clocked.n; i++)
        r->clocked_values[r->next_time * r->clocked.n + i] = r->kept[i].value;
}

void ticking_told(Master *m)
{
    if (read_outputs(m, &m->told) == FINE) ask_intervals(m, 0, 1);
}

Outcome ticking_activate(Master *m)
{
    Run *r = m->run;
    const int64_t most = master_tolerances.event_iterations * (r->n_clocks + 1);
    for (int64_t round = 0; ticking_next(m) <= m->t; round++) {
        MasterClock *first = NULL;
        for (int64_t i = 0; i < r->n_clocks; i++) {
            MasterClock *one = r->clocks + i;
            if (one->next <= m->t && (!first || one->priority < first->priority)) first = one;
        }
        if (round > most) return field_report(m, RUN_EVENT_ITERATION, m->t, -1, (double)round);
        const int64_t active = (int64_t)1 << (first - r->clocks);
        m->told = 0;
        tick_now(m, first);
        if (failed_call(m, F_ACTIVATE, fmi_activate(m->fmu, first->reference, m->t)) != FINE || m->ended) return STOP;
        if (ask_intervals(m, active, 0) != FINE || read_clocked(m, active | m->told) != FINE) return STOP;
    }
    return FINE;
}

int ticking_full(const Master *m)
{
    const Run *r = m->run;
    return r->tick_capacity > 0
           && r->n_ticks + r->n_clocks * (master_tolerances.event_iterations + 2) > r->tick_capacity;
}
