/* Contacts that forces hold: these forces as rows over the states, and the field with them. */
#pragma once

#include "lane_table.h"

typedef struct {
    double force[NC][LANES_Z + 1]; /* of contacts that are held, in the coordinates of the mode */
} Held;

/* the flow of a mode with its held contacts; 0 where their forces do not follow from the motion */
int held_make(const LaneRows *r, const double *wave, LaneMode *m, Full *f, Held *held);
/* the row of what is left of the friction that contact c can give on one side */
void held_margin(const LaneRows *r, const LaneMode *m, const Held *held, int c, int side, double *row);
/* states z, from the origin of the mode, onto its walls and without slip of the contacts that it holds */
void held_settle(const LaneTable *t, const LaneMode *m, double *z);
/* a row at z and one, the same at z and 1, and the sum of the magnitudes of its terms */
double row_sum(const double *row, const double *z, double one);
double row_value(const double *row, const double *z);
double row_size(const double *row, const double *z);
/* the rate of guard g along the flow of a mode, and the sum of the magnitudes of its terms */
double guard_rate(const LaneTable *t, const LaneMode *m, const double *z, int g, double *size);
