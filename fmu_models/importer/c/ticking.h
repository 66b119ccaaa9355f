/* The clocks of an FMU (FMI 3): when they tick, and the discrete states at an event. */
#pragma once

#include "master_state.h"

/* in initialization mode: what the FMU tells of its clocks, and first values of variables that have some */
Outcome ticking_begin(Master *m);
/* in event mode: inputs are set, clocks tick, discrete states are updated until they stay; the time of the next event */
Outcome ticking_update(Master *m, int *nominals);
/* what happens at one instant of scheduled execution: the partitions whose clocks are due, by their priority */
Outcome ticking_activate(Master *m);
/* clocks that the FMU says, in the midst of a partition, that tick or will */
void ticking_told(Master *m);
double ticking_next(const Master *m); /* infinity: none is known */
/* variables that have clocks, as they are now, into the row of the next output time */
void ticking_record(Master *m);
/* whether the buffer might not hold what one more instant brings */
int ticking_full(const Master *m);
