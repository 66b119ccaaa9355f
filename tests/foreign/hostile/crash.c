/* writes through a null pointer once t passes 1 */
#include "model_exchange.h"

static fmi2Status derivative(Model *m)
{
    if (m->time > 1.0) *(volatile int *)0 = 1;
    return fmi2OK;
}
