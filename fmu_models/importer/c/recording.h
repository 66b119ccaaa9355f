/* What is recorded of an FMU that moves by itself. */
#ifndef STICKSLIP_RECORDING_H
#define STICKSLIP_RECORDING_H

#include "master_state.h"

RunStatus recording_here(Master *m); /* rows of all output times that are reached */

#endif
