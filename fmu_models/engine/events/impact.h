/* Impacts of rigid contacts, and the end of a chatter. */
#ifndef STICKSLIP_IMPACT_H
#define STICKSLIP_IMPACT_H

#include "../model/run_state.h"

/* velocities after an impact in which these rigid contacts take part; r->scratch has the rates before it, and then
   those after it */
RunStatus impact_resolve(Run *r, const signed char *takes_part);
/* whether rigid contact c, which has just bounced, is in the tail of a chatter that ends after `wait`; other: a contact
   whose chatter ends with it, or -1 */
int impact_settles(Run *r, int c, double *wait, int *other);

#endif
