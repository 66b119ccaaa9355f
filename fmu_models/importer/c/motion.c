/* The right-hand side: that of the FMU, or the mean field of a sliding motion. */
#include "motion.h"

#include "field.h"
#include "slide.h"

Outcome motion_rates(Master *m, double t, const double *x, double *dx)
{
    return m->slide.active ? slide_field(m, t, x, dx) : field_raw(m, t, x, dx);
}

Outcome motion_indicators(Master *m, double t, const double *x, double *z)
{
    const Run *r = m->run;
    z[m->nz + 1] = r->section_state ? x[r->section_state - 1] - r->section_level : 1.0;
    if (m->slide.active) {
        return slide_conditions(m, t, x, z);
    }
    z[m->nz] = 1.0;
    return field_indicators(m, t, x, z);
}
