/* What happens at an event. */
#ifndef STICKSLIP_TRANSITION_H
#define STICKSLIP_TRANSITION_H

#include "../model/run_state.h"

/* choose the contact states from scratch; moved: x changed */
RunStatus transition_reconsider(Run *r, int *moved);
/* resolve the fall of the indicators marked in r->falling */
RunStatus transition_make(Run *r, int *moved);
/* what has happened to contact c at r's instant since it was in this state; 0 if nothing. Of simultaneous impacts the
   work is told once: taken from what is left of it */
int transition_told(const Run *r, int c, int before, double *work, ContactEvent *event);
/* resolve the event that waits at r's instant */
RunStatus transition_resolve(Run *r, EventSink sink, void *context);

#endif
