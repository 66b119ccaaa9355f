/* what model.h has in FMI 1.0 alone, where every function begins with the name of the model: -DPREFIX=name_ */
#define GLUED(prefix, suffix) prefix##fmi##suffix
#define GLUE(prefix, suffix) GLUED(prefix, suffix)
#define F1(Result, Name) __attribute__((visibility("default"))) Result GLUE(PREFIX, Name)

F1(const char *, GetVersion)(void) { return "1.0"; }
F1(const char *, GetModelTypesPlatform)(void) { return "standard32"; }
F1(const char *, GetTypesPlatform)(void) { return "standard32"; }
F1(fmi1Status, SetDebugLogging)(void *c, fmi1Boolean on) { return fmi1OK; }

static Model *made(fmi1CallbackFunctions callbacks)
{
    Model *m = calloc(1, sizeof *m);
    m->callbacks = callbacks;
    put_back(m);
    return m;
}
F1(fmi1Status, SetReal)(void *c, const fmi1ValueReference v[], size_t n, const fmi1Real values[])
{
    return set_many(c, v, n, values);
}
F1(fmi1Status, GetReal)(void *c, const fmi1ValueReference v[], size_t n, fmi1Real values[])
{
    /* it has no values before it is initialized */
    return ((Model *)c)->initialized ? get_many(c, v, n, values) : fmi1Error;
}
F1(fmi1Status, GetInteger)(void *c, const fmi1ValueReference v[], size_t n, fmi1Integer values[])
{
    for (size_t i = 0; i < n; i++)
        values[i] = ((Model *)c)->mode[v[i] - 401];
    return fmi1OK;
}
/* a Boolean is whether the whole number is odd */
F1(fmi1Status, GetBoolean)(void *c, const fmi1ValueReference v[], size_t n, fmi1Boolean values[])
{
    for (size_t i = 0; i < n; i++)
        values[i] = (char)(((Model *)c)->mode[v[i] - 401] & 1);
    return fmi1OK;
}
#define NONE1(Name, Value)                                                                                             \
    F1(fmi1Status, Name)(void *c, const fmi1ValueReference v[], size_t n, Value values[])                              \
    {                                                                                                                  \
        return n ? fmi1Error : fmi1OK;                                                                                 \
    }
#ifndef TEXTS
NONE1(GetString, fmi1String)
NONE1(SetString, const fmi1String)
#endif
NONE1(SetInteger, const fmi1Integer)
NONE1(SetBoolean, const fmi1Boolean)

static void tell(Model *m, fmi1EventInfo *info)
{
    *info = (fmi1EventInfo){.iterationConverged = !RESTLESS, .stateValuesChanged = (char)update(m)};
    compute(m);
    info->terminateSimulation = (char)m->terminates;
    info->upcomingTimeEvent = m->next_time != INFINITY;
    info->nextEventTime = m->next_time;
}
F1(void *, InstantiateModel)(fmi1String name, fmi1String guid, fmi1CallbackFunctions callbacks, fmi1Boolean logging)
{
    return made(callbacks);
}
F1(void, FreeModelInstance)(void *c) { free(c); }
F1(fmi1Status, SetTime)(void *c, double t)
{
    ((Model *)c)->t = t;
    ((Model *)c)->stale = 1;
    return fmi1OK;
}
F1(fmi1Status, Initialize)(void *c, fmi1Boolean given, fmi1Real tolerance, fmi1EventInfo *info)
{
    if (((Model *)c)->initialized++) return fmi1Error;
    tell(c, info);
    return fmi1OK;
}
F1(fmi1Status, EventUpdate)(void *c, fmi1Boolean intermediate, fmi1EventInfo *info)
{
    tell(c, info);
    return fmi1OK;
}
F1(fmi1Status, CompletedIntegratorStep)(void *c, fmi1Boolean *event)
{
    Model *m = c;
    m->wants_event = 0;
    after_step(m);
    *event = (char)m->wants_event;
    return fmi1OK;
}
/* the library has its states the other way round, unless it does not tell (TELLS_NO_STATES 1; 2: and turns them) */
#ifndef TELLS_NO_STATES
#define TELLS_NO_STATES 0
#endif
#define TURNED(i, n) (TELLS_NO_STATES == 1 ? (i) : (n) - 1 - (i))
F1(fmi1Status, GetStateValueReferences)(void *c, fmi1ValueReference v[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        v[i] = 1 + (unsigned)TURNED(i, n);
    return TELLS_NO_STATES ? complain(c) : fmi1OK;
}
F1(fmi1Status, SetContinuousStates)(void *c, const fmi1Real x[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        ((Model *)c)->x[TURNED(i, n)] = x[i];
    ((Model *)c)->stale = 1;
    return fmi1OK;
}
F1(fmi1Status, GetContinuousStates)(void *c, fmi1Real x[], size_t n)
{
    for (size_t i = 0; i < n; i++)
        x[i] = ((Model *)c)->x[TURNED(i, n)];
    return fmi1OK;
}
F1(fmi1Status, GetDerivatives)(void *c, fmi1Real dx[], size_t n)
{
    Model *m = c;
    double rates[NX + 1];
    rated(m);
    derivatives(m, rates);
    for (size_t i = 0; i < n; i++)
        dx[i] = rates[TURNED(i, n)];
    return FAILS ? complain(m) : fmi1OK;
}
F1(fmi1Status, GetNominalContinuousStates)(void *c, fmi1Real x[], size_t n)
{
    double nominals[NX + 1];
    NAME(GetNominalsOfContinuousStates)(c, nominals, n);
    for (size_t i = 0; i < n; i++)
        x[i] = nominals[TURNED(i, n)];
    return fmi1OK;
}
F1(fmi1Status, GetEventIndicators)(void *c, fmi1Real z[], size_t n) { return NAME(GetEventIndicators)(c, z, n); }
F1(fmi1Status, Terminate)(void *c) { return fmi1OK; }

#ifdef CO_SIMULATION
F1(void *, InstantiateSlave)(fmi1String name, fmi1String guid, fmi1String location, fmi1String type, fmi1Real timeout,
                             fmi1Boolean visible, fmi1Boolean interactive, fmi1CallbackFunctions callbacks,
                             fmi1Boolean logging)
{
    return visible || strncmp(location, "file://", 7) || strcmp(type, "application/x-fmu-sharedlibrary")
               ? NULL
               : made(callbacks);
}
F1(void, FreeSlaveInstance)(void *c) { free(c); }
F1(fmi1Status, InitializeSlave)(void *c, fmi1Real start, fmi1Boolean ends, fmi1Real stop)
{
    if (((Model *)c)->initialized++) return fmi1Error;
    ((Model *)c)->t = start;
    return fmi1OK;
}
F1(fmi1Status, TerminateSlave)(void *c) { return fmi1OK; }
F1(fmi1Status, ResetSlave)(void *c) { return fmi1Error; }
F1(fmi1Status, DoStep)(void *c, fmi1Real t, fmi1Real length, fmi1Boolean is_new)
{
    Model *m = c;
    while (do_step(m, t + length))
        update(m);
    return m->terminates || DISCARDS(m) || !is_new ? fmi1Discard : fmi1OK;
}
F1(fmi1Status, CancelStep)(void *c) { return fmi1Error; }
#define ASK1(Name, Value)                                                                                              \
    F1(fmi1Status, Get##Name)(void *c, const fmi1StatusKind s, Value *value) { return fmi1Error; }
ASK1(Status, fmi1Status)
ASK1(IntegerStatus, fmi1Integer)
ASK1(BooleanStatus, fmi1Boolean)
ASK1(StringStatus, fmi1String)
F1(fmi1Status, GetRealStatus)(void *c, const fmi1StatusKind s, fmi1Real *value)
{
    *value = ((Model *)c)->t;
    return fmi1OK;
}
#define DERIVE1(Name, Value)                                                                                           \
    F1(fmi1Status, Name)(void *c, const fmi1ValueReference v[], size_t n, const fmi1Integer order[], Value values[])   \
    {                                                                                                                  \
        return fmi1Error;                                                                                              \
    }
DERIVE1(SetRealInputDerivatives, const fmi1Real)
DERIVE1(GetRealOutputDerivatives, fmi1Real)
#endif
