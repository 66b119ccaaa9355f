/* Too many events. */
#pragma once

#include "master_state.h"

void zeno_reset(Master *m);
/* after an event of this indicator; slides: it chatters; returned: it only came back from the far side of zero */
Outcome zeno_watch(Master *m, int indicator, int moved, int *slides, int *returned);
Outcome zeno_told(Master *m);                   /* after an event of a co-simulation */
int zeno_at_once(const Master *m, double time); /* so soon before now that it is chattering */
/* infinity but where the next event of a sequence that shrinks is due */
double zeno_longest_step(const Master *m);
Outcome zeno_stalled(Master *m);
