/* A run of an FMU by Scheduled Execution. */
#ifndef STICKSLIP_SCHEDULED_H
#define STICKSLIP_SCHEDULED_H

#include "master_state.h"

RunStatus scheduled_run(Master *m);

#endif
