/* returns an error once t passes 1, and says nothing */
#include "model_exchange.h"

static fmi2Status derivative(Model *m) { return m->time > 1.0 ? fmi2Error : fmi2OK; }
