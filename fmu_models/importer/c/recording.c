/* What is recorded: of a motion that is integrated, at its dense output; of an FMU that moves by itself, where it is. */
#include "recording.h"

#include "dense_output.h"
#include "field.h"
#include "method.h"
#include "slide.h"
#include "ticking.h"

#include <string.h>

RunStatus recording_here(Master *m)
{
    Run *r = m->run;
    while (r->next_time < r->n_times && r->times[r->next_time] <= m->t) {
        ticking_record(m);
        const int status = fmi_read(m->fmu, &r->recorded, r->values + r->next_time * r->recorded.n);
        if (status >= FMI_DISCARD) {
            field_report(m, RUN_FMI_ERROR, m->t, F_GETTERS, status);
            return m->ended;
        }
        r->next_time++;
    }
    return RUN_DONE;
}

void recording_at(Master *m, double t, const double *x, Outcome *outcome)
{
    Run *r = m->run;
    memcpy(r->states + r->next_time * m->n, x, (size_t)m->n * sizeof *x);
    double *values = r->values + r->next_time * r->recorded.n;
    ticking_record(m);
    r->next_time++;
    if (r->recorded.n == 0) return;
    *outcome = m->slide.n ? slide_values(m, t, x, values) : field_values(m, t, x, values);
    if (*outcome == SHORTER) *outcome = field_report(m, RUN_FMI_ERROR, t, m->refused, FMI_DISCARD);
}

Outcome recording_within(Master *m, double t1)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times && r->times[r->next_time] < t1) {
        outcome = method_dense(m);
        if (outcome == FINE) {
            dense_value(m, (r->times[r->next_time] - m->t) / m->length, m->point);
            memcpy(m->stage, m->point, (size_t)m->n * sizeof *m->x);
            recording_at(m, r->times[r->next_time], m->stage, &outcome);
        }
    }
    return outcome;
}

Outcome recording_reached(Master *m)
{
    Run *r = m->run;
    Outcome outcome = FINE;
    while (outcome == FINE && r->next_time < r->n_times && r->times[r->next_time] <= m->t)
        recording_at(m, m->t, m->x, &outcome);
    return outcome;
}
