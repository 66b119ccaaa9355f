/* The standard's header, with plain function names, for the files of the FMI 3.0 interface. */
#ifndef STICKSLIP_FMI3_INTERFACE_H
#define STICKSLIP_FMI3_INTERFACE_H

#ifndef FMI3_OVERRIDE_FUNCTION_PREFIX
#define FMI3_OVERRIDE_FUNCTION_PREFIX
#endif
#include "fmi3Functions.h"

#endif
