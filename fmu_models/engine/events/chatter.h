/* The end of a chatter. */
#ifndef STICKSLIP_CHATTER_H
#define STICKSLIP_CHATTER_H

#include "../model/run_state.h"

/* after an impact: contacts in the tail of a chatter are held from here on, until infinitely many impacts would be
   over */
RunStatus chatter_settle(Run *r, int *moved);

#endif
