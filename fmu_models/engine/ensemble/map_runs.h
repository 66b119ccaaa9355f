/* Steps of a run of a map. */
#ifndef STICKSLIP_MAP_RUNS_H
#define STICKSLIP_MAP_RUNS_H

#include "journey.h"

/* all of a run that has been started */
Outcome map_run(Job *job);

#endif
