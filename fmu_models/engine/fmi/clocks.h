/* The clocks of an instance: triggered ones, which tick at the events of its contacts. */
#pragma once

#include <stdbool.h>

#include "instance.h"

/* whether clocks are active; one that is asked is inactive from then on, until its next tick */
Status clocks_get(Instance *m, const char *function, const uint32_t *vr, size_t n, bool *active);
/* refuse what only clocks of other kinds have */
Status clocks_refuse(Instance *m, const char *function, const uint32_t *vr, size_t n, const char *reason);
