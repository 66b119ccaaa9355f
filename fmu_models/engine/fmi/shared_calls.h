/*
 * What both versions of FMI ask of an instance, alike but for names: included by the file of each, which says how a name,
 * a call about states, the type of an instance and two calls read in its version.
 */
#define STATUS FMI_NAME(Status)
#define FMU_STATE FMI_STATE(, )

STATUS FMI_NAME(SetDebugLogging)(FMI_INSTANCE c, FMI_NAME(Boolean) on, size_t n, const FMI_NAME(String) categories[])
{
    return (STATUS)instance_log(c, __func__, on, n, categories);
}

void FMI_NAME(FreeInstance)(FMI_INSTANCE c) { instance_free(c); }

STATUS FMI_NAME(ExitInitializationMode)(FMI_INSTANCE c)
{
    if (instance_enter(c, PHASE_INITIALIZATION, __func__)) return (STATUS)STATUS_ERROR;
    return (STATUS)instance_exit_initialization(c, __func__);
}

STATUS FMI_NAME(EnterEventMode)(FMI_INSTANCE c) { return (STATUS)instance_enter_event(c, __func__); }

STATUS FMI_NAME(Terminate)(FMI_INSTANCE c)
{
    Instance *m = c;
    if (instance_enter(m, PHASES_RUNNING, __func__)) return (STATUS)STATUS_ERROR;
    m->core.phase = PHASE_TERMINATED;
    return (STATUS)STATUS_OK;
}

STATUS FMI_STATE(Get, )(FMI_INSTANCE c, FMU_STATE *state) { return (STATUS)fmu_state_get(c, __func__, state); }

STATUS FMI_STATE(Set, )(FMI_INSTANCE c, FMU_STATE state) { return (STATUS)fmu_state_set(c, __func__, state); }

STATUS FMI_STATE(Free, )(FMI_INSTANCE c, FMU_STATE *state) { return (STATUS)fmu_state_free(c, __func__, state); }

STATUS FMI_STATE(Serialized, Size)(FMI_INSTANCE c, FMU_STATE state, size_t *size)
{
    return (STATUS)fmu_state_serialized_size(c, __func__, state, size);
}

STATUS FMI_STATE(Serialize, )(FMI_INSTANCE c, FMU_STATE state, FMI_NAME(Byte) bytes[], size_t size)
{
    return (STATUS)fmu_state_serialize(c, __func__, state, (unsigned char *)bytes, size);
}

STATUS FMI_DESERIALIZE(FMI_INSTANCE c, const FMI_NAME(Byte) bytes[], size_t size, FMU_STATE *state)
{
    return (STATUS)fmu_state_deserialize(c, __func__, (const unsigned char *)bytes, size, state);
}

/* Model Exchange */

STATUS FMI_NAME(CompletedIntegratorStep)(FMI_INSTANCE c, FMI_NAME(Boolean) no_set_state,
                                         FMI_NAME(Boolean) * enter_event_mode, FMI_NAME(Boolean) * terminate)
{
    if (instance_enter(c, PHASE_CONTINUOUS, __func__)) return (STATUS)STATUS_ERROR;
    if (instance_array(c, enter_event_mode, 1, __func__, "enterEventMode")) return (STATUS)STATUS_ERROR;
    if (instance_array(c, terminate, 1, __func__, "terminateSimulation")) return (STATUS)STATUS_ERROR;
    *enter_event_mode = *terminate = 0;
    return (STATUS)STATUS_OK;
}

STATUS FMI_NAME(SetTime)(FMI_INSTANCE c, double time) { return (STATUS)instance_set_time(c, __func__, time); }

STATUS FMI_NAME(SetContinuousStates)(FMI_INSTANCE c, const double x[], size_t n)
{
    return (STATUS)instance_set_states(c, __func__, x, n);
}

STATUS DERIVATIVES(FMI_INSTANCE c, double dx[], size_t n) { return (STATUS)instance_derivatives(c, __func__, dx, n); }

STATUS FMI_NAME(GetEventIndicators)(FMI_INSTANCE c, double z[], size_t n)
{
    return (STATUS)instance_indicators(c, __func__, z, n);
}

STATUS FMI_NAME(GetContinuousStates)(FMI_INSTANCE c, double x[], size_t n)
{
    return (STATUS)instance_states(c, __func__, x, n);
}

STATUS FMI_NAME(GetNominalsOfContinuousStates)(FMI_INSTANCE c, double x[], size_t n)
{
    return (STATUS)instance_nominals(c, __func__, x, n);
}

#undef STATUS
#undef FMU_STATE
#undef FMI_STATE
#undef FMI_NAME
#undef FMI_INSTANCE
#undef FMI_DESERIALIZE
#undef DERIVATIVES
