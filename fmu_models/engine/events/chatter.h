/* The end of a chatter. */
#pragma once

#include "../model/run_state.h"

/* after an impact: contacts in the tail of a chatter are held from here on, until infinitely many impacts would be
   over */
RunStatus chatter_settle(Run *r, int *moved);
/* the rate of the function of switch c, which may rest */
double chatter_rate(Run *r, int c);
/* after a reset of switch c that came with this rate: whether it is in the tail of a chatter, and until when */
void chatter_note_reset(Run *r, int c, double before);
