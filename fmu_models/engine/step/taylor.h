/* One step by Taylor series, and series at one instant. */
#pragma once

#include "../model/run_state.h"

/* load r's instant into the first orders of a set of series in time */
void taylor_load(const Run *r, Jets *j);
/* fill order k of all series from orders 0..k of t, u, x */
void taylor_field(Run *r, Jets *j, int k);
/* the series of x up to the order given, from r; stops early where the terms vanish within limit; returns the order
   reached */
int taylor_series(Run *r, Jets *j, int order, double limit);
/* a time over which the states change noticeably: the length of a step of this order; 1 where they do not change at
   all */
double taylor_time_scale(const Run *r, const Jets *j, int order);
/* the length over which a series keeps a relative tolerance */
double taylor_series_length(const double *x, int order, double tolerance);
/* order that the step tolerance asks for */
int taylor_order(const Run *r);
/* whether the next step runs in the root of time: a law with half-integer powers of its depth starts at zero depth */
int taylor_starts_rooted(Run *r);
/* the next step from r, cut at the first fall of an indicator */
RunStatus taylor_step(Run *r, double limit, int flies);
/* the series of that step to the full order, where terms that vanish have ended them before; sums have all their terms */
void taylor_complete(Run *r);
/* end it, if it is longer than that */
RunStatus taylor_shorten(Run *r, double length);
