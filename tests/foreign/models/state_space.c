/* x' = A x + B u, y = C x + D u with sizes n, m, r set in configuration mode: FMI 3, a library of its own */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define FMI3_OVERRIDE_FUNCTION_PREFIX
#include "fmi3Functions.h"

enum { MOST = 5 };
/* value references, and the two sizes of each array: which of m, n, r (0: one) */
enum { TIME, M, N, R, A, B, C, D, X0, U, Y, X, DX, COUNT };
static const int sizes[COUNT][2] = {[A] = {N, N}, [B] = {N, M}, [C] = {R, N}, [D] = {R, M}, [X0] = {N, 0},
                                    [U] = {M, 0}, [Y] = {R, 0}, [X] = {N, 0}, [DX] = {N, 0}};

typedef struct {
    double time, values[COUNT][MOST * MOST];
    uint64_t size[R + 1];
    int configures;
    fmi3LogMessageCallback log;
    void *environment;
} Model;

static size_t length(const Model *m, unsigned v)
{
    size_t n = 1;
    for (int k = 0; k < 2; k++)
        n *= sizes[v][k] ? m->size[sizes[v][k]] : 1;
    return n;
}

/* unit matrices, x0 = 1, 2, ..., u = 0; A turns the sign */
static void fill(Model *m)
{
    memset(m->values, 0, sizeof m->values);
    for (unsigned v = A; v <= D; v++)
        for (size_t i = 0; i < length(m, v); i++)
            m->values[v][i] = i / m->size[sizes[v][1]] == i % m->size[sizes[v][1]] ? (v == A ? -1.0 : 1.0) : 0.0;
    for (size_t i = 0; i < m->size[N]; i++)
        m->values[X0][i] = (double)(i + 1);
}

static void rates(Model *m)
{
    double (*v)[MOST * MOST] = m->values;
    const size_t n = m->size[N], inputs = m->size[M];
    for (size_t i = 0; i < n; i++) {
        v[DX][i] = 0.0;
        for (size_t k = 0; k < n; k++)
            v[DX][i] += v[A][i * n + k] * v[X][k];
        for (size_t k = 0; k < inputs; k++)
            v[DX][i] += v[B][i * inputs + k] * v[U][k];
    }
    for (size_t i = 0; i < m->size[R]; i++) {
        v[Y][i] = 0.0;
        for (size_t k = 0; k < n; k++)
            v[Y][i] += v[C][i * n + k] * v[X][k];
        for (size_t k = 0; k < inputs; k++)
            v[Y][i] += v[D][i * inputs + k] * v[U][k];
    }
}

static void restart(Model *m)
{
    m->time = 0.0;
    m->size[M] = m->size[N] = m->size[R] = 3;
    fill(m);
}

static fmi3Status fail(Model *m, const char *text)
{
    m->log(m->environment, fmi3Error, "logStatusError", text);
    return fmi3Error;
}

#define PLAIN(Name)                                                                                                    \
    fmi3Status fmi3##Name(fmi3Instance c) { return fmi3OK; }
PLAIN(EnterEventMode)
PLAIN(EnterContinuousTimeMode)
PLAIN(EnterStepMode)
PLAIN(Terminate)
const char *fmi3GetVersion(void) { return fmi3Version; }
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3Reset(fmi3Instance c)
{
    restart(c);
    return fmi3OK;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    Model *m = calloc(1, sizeof *m);
    m->log = log;
    m->environment = environment;
    restart(m);
    return m;
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference *v, size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback intermediate)
{
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
}
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c)
{
    ((Model *)c)->configures = 1;
    return fmi3OK;
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c)
{
    ((Model *)c)->configures = 0;
    fill(c);
    return fmi3OK;
}
fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3UInt64 *values, size_t count)
{
    Model *m = c;
    if (!m->configures) return fail(m, "sizes are set in configuration mode");
    for (size_t i = 0; i < n; i++) {
        if (v[i] < M || v[i] > R || values[i] > MOST) return fail(m, "a size is 5 at most");
        m->size[v[i]] = values[i];
    }
    return fmi3OK;
}
fmi3Status fmi3GetUInt64(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3UInt64 *values, size_t count)
{
    for (size_t i = 0; i < n; i++)
        values[i] = ((Model *)c)->size[v[i]];
    return fmi3OK;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean given, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 stop)
{
    Model *m = c;
    m->time = start;
    memcpy(m->values[X], m->values[X0], sizeof m->values[X]);
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    Model *m = c;
    memcpy(m->values[X], m->values[X0], sizeof m->values[X]);
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Float64 *values, size_t count)
{
    Model *m = c;
    double *end = values + count;
    rates(m);
    for (size_t i = 0; i < n; i++) {
        const size_t size = v[i] == TIME ? 1 : length(m, v[i]);
        if (v[i] >= COUNT || values + size > end) return fail(m, "an array has another size");
        memcpy(values, v[i] == TIME ? &m->time : m->values[v[i]], size * sizeof *values);
        values += size;
    }
    return values == end ? fmi3OK : fail(m, "an array has another size");
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3Float64 *values,
                          size_t count)
{
    Model *m = c;
    const double *end = values + count;
    for (size_t i = 0; i < n; i++) {
        const size_t size = length(m, v[i]);
        if (v[i] < A || v[i] > U || values + size > end) return fail(m, "an array has another size");
        memcpy(m->values[v[i]], values, size * sizeof *values);
        values += size;
    }
    return values == end ? fmi3OK : fail(m, "an array has another size");
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    *n = ((Model *)c)->size[N];
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    *n = 0;
    return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    ((Model *)c)->time = time;
    return fmi3OK;
}
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 *x, size_t n)
{
    memcpy(((Model *)c)->values[X], x, n * sizeof *x);
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 *x, size_t n)
{
    memcpy(x, ((Model *)c)->values[X], n * sizeof *x);
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 *dx, size_t n)
{
    rates(c);
    memcpy(dx, ((Model *)c)->values[DX], n * sizeof *dx);
    return fmi3OK;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    return fmi3OK;
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 *z, size_t n) { return fmi3OK; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *terminate)
{
    *event = *terminate = false;
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *states, fmi3Boolean *defined, fmi3Float64 *next)
{
    *again = *terminate = *nominals = *states = *defined = false;
    return fmi3OK;
}
/* by many small steps of the midpoint rule */
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 step, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Model *m = c;
    const double h = step / 1000;
    double x[MOST];
    for (int k = 0; k < 1000; k++) {
        memcpy(x, m->values[X], sizeof x);
        for (int half = 1; half <= 2; half++) {
            rates(m);
            for (size_t i = 0; i < m->size[N]; i++)
                m->values[X][i] = x[i] + 0.5 * half * h * m->values[DX][i];
        }
    }
    *last = m->time = t + step;
    *event = *terminate = *early = false;
    return fmi3OK;
}
