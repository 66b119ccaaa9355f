/* What follows is for numbers with a tangent. */
#include <complex.h>
#include <tgmath.h>

#include "kinds.h"
#undef KIND
#undef Real
#undef PART
#define KIND(name) name##_tangent
#define Real double complex
#define PART(number) creal(number)
