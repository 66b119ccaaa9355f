/* Forces of friction with two directions, per kind of number: the one in force where this is included. */
#include "../model/model.h"

#define cone_forces KIND(cone_forces)
#define cone_rise KIND(cone_rise)
#define cone_effects KIND(cone_effects)
#define cone_rate KIND(cone_rate)

/* order k of the forces of cone c in its present state, the other contacts not regarded; 1 if it is held */
int cone_forces(const Point *at, Jets *j, int k, int c);
/* the same of one whose slip begins, with the others; 1 */
int cone_rise(const Point *at, Jets *j, int k, int c);
/* order 0 of what forces of the sides of cone c do to the rates of these, with how held contacts give way */
void cone_effects(const Point *at, const Jets *j, int c, Real G[2][2]);
/* order k of the rate of y of side c, with the forces that are known */
Real cone_rate(const Jets *j, int c, int k);
