/* Co-Simulation, FMI 3: x' = u by steps of 0.01 that show themselves, and ask for u as it is in their midst; counts its
   steps, and how often it was told to return */
#define NX 1
#define NZ 0
#define NP 1
#define PARAMETERS 0.0
#define STARTS 0.0
#include "model.h"

static void derivatives(Model *m, double *dx) { dx[0] = m->p[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}

static fmi3IntermediateUpdateCallback show;

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference *v, size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback intermediate)
{
    /* what the importer will set, no more and no less */
    if (events || !early || n != 1 || v[0] != 201) return NULL;
    show = intermediate;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 length, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Model *m = c;
    bool returns = false;
    double until = 0.0;
    *event = *terminate = *early = false;
    while (m->t < t + length && !returns) {
        const double step = fmin(0.01, t + length - m->t);
        show(m->environment, m->t + 0.5 * step, true, false, false, false, &returns, &until);
        m->x[0] += step * m->p[0];
        m->t = step < 0.01 ? t + length : m->t + step;
        m->mode[0]++;
        show(m->environment, m->t, false, true, true, true, &returns, &until);
    }
    m->mode[1] += returns;
    *early = m->t < t + length;
    *last = m->t;
    return fmi3OK;
}
