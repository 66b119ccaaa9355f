/* What happens at an event. */
#pragma once

#include "../model/run_state.h"

/* choose the contact states from scratch; moved: x changed */
RunStatus transition_reconsider(Run *r, int *moved);
/* resolve the fall of the indicators marked in r->falling */
RunStatus transition_make(Run *r, int *moved);
/* what has happened to the contacts at r's instant since they were in these states */
void transition_tell(const Run *r, const signed char *before, EventSink sink, void *context);
/* signals go over their knots at r's instant: resets whose functions that takes through zero, and contacts anew; sink
   may be NULL */
RunStatus transition_tick(Run *r, EventSink sink, void *context);
/* resolve the event that waits at r's instant */
RunStatus transition_resolve(Run *r, EventSink sink, void *context);
