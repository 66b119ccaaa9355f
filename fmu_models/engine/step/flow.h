/* The flow as series, per kind of number: the one in force where this is included (model/scalar.h). */
#include "../model/model.h"

#define flow_load KIND(flow_load)
#define flow_field KIND(flow_field)
#define flow_extend KIND(flow_extend)
#define flow_series KIND(flow_series)
#define flow_rooted_series KIND(flow_rooted_series)
#define flow_finish KIND(flow_finish)

/* load a point into the first orders of the series */
void flow_load(const Point *at, Jets *j, int rooted);
/* order k of all series but the states, from orders 0..k of the states */
void flow_field(Point *at, Jets *j, int k, int rooted);
/* order n of the states from their rates: x' = rate in time, x' = 2 s rate in its root */
void flow_extend(Jets *j, int n, int rooted);
/* what the search for events reads of the last order */
void flow_finish(const Point *at, Jets *j, int order);
/* all of it to an order, in time and in the root of time */
void flow_series(Point *at, Jets *j, int order);
void flow_rooted_series(Point *at, Jets *j, int order);
