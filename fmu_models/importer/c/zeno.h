/* Too many events. */
#ifndef STICKSLIP_ZENO_H
#define STICKSLIP_ZENO_H

#include "master_state.h"

void zeno_reset(Master *m);
/* after an event of this indicator; slides: it chatters; returned: it only came back from the far side of zero */
Outcome zeno_watch(Master *m, int indicator, int moved, int *slides, int *returned);
Outcome zeno_stalled(Master *m);

#endif
