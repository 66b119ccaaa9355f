/* Events of tangents (tangent_event.c). Numbers have a tangent where this is included, as tangent_series.h says. */
#include "tangent_series.h"

#ifndef STICKSLIP_TANGENT_EVENT_H
#define STICKSLIP_TANGENT_EVENT_H

/* the tangent's own derivative on the run's value: both have moved by the same arithmetic, up to rounding */
void tangent_rejoin(const Run *r, Tangent *t);
/* the motion of these contacts is brought to rest */
void tangent_project(const Run *r, Tangent *t, const signed char *member);
/* what the run has done to its contacts and states at this instant */
void tangent_repeat_event(const Run *r, Tangent *t);

/* signals of the tangent on the pieces of the run, at the tangent's own time */
void tangent_load_signals(const Run *r, Tangent *t);

#endif
