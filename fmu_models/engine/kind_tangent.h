/* What follows is for numbers with a tangent. */
#pragma STDC CX_LIMITED_RANGE ON
#include <complex.h>
#include <tgmath.h>

#include "kinds.h"
#undef KIND
#undef Real
#undef PART
#define KIND(name) name##_tangent
#define Real double complex
#define PART(number) creal(number)
