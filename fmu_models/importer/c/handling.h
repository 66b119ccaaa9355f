/* Events of whatever kind (handling.c). */
#pragma once

#include "master_state.h"

/* what an event comes from */
typedef struct {
    int state, time, step, knot, jump;
} Causes;

/* append an event to those of the run, with the states before and now */
void handling_log(Master *m, EventKind kind, int indicator, double before, double after);
/* event mode where the run is, and what follows from it; the FMU has been put there */
Outcome handling_event(Master *m, const Causes *causes);
