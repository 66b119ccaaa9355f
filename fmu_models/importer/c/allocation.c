/* All numbers of a master in one block, taken once. */
#include "jacobian.h"
#include "master_state.h"
#include "search.h"

#include <stdlib.h>

enum { NODES_AND_CHECK = SEARCH_NODES + 1, NODE_TABLE = SEARCH_NODES * SEARCH_NODES };

/* the next n doubles of the block; with no block only counts them */
static double *take(double *block, size_t *used, size_t n)
{
    double *start = block ? block + *used : NULL;
    *used += n;
    return start;
}

static size_t lay_out(Master *m, double *block, size_t inputs, size_t values)
{
    size_t used = 0;
    const size_t n = (size_t)m->n, slots = (size_t)m->nz + 1;
    double **vectors[] = {&m->x,     &m->f,     &m->nominal, &m->before,      &m->x1,
                          &m->f1,    &m->stage, &m->error,   &m->error_low,   &m->seed,
                          &m->point, &m->rates, &m->settled, &m->slide.point, &m->slide.check};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
        *vectors[i] = take(block, &used, n);
    m->k = take(block, &used, TABLEAU_STAGES * n);
    m->dense = take(block, &used, DENSE_TERMS * n);
    m->stages_z = take(block, &used, 3 * n);
    m->stages_w = take(block, &used, 3 * n);
    m->stages_f = take(block, &used, 5 * n);
    m->z = take(block, &used, slots);
    m->z1 = take(block, &used, slots);
    m->slide.z = take(block, &used, slots);
    m->samples = take(block, &used, NODES_AND_CHECK * slots);
    m->node_inverse = take(block, &used, NODE_TABLE);
    m->slide.normal = take(block, &used, SURFACES * n);
    m->slide.gradient = take(block, &used, SURFACES * n);
    m->slide.fields = take(block, &used, SIDES * n);
    m->u = take(block, &used, inputs);
    m->slide.values = take(block, &used, values);
    m->clocked = take(block, &used, values);
    return used;
}

EXPORT void master_free(Master *m)
{
    if (m) {
        free(m->x);
        free(m->real_pivot);
        jacobian_free(m);
        free(m->side);
        free(m->watch);
        free(m);
    }
}

/* NULL if there is no room for it. The instance must outlive the master */
EXPORT Master *master_new(const FmuInstance *fmu, int64_t inputs, int64_t values)
{
    Master *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    m->fmu = fmu;
    m->n = (int)fmu->n_states;
    m->nz = (int)fmu->n_indicators;
    const size_t n = (size_t)m->n, slots = (size_t)m->nz + 1;
    double *block = calloc(lay_out(m, NULL, (size_t)inputs, (size_t)values) + 1, sizeof *block);
    m->real_pivot = calloc(2 * n + 1, sizeof *m->real_pivot);
    m->side = calloc(2 * slots, sizeof *m->side);
    m->watch = calloc(slots, sizeof *m->watch);
    if (!block || !m->real_pivot || !m->side || !m->watch) {
        free(block);
        m->x = NULL;
        master_free(m);
        return NULL;
    }
    lay_out(m, block, (size_t)inputs, (size_t)values);
    m->complex_pivot = m->real_pivot + n;
    m->fired = m->side + slots;
    search_nodes(m);
    return m;
}
