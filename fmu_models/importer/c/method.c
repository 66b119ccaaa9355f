/* A step by the method in use. */
#include "method.h"

#include "explicit.h"
#include "stiff.h"

Outcome method_try(Master *m, double length, double *error)
{
    m->dense_ready = 0;
    m->length = length;
    return m->stiff ? stiff_try(m, length, error) : explicit_try(m, length, error);
}

Outcome method_dense(Master *m)
{
    if (m->dense_ready) return FINE;
    m->dense_ready = 1;
    return m->stiff ? stiff_dense(m) : explicit_dense(m);
}
