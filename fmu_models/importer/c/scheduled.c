/*
 * A run of an FMU by Scheduled Execution (FMI 3): its model partitions, one after the other, never one within another.
 *
 *     at the knot of an input that the time has reached: inputs
 *     the partitions whose clocks are due, by priority; what they say of other clocks counts from then on
 *     variables are recorded as they are after all partitions of an instant
 */
#include "scheduled.h"

#include "field.h"
#include "recording.h"
#include "ticking.h"

#include <math.h>

/* the callback handed to the FMU: it calls it in the midst of a partition */
EXPORT void master_told(void *environment)
{
    const Log *log = environment;
    if (log && log->master) ticking_told(log->master);
}

/* partitions are never interrupted: there is nothing to lock */
EXPORT void master_no_lock(void) {}

RunStatus scheduled_run(Master *m)
{
    Run *r = m->run;
    for (int64_t left = r->allowance;; left--) {
        if (left == 0 || ticking_full(m)) return RUN_MORE;
        while (m->knot + 1 < r->n_knots && r->knot_times[m->knot + 1] <= m->t) {
            m->knot++;
            if (m->nu && field_inputs(m, m->t) != FINE) {
                field_report(m, RUN_FMI_ERROR, m->t, F_SETTERS, FMI_ERROR);
                return m->ended;
            }
        }
        if (ticking_activate(m) != FINE || recording_here(m) != RUN_DONE) return m->ended;
        if (m->t >= r->stop) break;
        const double knot = m->knot + 1 < r->n_knots ? r->knot_times[m->knot + 1] : INFINITY;
        const double output = r->next_time < r->n_times ? r->times[r->next_time] : INFINITY;
        m->t = fmin(fmin(r->stop, ticking_next(m)), fmin(knot, output));
        r->steps++;
    }
    fmi_plain(m->fmu, F_TERMINATE);
    return RUN_DONE;
}
