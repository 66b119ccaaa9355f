/* The model and the flow once more, for numbers with a tangent; jets.h first. */
#include "tangent_series.h"

#include "../model/jets.h"
#include "../model/mass_matrix.h"

#include "../model_kind.c"
#include "../model/signals.c"
#include "../step/contact_factor.c"
#include "../step/cone_forces.c"
#include "../step/contact_forces.c"
#include "../step/flow.c"
#include "../step/cone_end.c"
#include "../step/linear_factors.c"

#include "../model/scalar_real.h"
