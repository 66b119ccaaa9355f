/* what model.h has in FMI 3 alone */
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String *k) { return fmi3OK; }
const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    if (visible) return NULL; /* it has no window */
    Model *m = calloc(1, sizeof *m);
    m->log = log;
    m->environment = environment;
    put_back(m);
    return m;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean given, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean ends, fmi3Float64 stop)
{
    ((Model *)c)->t = start;
#ifdef CLOCKS
    begin(c);
#endif
    return fmi3OK;
}
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *states, fmi3Boolean *defined, fmi3Float64 *next)
{
    Model *m = c;
    *states = update(m);
    compute(m);
    *again = RESTLESS;
    *nominals = false;
    *terminate = m->terminates;
    *defined = m->next_time != INFINITY;
    *next = m->next_time;
    return fmi3OK;
}
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 *dx, size_t n)
{
    Model *m = c;
    rated(m);
    derivatives(m, dx);
    return FAILS ? complain(m) : fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    *n = NX;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    *n = NZ;
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Float64 *values, size_t m)
{
    return get_many(c, v, n, values);
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3Float64 *values, size_t m)
{
    return set_many(c, v, n, values);
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Int32 *values, size_t m)
{
    for (size_t i = 0; i < n; i++)
        for (unsigned k = 0; k < SIZE(v[i]); k++) {
            if (!READABLE((Model *)c, v[i])) return fmi3Error;
            *values++ = ((Model *)c)->mode[v[i] + k - 401];
        }
    return fmi3OK;
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference *u, size_t nu,
                                        const fmi3ValueReference *k, size_t nk, const fmi3Float64 *seed, size_t ns,
                                        fmi3Float64 *du, size_t nd)
{
#ifdef JACOBIAN
    jacobian(c, seed, du);
    return fmi3OK;
#else
    return fmi3Error;
#endif
}

#ifdef CO_SIMULATION
PLAIN(EnterStepMode)
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference *v, size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback intermediate)
{
#ifdef REFUSES_EVENTS
    if (events) log(environment, fmi3Error, "logStatusError", "no event mode here");
    const bool makes = !events;
#else
    const bool makes = events && early;
#endif
    return makes ? fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log) : NULL;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 length, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Model *m = c;
#ifdef REFUSES_EVENTS
    *event = *early = false;
    while (do_step(m, t + length))
        update(m);
#else
    *event = *early = do_step(m, t + length);
#endif
    *terminate = m->terminates;
    *last = m->t;
    return DISCARDS(m) ? fmi3Discard : fmi3OK;
}
#endif
