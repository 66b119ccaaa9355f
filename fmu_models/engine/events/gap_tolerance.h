/* How far start values, or an importer that integrates by itself, may be off at the wall of a rigid contact. */
#pragma once

#include "../model/run_state.h"

/* the gaps that nominal values of the coordinates make, where an importer integrates */
void gap_measure_nominal(Run *r);
/* by how much the indicator of the depth of contact c is shifted for an importer */
double gap_shift(const Run *r, const Jets *j, int c);
/* the gap of rigid contact c that an importer may mistake for zero */
double gap_resolution(const Run *r, const Jets *j, int c);
/* the gap of rigid contact c that the rounding of parameters, inputs and time makes where a run starts: far from time
   zero a wall that moves is known no better; r holds the depth in scratch, and no step */
double gap_rounding(Run *r, int c);
