/* The step of Co-Simulation. */
#pragma once

#include "instance.h"

/* how a step ended */
typedef struct {
    int event; /* a contact changed its state there, for the importer to handle */
    int early; /* before the end that was asked for */
} StepEnd;

Status co_simulation_step(Instance *m, const char *function, double time, double step, StepEnd *ended);
