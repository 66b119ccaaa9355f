/* Beginnings of runs and of their pieces (begin.c). */
#pragma once

#include "master_state.h"

Outcome begin_run(Master *m);             /* the run is at its start time, its first rows recorded */
Outcome begin_piece(Master *m);           /* sides of indicators and rates after an event */
void begin_knot(Master *m, int64_t knot); /* inputs go on from this knot */
