/* Whether what forces a motion is the same after a period. */
#pragma once

#include "../model/run_state.h"

/* RUN_ERROR, with words, where a strobe of this period would look at a motion under another forcing each time */
RunStatus forcing_check(Run *r, double period);
