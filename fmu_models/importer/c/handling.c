/* Events of whatever kind: told, handed to the FMU, and watched for chattering and Zeno (zeno.c, slide.c). */
#include "handling.h"

#include "events.h"
#include "field.h"
#include "slide.h"
#include "zeno.h"

#include <math.h>
#include <string.h>

void handling_log(Master *m, EventKind kind, int indicator, double before, double after)
{
    Run *r = m->run;
    if (r->n_events >= r->event_capacity) return;
    r->events[r->n_events] = (MasterEvent){m->t, kind, indicator, before, after};
    double *states = r->event_states + 2 * r->n_events * m->n;
    memcpy(states, m->before, (size_t)m->n * sizeof *m->x);
    memcpy(states + m->n, m->x, (size_t)m->n * sizeof *m->x);
    r->n_events++;
}

/* the FMU chatters: slide, and log that instead of the events that showed it */
static Outcome begin_slide(Master *m, int indicator)
{
    Run *r = m->run;
    m->quick_slides = m->t - m->slide_time < master_tolerances.rate_gap * (r->stop - r->start) ? m->quick_slides + 1
                                                                                               : 0;
    m->slide_time = m->t;
    if (m->quick_slides > master_tolerances.quick_slides) return field_report(m, RUN_CHATTERING, m->t, indicator, 0.0);
    const Outcome outcome = slide_begin(m, indicator);
    if (outcome != FINE) return outcome;
    while (r->n_events > 0) {
        const MasterEvent *last = &r->events[r->n_events - 1];
        if (last->kind != EVENT_STATE || last->indicator != indicator || !zeno_at_once(m, last->time)) break;
        r->n_events--;
    }
    handling_log(m, EVENT_SLIDE, indicator, m->z[indicator], 0.0);
    m->watch[indicator].returns = 0;
    return FINE;
}

/* what the fired indicators mean, after their event */
static Outcome watch_fired(Master *m)
{
    int moved = memcmp(m->before, m->x, (size_t)m->n * sizeof *m->x) != 0;
    for (int i = 0; i < m->nz; i++) {
        if (!m->fired[i]) continue;
        int slides = 0, returned = 0;
        const double before = m->z[i];
        const Outcome outcome = zeno_watch(m, i, moved, &slides, &returned);
        if (outcome != FINE) return outcome;
        /* an indicator that was exactly zero has only left it */
        returned |= before == 0.0 && !moved;
        if (!returned) handling_log(m, EVENT_STATE, i, before, m->z1[i]);
        if (slides) return begin_slide(m, i);
    }
    return FINE;
}

Outcome handling_event(Master *m, const Causes *causes)
{
    const int sliding = m->slide.n;
    memcpy(m->before, m->x, (size_t)m->n * sizeof *m->x);
    if (zeno_stalled(m) != FINE) return STOP;
    for (int i = 0; i < m->nz && m->slide.n; i++) {
        if (!m->fired[i] || !slide_along(m, i)) continue;
        handling_log(m, EVENT_LEAVE, i, m->z[i], 0.0);
        m->fired[i] = 0;
        const Outcome outcome = slide_leave(m, i);
        if (outcome != FINE) return outcome == STOP ? STOP : field_report(m, RUN_CHATTERING, m->t, i, 0.0);
    }
    Outcome outcome = events_update(m, 1, causes->jump);
    if (outcome != FINE) return outcome;
    m->fresh = 1;
    if (causes->time) handling_log(m, EVENT_TIME, -1, 0.0, 0.0);
    if (causes->step) handling_log(m, EVENT_STEP, -1, 0.0, 0.0);
    if (causes->jump) handling_log(m, EVENT_INPUT, -1, 0.0, 0.0);
    if (m->terminate) return FINE;
    if (causes->state) {
        outcome = fmi_indicators(m->fmu, m->z1) >= FMI_DISCARD
                      ? field_report(m, RUN_FMI_ERROR, m->t, F_GET_INDICATORS, FMI_ERROR)
                      : watch_fired(m);
    }
    for (int left = 0; outcome == FINE && m->slide.n && sliding && left >= 0;) {
        const int first = m->slide.indicator[0];
        outcome = slide_resume(m, &left);
        if (left >= 0) handling_log(m, EVENT_LEAVE, left, 0.0, 0.0);
        outcome = outcome == SHORTER ? field_report(m, RUN_CHATTERING, m->t, first, 0.0) : outcome;
    }
    return outcome;
}
