/* An instance for whole runs. Contract in restart.h. */
#include "restart.h"

#include <stdio.h>

#include "../fmi/variables.h"
#include "../model/traps.h"

int stickslip_native_version(void) { return WHOLE_RUN_VERSION; }

/* as the logger of an instance: its environment is the room for a message */
static void keep_message(Instance *m, Status status, const char *category, const char *message)
{
    (void)status;
    (void)category;
    snprintf(m->environment, WHOLE_RUN_MESSAGE, "%s", message);
}

static void no_importer(void) {}

RARE void *stickslip_open(char *message)
{
    TRAPS_REST;
    return instance_new(MODEL_NAME, MODEL_TOKEN, 1, keep_message, no_importer, message, 0, 0);
}

void stickslip_close(void *instance) { instance_free(instance); }

RARE Status whole_run_enter_initialization(Instance *m, const char *function, const RunStart *start)
{
    if (!m->core.co_simulation) return instance_refuse(m, "%s: only for Co-Simulation", function);
    if (instance_reset(m)) return STATUS_ERROR;
    if (variables_set(m, function, start->initial, (size_t)start->n_initial, start->initial_values))
        return STATUS_ERROR;
    if (instance_set_up(m, function, 1, start->tolerance, start->start_time, 0, 0.0)) return STATUS_ERROR;
    m->core.phase = PHASE_INITIALIZATION;
    return STATUS_OK;
}

RARE int stickslip_restart(void *instance, const RunStart *start)
{
    TRAPS_REST;
    Instance *m = instance;
    if (!start || instance_enter(m, PHASES_ALL, __func__)) return WHOLE_RUN_ERROR;
    if (whole_run_enter_initialization(m, __func__, start)) return WHOLE_RUN_ERROR;
    return instance_exit_initialization(m, __func__) ? WHOLE_RUN_ERROR : WHOLE_RUN_DONE;
}
