/* Many runs over many steps of a section in one call. */
#pragma once

#include "../whole_run/restart.h"
#include "request.h"

/* bytes of the room for tangents, and numbers of that of the engine, for periods up to the longest */
WHOLE_RUN_EXPORT int64_t stickslip_ensemble_room(int64_t n_directions);
WHOLE_RUN_EXPORT int64_t stickslip_ensemble_memory(int64_t longest);
/* bytes of the room for a stepper in lanes (lane_stepper.h); 0 where it is none for this model */
WHOLE_RUN_EXPORT int64_t stickslip_lane_room(const void *stepper, int64_t longest);
WHOLE_RUN_EXPORT int stickslip_ensemble(void *instance, Ensemble *e);
