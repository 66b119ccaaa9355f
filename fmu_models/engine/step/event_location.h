/* Where indicators fall to zero on a step. */
#pragma once

#include "../model/run_state.h"

/* the indicator in use in a slot: +1 or -1 for a quantity that must stay of that sign, 0 if the slot has none now */
int location_indicator(const Run *r, int c, Slot slot);
/* cut a step of length h at the first fall of an indicator and note all that fall there; gaps are exact up to a shorter
   length */
double location_cut(Run *r, int order, double h, double exact);
