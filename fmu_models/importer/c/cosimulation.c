/*
 * A run of an FMU by Co-Simulation. The communication points are given as knots of a grid by Python (output times,
 * steps as asked and jumps of inputs, merged): from each to the next the FMU steps by itself.
 *
 *     at a point: inputs after their jump (in event mode where the FMU has one and they jump), then doStep
 *     returns early, or asks for an event: event mode, iterated; the next time event of the FMU is a communication
 *     point too then on to the same point, until it is reached
 */
#include "cosimulation.h"

#include "field.h"
#include "recording.h"
#include "ticking.h"
#include "zeno.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* those inputs that may be set inside a step */
static void look_inputs(Master *m, double t)
{
    const Run *r = m->run;
    while (m->shown > 0 && r->shown_times[m->shown] > t) /* an FMU may ask ahead, and then again */
        m->shown--;
    while (m->shown + 1 < r->n_shown && r->shown_times[m->shown + 1] <= t)
        m->shown++;
    const int64_t row = m->shown * r->inputs.n;
    const double since = t - r->shown_times[m->shown];
    for (int64_t i = 0; i < r->inputs.n; i++) {
        const Variables one = {1, r->inputs.types + i, r->inputs.references + i, NULL};
        const double value = r->shown_values[row + i] + since * r->shown_rates[row + i];
        const int status = r->shown_inputs[i] ? fmi_write(m->fmu, &one, &value) : FMI_OK;
        if (status >= FMI_DISCARD) field_report(m, RUN_FMI_ERROR, t, F_SETTERS, status);
    }
}

#define REPORT(STATUS, INDEX, VALUE) (field_report(m, STATUS, m->t, INDEX, VALUE), m->ended)

/*
 * The callback handed to FMUs that show themselves inside a step: inputs that they ask for, at the time they are at;
 * and a return from a step so long that the caller waits
 */
EXPORT void master_look(void *environment, double t, bool sets, bool gets, bool finished, bool can_return,
                        bool *returns, double *until)
{
    const Log *log = environment;
    Master *m = log ? log->master : NULL;
    (void)gets;
    *returns = false;
    if (!m) return;
    m->run->looks++;
    if (sets && m->nu) look_inputs(m, t);
    if (finished && can_return && ++m->looks > m->run->allowance) {
        *returns = true;
        *until = t;
    }
}

static RunStatus event_mode(Master *m, int enter, int jump)
{
    const FmuInstance *fmu = m->fmu;
    int status = enter ? fmi_plain(fmu, F_ENTER_EVENT) : FMI_OK;
    if (status >= FMI_DISCARD) return REPORT(RUN_FMI_ERROR, F_ENTER_EVENT, status);
    if (jump && field_inputs(m, m->t) != FINE) return REPORT(RUN_FMI_ERROR, F_SETTERS, FMI_ERROR);
    int nominals;
    if (ticking_update(m, &nominals) != FINE) return m->ended;
    status = m->terminate ? FMI_OK : fmi_plain(fmu, F_ENTER_STEP);
    return status >= FMI_DISCARD ? REPORT(RUN_FMI_ERROR, F_ENTER_STEP, status) : RUN_DONE;
}

static void note(Master *m, EventKind kind)
{
    Run *r = m->run;
    if (r->n_events < r->event_capacity) r->events[r->n_events++] = (MasterEvent){m->t, kind, -1, 0.0, 0.0};
}

/* from m->t to the point, or to where the FMU stopped before it */
static RunStatus step_towards(Master *m, double point, int *event)
{
    Stepped stepped;
    m->run->steps++;
    const int status = fmi_do_step(m->fmu, m->t, point - m->t, &stepped);
    if (m->ended) return m->ended;
    *event = stepped.event;
    /* where it says it is: not before it began, nor beyond what was asked for; of no number, where it began */
    const double told = stepped.reached >= m->t ? fmin(stepped.reached, point) : m->t;
    if (status == FMI_DISCARD && stepped.terminate) {
        m->terminate = 1;
        m->t = told;
        return RUN_DONE;
    }
    m->run->report_reached = stepped.reached < point ? told : m->t;
    if (status == FMI_DISCARD) return REPORT(RUN_DISCARD, -1, point - m->t);
    if (status > FMI_DISCARD) return REPORT(RUN_FMI_ERROR, F_DO_STEP, status);
    m->terminate |= stepped.terminate;
    const double reached = stepped.early || stepped.terminate ? told : point;
    /* a rounding of time ahead is no progress either */
    const double least = 4.0 * DBL_EPSILON * fmax(fabs(m->t), m->run->stop - m->run->start);
    m->stalled = reached - m->t > least ? 0 : m->stalled + 1;
    const RunStatus piles = reached > m->t || stepped.event ? RUN_EVENTS_PILE_UP : RUN_STALLS;
    /* the FMU adds up steps of its own: its end and the point differ by rounding */
    m->t = fabs(reached - point) <= 1e-12 * fmax(fabs(point), fabs(point - m->t)) ? point : reached;
    return m->stalled > master_tolerances.stalled_events ? REPORT(piles, -1, m->stalled) : RUN_DONE;
}

static double next_point(const Master *m)
{
    const Run *r = m->run;
    return m->knot + 1 < r->n_knots ? r->knot_times[m->knot + 1] : r->stop;
}

RunStatus cosimulation_run(Master *m, int begins)
{
    Run *r = m->run;
    RunStatus status = RUN_DONE;
    if (begins) {
        zeno_reset(m);
        m->shown = 0;
        status = m->fmu->event_mode ? event_mode(m, 0, 0) : RUN_DONE;
        status = status == RUN_DONE ? recording_here(m) : status;
    }
    for (int64_t left = r->allowance; status == RUN_DONE && !m->terminate && m->t < r->stop; left--) {
        int event = 0;
        if (left == 0 || m->looks > r->allowance || ticking_full(m)
            || (r->event_capacity > 0 && r->n_events + 2 > r->event_capacity)) {
            return RUN_MORE;
        }
        const double point = fmin(next_point(m), m->next_event > m->t ? m->next_event : INFINITY);
        status = step_towards(m, point, &event);
        const int arrived = status == RUN_DONE && m->t >= next_point(m);
        const int timed = status == RUN_DONE && m->t >= m->next_event;
        if (arrived && m->knot + 1 < r->n_knots) m->knot++;
        const int jump = arrived && m->nu && r->knot_jumps[m->knot] == 2;
        if (status == RUN_DONE && !m->terminate && m->fmu->event_mode && (event || timed || jump)) {
            status = event_mode(m, 1, jump);
            note(m, event ? EVENT_STATE : timed ? EVENT_TIME : EVENT_INPUT);
            status = status == RUN_DONE && event && zeno_told(m) == STOP ? m->ended : status;
        } else if (status == RUN_DONE && !m->terminate && arrived && m->nu && field_inputs(m, m->t) != FINE) {
            status = REPORT(RUN_FMI_ERROR, F_SETTERS, FMI_ERROR);
        }
        status = status == RUN_DONE ? recording_here(m) : status;
    }
    if (status != RUN_DONE) return status;
    if (m->terminate) {
        r->report_time = m->t;
        note(m, EVENT_END);
    }
    fmi_plain(m->fmu, F_TERMINATE);
    return m->terminate ? RUN_TERMINATED : RUN_DONE;
}
