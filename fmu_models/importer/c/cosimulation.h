/* A run of an FMU by Co-Simulation. */
#ifndef STICKSLIP_COSIMULATION_H
#define STICKSLIP_COSIMULATION_H

#include "master_state.h"

RunStatus cosimulation_run(Master *m, int begins);

#endif
