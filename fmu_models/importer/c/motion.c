/* The right-hand side: that of the FMU, or the mean field of a sliding motion. */
#include "motion.h"

#include "field.h"
#include "slide.h"

Outcome motion_rates(Master *m, double t, const double *x, double *dx)
{
    return m->slide.n ? slide_field(m, t, x, dx) : field_raw(m, t, x, dx);
}

Outcome motion_indicators(Master *m, double t, const double *x, double *z)
{
    const Run *r = m->run;
    if (r->section_state) z[m->nz] = x[r->section_state - 1] - r->section_level;
    return m->slide.n ? slide_conditions(m, t, x, z) : field_indicators(m, t, x, z);
}
