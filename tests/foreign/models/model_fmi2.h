/* what model.h has in FMI 2 alone */
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String *k) { return fmi2OK; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    if (visible) return NULL; /* it has no window */
    Model *m = calloc(1, sizeof *m);
    m->callbacks = callbacks;
    put_back(m);
    return m;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean given, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends,
                               fmi2Real stop)
{
    ((Model *)c)->t = start;
    return fmi2OK;
}
PLAIN(EnterInitializationMode)
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    Model *m = c;
    *info = (fmi2EventInfo){0};
    info->valuesOfContinuousStatesChanged = update(m);
    compute(m);
    info->newDiscreteStatesNeeded = RESTLESS;
    info->terminateSimulation = m->terminates;
    info->nextEventTimeDefined = m->next_time != INFINITY;
    info->nextEventTime = m->next_time;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real *dx, size_t n)
{
    Model *m = c;
    rated(m);
    derivatives(m, dx);
    return FAILS ? complain(m) : fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference *v, size_t n, fmi2Real *values)
{
    return get_many(c, v, n, values);
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Real *values)
{
    return set_many(c, v, n, values);
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference *v, size_t n, fmi2Integer *values)
{
    for (size_t i = 0; i < n; i++)
        values[i] = ((Model *)c)->mode[v[i] - 401];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *values)
{
    return fmi2Error;
}
#define NONE(Name, Value)                                                                                              \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference *v, size_t n, Value *values)                    \
    {                                                                                                                  \
        return n ? fmi2Error : fmi2OK;                                                                                 \
    }                                                                                                                  \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference *v, size_t n, const Value *values)              \
    {                                                                                                                  \
        return n ? fmi2Error : fmi2OK;                                                                                 \
    }
NONE(Boolean, fmi2Boolean)
#ifndef TEXTS
NONE(String, fmi2String)
#endif
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s)
{
    if (!SAVES) return fmi2Error;
    if (*s == NULL) *s = malloc(sizeof(Model));
    memcpy(*s, c, sizeof(Model));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s)
{
    if (!SAVES) return fmi2Error;
    memcpy(c, s, sizeof(Model));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s)
{
    if (!SAVES) return fmi2Error;
    free(*s);
    *s = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) { return fmi2Error; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte *b, size_t n) { return fmi2Error; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte *b, size_t n, fmi2FMUstate *s) { return fmi2Error; }
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference *u, size_t nu,
                                        const fmi2ValueReference *k, size_t nk, const fmi2Real *seed, fmi2Real *du)
{
#ifdef JACOBIAN
    jacobian(c, seed, du);
    return fmi2OK;
#else
    return fmi2Error;
#endif
}

#ifdef CO_SIMULATION
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *o,
                                       const fmi2Real *d)
{
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference *v, size_t n, const fmi2Integer *o,
                                        fmi2Real *d)
{
    return fmi2Error;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real length, fmi2Boolean no_set)
{
    Model *m = c;
    if (REFUSES(m, t + length)) return fmi2Discard;
    while (do_step(m, t + length))
        update(m);
    return m->terminates || DISCARDS(m) ? fmi2Discard : fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
#define ASK(Name, Value)                                                                                               \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind s, Value *value) { return fmi2Error; }
ASK(Status, fmi2Status)
ASK(IntegerStatus, fmi2Integer)
ASK(StringStatus, fmi2String)
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    *value = ((Model *)c)->terminates;
    return fmi2OK;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    *value = ((Model *)c)->t;
    return fmi2OK;
}
#endif
