/* The clocks of an instance. Contract in clocks.h. */
#include "clocks.h"

#include "variables.h"

static Status check_clocks(Instance *m, const char *function, const uint32_t *vr, size_t n)
{
    int i;
    if (instance_array(m, vr, n, function, "value references")) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++)
        if (variables_locate(vr[k], &i) != CLOCK)
            return instance_refuse(m, "%s: value reference %u is not a clock", function, (unsigned)vr[k]);
    return STATUS_OK;
}

Status clocks_get(Instance *m, const char *function, const uint32_t *vr, size_t n, bool *active)
{
    int i, tick;
    if (instance_enter(m, PHASE_INITIALIZATION | PHASE_EVENT, function)) return STATUS_ERROR;
    if (check_clocks(m, function, vr, n) || instance_array(m, active, n, function, "values")) return STATUS_ERROR;
    if (m->core.phase == PHASE_EVENT && instance_evaluate(m, function)) return STATUS_ERROR;
    for (size_t k = 0; k < n; k++) {
        variables_locate(vr[k], &i);
        unsigned char *ticks = &m->core.ticks[variables_clock(i, &tick)];
        active[k] = (*ticks & tick) != 0;
        *ticks &= (unsigned char)~tick;
    }
    return STATUS_OK;
}

Status clocks_refuse(Instance *m, const char *function, const uint32_t *vr, size_t n, const char *reason)
{
    if (instance_enter(m, PHASES_ALL, function) || check_clocks(m, function, vr, n)) return STATUS_ERROR;
    return n ? instance_refuse(m, "%s: %s", function, reason) : STATUS_OK;
}
