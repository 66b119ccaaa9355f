/* Steps of a run of a map. */
#pragma once

#include "journey.h"

/* all of a run that has been started */
Outcome map_run(Job *job);
