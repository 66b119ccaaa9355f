/* The end of the slip of a cone, per kind of number: the one in force where this is included. */
#include "../model/model.h"

#define cone_rest_time KIND(cone_rest_time)
#define cone_end KIND(cone_end)

/* the time until slipping cone c rests, if nothing but its direction changes until then, and the way of its slip; not
   positive where it would not rest. j holds order 0 */
Real cone_rest_time(const Point *at, const Jets *j, int c, Real *way);
/* the same, and a series of two orders that goes there */
Real cone_end(Point *at, Jets *j, int c);
