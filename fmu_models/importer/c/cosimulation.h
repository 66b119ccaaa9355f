/* A run of an FMU by Co-Simulation. */
#pragma once

#include "master_state.h"

RunStatus cosimulation_run(Master *m, int begins);
