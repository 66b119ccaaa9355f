/* What follows is for real numbers. */
#include "kinds.h"
#undef KIND
#undef Real
#undef PART
#define KIND(name) name
#define Real double
#define PART(number) (number)
