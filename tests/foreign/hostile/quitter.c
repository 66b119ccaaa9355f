/* ends the process it is loaded in once t passes 1 */
#include "model_exchange.h"

static fmi2Status derivative(Model *m)
{
    if (m->time > 1.0) exit(0);
    return fmi2OK;
}
