/* Model Exchange, at (r->time, r->u, r->x) in the present contact states. */
#pragma once

#include "../model/run_state.h"

RunStatus exchange_derivatives(Run *r, double *dx); /* MODEL_NX */
RunStatus exchange_indicators(Run *r, double *z);   /* MODEL_NI */
/* resolve the event an importer has located; changed: continuous states were moved */
RunStatus exchange_event(Run *r, int *changed);
