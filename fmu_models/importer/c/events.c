/*
 * Events of the indicators within a step.
 *
 *     side of an indicator: 1 where z > 0, -1 where z <= 0, taken where the step begins. An event is the first point on
 *     the
 *         other side; the run goes on from that point, on the far side of zero, because an FMU decides there by the
 *         sign it sees. It may be back on the near side at once: that is an event again, which the FMU has to be told
 *         (it may wait for the next edge)
 *     locate:
 *         interval [a, b], at first the whole step:
 *             indicators at the nodes of the interval and at one point more, on the dense output
 *             per indicator, v = side * z, p its polynomial, near = what p may err by, at least a small part of v's
 *             size:
 *                 p stays above near              -> no event
 *                 p is not to be trusted          -> halve the interval
 *                 p falls below near at s         -> its minimum from there on, looked at through the FMU:
 *                     on the other side           -> bracket
 *                     touches                     -> parabolas through the FMU's own values, down to the minimum
 *                                                 itself;
 *                                                    a bracket, or on to where p rises again
 *             a node on the other side that p does not explain (indicators that jump) is a bracket too
 *             p is not to be trusted in two of the smallest intervals, or in one before a bracket: more than a jump
 *             -> a shorter step; an indicator may move by time alone, and then the states' error does not limit it
 *         the first bracket is closed to the resolution of time by secants through the FMU, its far end is the event
 *         the step is made again with just this length, and the end corrected, until both agree: the event has the
 *         accuracy of steps
 *     update: event mode, iterated until the FMU is content, at most a bounded number of times
 */
#include "events.h"

#include "field.h"
#include "method.h"
#include "motion.h"
#include "search.h"
#include "ticking.h"

#include <float.h>
#include <math.h>
#include <string.h>

Outcome events_sides(Master *m)
{
    const Outcome outcome = motion_indicators(m, m->t, m->x, m->z);
    for (int i = 0; i < m->slots; i++)
        m->side[i] = m->z[i] > 0.0 ? 1 : -1;
    return outcome;
}

/* the event at the end of a step made just so long; found 0 if the indicator does not change its side there */
static Outcome close_to_end(Master *m, int i, double *theta, int *found)
{
    *found = 0;
    for (double width = 1e-9; width < 1e-2; width *= 30.0) {
        double low = 1.0 - width, high = 1.0 + width;
        Outcome outcome = search_sample(m, low, m->z1);
        const int too_early = search_beyond(m, i, m->z1[i]);
        if (outcome == FINE) outcome = search_sample(m, high, m->z1);
        if (outcome != FINE) return outcome;
        if (!too_early && search_beyond(m, i, m->z1[i])) {
            outcome = search_close(m, i, &low, &high);
            *theta = high;
            *found = 1;
            return outcome;
        }
    }
    return FINE;
}

/* an FMU that asks z < 0 does not see an event at z = 0: a little further, if z goes on falling */
static Outcome beyond_zero(Master *m, int i, double *theta)
{
    Outcome outcome = search_sample(m, *theta, m->z1);
    double by = 4.0 * DBL_EPSILON;
    for (int round = 0; outcome == FINE && round < 10 && m->z1[i] == 0.0; round++, by *= 4.0) {
        const double further = *theta * (1.0 + by);
        outcome = search_sample(m, further, m->z1);
        if (outcome == FINE && m->z1[i] < 0.0) {
            *theta = further;
            return FINE;
        }
    }
    return outcome == FINE ? search_sample(m, *theta, m->z1) : outcome;
}

/* the indicators could not be followed on the step: shorter, down to a length at which the user is told instead */
static void leave_unresolved(Master *m, double theta)
{
    Run *r = m->run;
    m->unresolved = m->length > master_tolerances.unresolved * (r->stop - r->start);
    if (!m->unresolved && r->unresolved++ == 0) {
        r->unresolved_time = m->t + theta * m->length;
        r->unresolved_indicator = m->doubtful - 1;
    }
}

/* the interval up to a bracket whose polynomial was not trusted: clear, as before a jump, or with an earlier event */
static Outcome search_again(Master *m, double from, int *which, double *low, double *high)
{
    Finding before = CLEAR;
    int first = 0;
    double first_low = 0.0, first_high = 1.0;
    const double width = *low - from;
    if (!m->doubtful || !(width > 4.0 * DBL_EPSILON)) return FINE;
    const Outcome outcome = search_interval(m, from, width, 1, &before, &first, &first_low, &first_high);
    if (outcome == FINE && before == UNSURE) {
        leave_unresolved(m, from);
    } else if (outcome == FINE && before == BRACKET) {
        *which = first;
        *low = first_low;
        *high = first_high;
    }
    return outcome;
}

static Outcome polish(Master *m, int i, double latest, double *theta)
{
    const double whole = m->length;
    const double first = *theta;
    double length = whole * first;
    double error;
    m->previous_ready = 0;
    for (int round = 0; round < 4; round++) {
        int found = 0;
        double end = 1.0;
        Outcome outcome = method_try(m, length, &error);
        outcome = outcome == FINE ? method_dense(m) : outcome;
        outcome = outcome == FINE ? close_to_end(m, i, &end, &found) : outcome;
        if (outcome == STOP) return STOP;
        if (outcome == SHORTER || !found || length * end > latest) break;
        if (fabs(end - 1.0) < 1e-8) {
            *theta = end;
            return FINE;
        }
        length *= end;
    }
    /* the shorter step has no event there (a grazing one): the dense output of the whole step stands */
    const Outcome outcome = method_try(m, whole, &error);
    *theta = first;
    return outcome == FINE ? method_dense(m) : outcome;
}

Outcome events_locate(Master *m, double latest, double *theta)
{
    double from = 0.0, width = 1.0;
    int halvings = 0, doubts = 0, most = master_tolerances.halvings;
    *theta = -1.0;
    m->unresolved = 0;
    memset(m->fired, 0, (size_t)m->slots);
    if (m->slots == 0) return FINE;
    Outcome outcome = method_dense(m);
    memcpy(m->samples, m->z, (size_t)m->slots * sizeof *m->z);
    while (from < 1.0 && outcome == FINE) {
        Finding finding;
        int which = 0;
        double low = 0.0, high = 1.0;
        outcome = search_interval(m, from, width, halvings < most, &finding, &which, &low, &high);
        if (outcome != FINE) return outcome;
        if (finding == UNSURE) {
            width *= 0.5;
            halvings++;
            continue;
        }
        const int jumps = finding == BRACKET && doubts == 0;
        doubts += m->doubtful != 0;
        if (jumps) {
            outcome = search_again(m, from, &which, &low, &high);
        } else if (doubts > 1 || (doubts && finding == BRACKET)) {
            leave_unresolved(m, from);
            most = 0;
        }
        if (outcome != FINE || m->unresolved) return outcome;
        if (m->run->misses && !m->slide.n) {
            outcome = search_lowest(m, from, width, finding == BRACKET ? low : from + width);
            if (outcome != FINE) return outcome;
        }
        if (finding == BRACKET) {
            *theta = high;
            /* a step without any error has none in its dense output either */
            if (high > 1e-6 && m->step_error * m->run->tolerance > 1e-14) outcome = polish(m, which, latest, theta);
            outcome = outcome == FINE ? beyond_zero(m, which, theta) : outcome;
            for (int i = 0; i < m->slots && outcome == FINE; i++)
                m->fired[i] = (signed char)search_beyond(m, i, m->z1[i]);
            m->fired[which] = 1;
            return outcome;
        }
        memcpy(m->samples, m->samples + (SEARCH_NODES - 1) * m->slots, (size_t)m->slots * sizeof *m->z);
        from += width;
        if (most == 0) {
            /* it is no use: the rest of the step in one */
            width = 1.0 - from;
        } else if (halvings > 0 && fmod(from, 2.0 * width) == 0.0) {
            width *= 2.0;
            halvings--;
        }
    }
    return outcome;
}

Outcome events_update(Master *m, int enter, int jump)
{
    const FmuInstance *fmu = m->fmu;
    int nominals = 0;
    int status = enter ? fmi_plain(fmu, F_ENTER_EVENT) : FMI_OK;
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_ENTER_EVENT, status);
    if (jump && field_inputs(m, m->t) != FINE)
        return m->ended ? STOP : field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, FMI_DISCARD);
    if (ticking_update(m, &nominals) != FINE) return STOP;
    if (m->terminate) return FINE;
    status = fmi_plain(fmu, F_ENTER_CONTINUOUS);
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_ENTER_CONTINUOUS, status);
    status = fmi_get_states(fmu, m->x);
    if (status >= FMI_DISCARD) return field_report(m, RUN_FMI_ERROR, m->t, F_GET_STATES, status);
    for (int i = 0; i < m->n; i++)
        if (!isfinite(m->x[i])) return field_report(m, RUN_NOT_FINITE, m->t, i, m->x[i]);
    if (nominals || !enter) {
        status = fmi_nominals(fmu, m->nominal);
        for (int i = 0; i < m->n; i++)
            m->nominal[i] = m->nominal[i] > 0.0 ? m->nominal[i] : 1.0;
    }
    return status >= FMI_DISCARD ? field_report(m, RUN_FMI_ERROR, m->t, F_NOMINALS, status) : FINE;
}
