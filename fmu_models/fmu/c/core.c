/* The part of a model's library that whole runs reach, compiled in a fourth of the time: every function but those below
   belongs to this unit, so that what they do not call is left out before it is optimized. Functions of C's library are
   declared first, since they come from elsewhere. For compilers that know the attribute, which gcc does not. */
#include <complex.h>
#include <fenv.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STICKSLIP_CORE
#pragma clang diagnostic ignored "-Wunused-function"
#pragma clang attribute push(__attribute__((internal_linkage)), apply_to = function)
#include "all.c"
#pragma clang attribute pop

WHOLE_RUN_EXPORT int core_native_version(void);
WHOLE_RUN_EXPORT void *core_open(char *message);
WHOLE_RUN_EXPORT void core_close(void *instance);
WHOLE_RUN_EXPORT int core_restart(void *instance, const RunStart *start);
WHOLE_RUN_EXPORT int core_simulate(void *instance, WholeRun *run);

int core_native_version(void) { return stickslip_native_version(); }
void *core_open(char *message) { return stickslip_open(message); }
void core_close(void *instance) { stickslip_close(instance); }
int core_restart(void *instance, const RunStart *start) { return stickslip_restart(instance, start); }
int core_simulate(void *instance, WholeRun *run) { return stickslip_simulate(instance, run); }
