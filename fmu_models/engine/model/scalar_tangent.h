/* What follows is for numbers with a tangent. */
#include <complex.h>
#include <tgmath.h>

/* an infinite number is the end of a run, whatever a product makes of it: no checks for it in every one */
#if defined(__clang__) || !defined(__GNUC__) /* gcc does not know it */
#pragma STDC CX_LIMITED_RANGE ON
#endif

#include "scalar.h"
#undef KIND
#undef Real
#undef PART
#define KIND(name) name##_tangent
#define Real double complex
#define PART(number) creal(number)
