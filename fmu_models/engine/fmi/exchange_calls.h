/*
 * What both versions of FMI ask of Model Exchange, alike but for names: included by the file of each, which says how a
 * name and a type of its version begin.
 */
#define STATUS FMI_NAME(Status)

STATUS FMI_NAME(CompletedIntegratorStep)(FMI_INSTANCE c, FMI_NAME(Boolean) no_set_state,
                                         FMI_NAME(Boolean) * enter_event_mode, FMI_NAME(Boolean) * terminate)
{
    (void)no_set_state;
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
#undef FMI_NAME
#undef FMI_INSTANCE
#undef DERIVATIVES
