/* integers.c without the event mode that its description declares */
#define REFUSES_EVENTS
#include "integers.c"
