/* Whether events keep the balance of energy. */
#pragma once

#include "../model/run_state.h"

/* velocities before something that may change them */
typedef struct {
    double v[MODEL_ROOM(MODEL_NV)];
} Velocities;

Velocities energy_velocities(const Run *r);
/* after a projection: it moves rounding only, so that the kinetic energy is what it was; RUN_ERROR if it is not */
RunStatus energy_check_projection(Run *r, const Velocities *before);
/* after the impulses of an impact: the kinetic energy has changed by their work; RUN_ERROR if it has not */
RunStatus energy_check_impact(Run *r, const Velocities *before);
