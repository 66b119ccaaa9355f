/* Events of the indicators within a step, and event mode. */
#pragma once

#include "master_state.h"

Outcome events_sides(Master *m); /* sides of all indicators where the run is */
/* first event of the step: its end, as a fraction of the step; -1: none. fired is set; the step may have become a
   shorter one */
Outcome events_locate(Master *m, double latest, double *theta);
Outcome events_update(Master *m, int enter, int jump); /* event mode, iterated; jump: inputs jump there */
