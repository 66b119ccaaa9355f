/* What is recorded of an FMU that moves by itself. */
#include "recording.h"

#include "field.h"
#include "ticking.h"

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
