/* Impacts of rigid contacts. */
#pragma once

#include "../model/run_state.h"

/* velocities after an impact in which these rigid contacts take part; r->scratch has the rates before it, and then
   those after it */
RunStatus impact_resolve(Run *r, const signed char *takes_part);
