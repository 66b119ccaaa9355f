/* What follows is for real numbers. */
#include "scalar.h"
#undef KIND
#undef Real
#undef PART
#define KIND(name) name
#define Real double
#define PART(number) (number)
