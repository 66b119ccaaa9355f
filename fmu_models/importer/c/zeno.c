/*
 * Too many events.
 *
 *     a return: the indicator is back on the near side within the rounding of time, after an event that moved the
 *               states and with nothing for the FMU to do: the far side, on which events are located, was left again.
 *               Not an event of the motion
 *     chattering: an indicator comes back at once again and again, or its mean gap would make the run last for ever
 *               -> the motion slides along the surface of the indicator (slide.c)
 *     Zeno:     the gaps of an indicator shrink geometrically, ratio r: they add up to gap r / (1 - r) more. An FMU
 *               that comes to rest by itself does so before the rest of the sequence is within the rounding of time, or
 *               not at all. While a sequence shrinks no step is longer than a part of its next gap: an indicator of +1
 *               and -1 says nothing of a flight that begins and ends within a step
 *               In a co-simulation only the events that the FMU tells are known, and not of which indicator they are
 *     piling up: events of whatever kind, one after the other, without progress in time
 */
#include "zeno.h"

#include "field.h"

#include <float.h>
#include <math.h>
#include <string.h>

void zeno_reset(Master *m)
{
    /* one at least: that of all events of a co-simulation */
    const int watches = m->nz > 0 ? m->nz : 1;
    memset(m->watch, 0, (size_t)watches * sizeof *m->watch);
    for (int i = 0; i < watches; i++)
        m->watch[i].time = m->watch[i].counted_time = m->watch[i].window = -INFINITY;
    m->stalled = 0;
    m->last_event_time = -INFINITY;
}

Outcome zeno_stalled(Master *m)
{
    const double gap = m->t - m->last_event_time;
    m->last_event_time = m->t;
    /* at t = 0 the rounding of time is that of the run */
    const double size = fmax(fabs(m->t), m->run->stop - m->run->start);
    m->stalled = gap <= 4.0 * DBL_EPSILON * size ? m->stalled + 1 : 0;
    return m->stalled > master_tolerances.stalled_events ? field_report(m, RUN_EVENTS_PILE_UP, m->t, -1, m->stalled)
                                                         : FINE;
}

/* the geometric sequence of gaps; STOP where it ends */
static Outcome sequence(Master *m, Watch *w, int indicator)
{
    const double gap = m->t - w->counted_time;
    w->counted_time = m->t;
    const double ratio = w->gap > 0.0 ? gap / w->gap : 0.0;
    const int equal = ratio > 0.0 && ratio < 1.0 - 1e-6
                      && fabs(ratio - w->ratio) <= master_tolerances.zeno_spread * fmin(ratio, 1.0 - ratio);
    w->ratios = equal ? w->ratios + 1 : 0;
    w->ratio = ratio;
    w->gap = isfinite(gap) ? gap : 0.0;
    const double rest = gap * ratio / (1.0 - ratio);
    if (w->ratios >= master_tolerances.zeno_ratios && rest <= master_tolerances.zeno_rest * fabs(m->t)) {
        Run *r = m->run;
        if (r->accumulations++ == 0) r->accumulation_time = m->t + rest;
        return r->on_zeno == ZENO_CONTINUE ? FINE : field_report(m, RUN_ZENO, m->t + rest, indicator, ratio);
    }
    return FINE;
}

Outcome zeno_told(Master *m) { return sequence(m, m->watch, -1); }

double zeno_longest_step(const Master *m)
{
    double longest = INFINITY;
    for (int i = 0; i < m->nz; i++) {
        const Watch *w = &m->watch[i];
        const double next = w->gap * w->ratio;
        /* two gaps are no sequence yet, but where they shrink so fast the third may be the last that shows */
        const int shrinks = w->ratios > 0 || w->ratio < 0.5;
        if (shrinks && m->t - w->counted_time < 1.1 * next)
            longest = fmin(longest, fmax(0.25 * next, master_tolerances.chatter_gap * fabs(m->t)));
    }
    return longest;
}

int zeno_at_once(const Master *m, double time)
{
    const double length = m->run->stop - m->run->start;
    return m->t - time <= master_tolerances.chatter_gap * fmax(fabs(m->t), length);
}

Outcome zeno_watch(Master *m, int indicator, int moved, int *slides, int *returned)
{
    const MasterTolerances *tolerances = &master_tolerances;
    Watch *w = &m->watch[indicator];
    const double length = m->run->stop - m->run->start;
    const int at_once = zeno_at_once(m, w->time);
    *returned = at_once && w->moved && !moved;
    w->returns = at_once ? w->returns + 1 : 0;
    w->time = m->t;
    w->moved = moved;
    *slides = w->returns >= tolerances->chatter_events;
    /* a sequence that shrinks ends by itself, or as Zeno */
    const int shrinks = w->ratios >= tolerances->zeno_ratios;
    if (!isfinite(w->window)) {
        w->window = m->t;
        w->events = 0;
    } else if (++w->events >= tolerances->rate_events) {
        *slides |= !shrinks && m->t - w->window < w->events * tolerances->rate_gap * length;
        w->window = m->t;
        w->events = 0;
    }
    /* asked to continue beyond a limit: what the FMU does there is no sliding motion */
    *slides &= !(m->run->on_zeno == ZENO_CONTINUE && m->run->accumulations);
    return *returned ? FINE : sequence(m, w, indicator);
}
