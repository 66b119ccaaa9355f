/* The modes of the contacts of one motion, made when it comes to them. */
#pragma once

#include "lane_table.h"

/* the mode of contact states; -1 if lanes have none for it */
int table_mode(const signed char *state);
void mode_make(LaneTable *t, int mode);
/* the numbers of a mode */
static inline LaneMode *table_at(LaneTable *t, int mode)
{
    if (!t->made[mode]) mode_make(t, mode);
    return &t->mode[mode];
}
/* whether no stop touches in a mode, and no force holds a contact */
int mode_is_away(int mode);
/* |row| |A|^n exp(|A| h) over z and 1: what bounds the n-th derivative of a guard over a step; of harmonics and 1, whose
   magnitudes are at most 1, as the sum that is returned */
double row_bound(const LaneTable *t, const Full *f, const double *row, int n, double h, double *bound);
/* rows of exp(A h) of the states, over z and 1 */
void flow_over(const LaneTable *t, const Full *f, double h, double (*whole)[LANES_Z + 1]);
