/* Which functions a compiler leaves as they are written; for files that know no model, too. */
#pragma once

/* a function that is never made part of its caller */
#if defined(__GNUC__)
#define CALLED __attribute__((noinline, unused))
#else
#define CALLED
#endif

/* a function that runs of small models seldom reach, left as it stands where their core is built (fmu/c/core.c); of
   many contacts, and at impacts, all that selects states is reached often */
#ifdef STICKSLIP_CORE
#include "../model_sizes.h"
#endif
#if defined(STICKSLIP_CORE) && MODEL_NC <= 2 && !MODEL_IMPACTS
#define RARE __attribute__((noinline, optnone))
#else
#define RARE
#endif
