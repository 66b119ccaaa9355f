/* A run of an FMU by Scheduled Execution. */
#pragma once

#include "master_state.h"

RunStatus scheduled_run(Master *m);
