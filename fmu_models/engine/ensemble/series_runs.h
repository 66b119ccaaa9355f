/* Steps of a run by the series of the engine. */
#pragma once

#include "journey.h"

/* one step of the run that the instance is at, with tangents where they are asked for */
Outcome series_step(Job *job);
/* all of a run that has been started */
Outcome series_run(Job *job);
