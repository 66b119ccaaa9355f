/* Periodic signals (language/signals.py), per kind of number: the one in force where this is included. */
#include "model.h"

#define signals_load KIND(signals_load)
#define signals_knot KIND(signals_knot)
#define inputs_move KIND(inputs_move)

/* the inputs that signals are, and their rates, at the time of a point, on the pieces that it says */
void signals_load(Point *at);
/* when knot k of signal i comes in a cycle */
Real signals_knot(const Point *at, int i, double cycle, int k);
/* all inputs and their derivatives, so much later on their polynomials */
void inputs_move(Point *at, Real since);
