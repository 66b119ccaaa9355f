/* The table of one motion, with its steps of a grid over the period. */
#pragma once

#include "lane_table.h"

/* fill a table; 0 where these values are none for lanes */
int table_make(LaneTable *t, const double *p, const double *u, double period);
