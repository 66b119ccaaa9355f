/* What held, rubbing and striking contacts of one lane do at an event. */
#pragma once

#include "pool.h"

/* guard g of a contact that is held, or of the slip of one that could be, has fallen, alone, or a rigid contact arrives
   at its wall; as lane_event has it; 0: not decided, and nothing changed */
int lane_transition(LaneTable *t, Lane *lane, double *z, int g, double time, int64_t *known);
/* impulses of an impact of contact c, and of its friction, which ends in a state, by the rates of arrival and slip: they
   are linear in these */
void lane_impulses(const LaneTable *t, int c, int friction, double arrival, double slip, double *normal, double *rub);
/* whether another rigid contact is at its wall as well, or feels an impact by its force */
int lane_is_alone(const LaneTable *t, const Lane *lane, const double *z, int c);
