/* The FMI 3.0 interface of an instance: its variables. */
#include "fmi3_interface.h"

#include "clocks.h"
#include "variables.h"

/* variables of the types the model has */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[],
                          size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_get(c, __func__, vr, n, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_set(c, __func__, vr, n, values);
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 values[], size_t n_values)
{
    if (instance_enter(c, PHASES_ALL, __func__) || instance_same(c, __func__, n, n_values)) return fmi3Error;
    return (fmi3Status)variables_get_contacts(c, __func__, vr, n, values);
}

fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 values[],
                        size_t n_values)
{
    (void)vr;
    (void)values;
    (void)n_values;
    return (fmi3Status)variables_none(c, __func__, n, "of type Int32 that can be set");
}

/* variables of the types it has not */

#define NO_VARIABLES(type, value_type)                                                                                 \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, value_type values[],             \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)vr;                                                                                                      \
        (void)values;                                                                                                  \
        (void)n_values;                                                                                                \
        return (fmi3Status)variables_none(c, __func__, n, "of type " #type);                                           \
    }                                                                                                                  \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const value_type values[],       \
                             size_t n_values)                                                                          \
    {                                                                                                                  \
        (void)vr;                                                                                                      \
        (void)values;                                                                                                  \
        (void)n_values;                                                                                                \
        return (fmi3Status)variables_none(c, __func__, n, "of type " #type);                                           \
    }

NO_VARIABLES(Float32, fmi3Float32)
NO_VARIABLES(Int8, fmi3Int8)
NO_VARIABLES(UInt8, fmi3UInt8)
NO_VARIABLES(Int16, fmi3Int16)
NO_VARIABLES(UInt16, fmi3UInt16)
NO_VARIABLES(UInt32, fmi3UInt32)
NO_VARIABLES(Int64, fmi3Int64)
NO_VARIABLES(UInt64, fmi3UInt64)
NO_VARIABLES(Boolean, fmi3Boolean)
NO_VARIABLES(String, fmi3String)

/* a function of FMI 3 about variables the model has none of; arguments is its parameter list after the instance */
#define NOTHING_TO(name, kind, ...)                                                                                    \
    fmi3Status fmi3##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, __VA_ARGS__)                        \
    {                                                                                                                  \
        (void)vr;                                                                                                      \
        return (fmi3Status)variables_none(c, __func__, n, kind);                                                       \
    }

/* a function about clocks of another kind than the model has */
#define ONLY_OTHER_CLOCKS(name, reason, ...)                                                                           \
    fmi3Status fmi3##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, __VA_ARGS__)                        \
    {                                                                                                                  \
        return (fmi3Status)clocks_refuse(c, __func__, vr, n, reason);                                                  \
    }
#define NOT_SET "the clocks tick by themselves and cannot be set"
#define NOT_TIMED "the clocks tick at events, and have neither an interval nor a shift"

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[])
{
    return (fmi3Status)clocks_get(c, __func__, vr, n, values);
}

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter" /* their whole purpose is to ignore what they are given */
#endif
NOTHING_TO(GetBinary, "of type Binary", size_t sizes[], fmi3Binary values[], size_t n_values)
NOTHING_TO(SetBinary, "of type Binary", const size_t sizes[], const fmi3Binary values[], size_t n_values)
ONLY_OTHER_CLOCKS(SetClock, NOT_SET, const fmi3Clock values[])
ONLY_OTHER_CLOCKS(GetIntervalDecimal, NOT_TIMED, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ONLY_OTHER_CLOCKS(GetIntervalFraction, NOT_TIMED, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                  fmi3IntervalQualifier qualifiers[])
ONLY_OTHER_CLOCKS(GetShiftDecimal, NOT_TIMED, fmi3Float64 shifts[])
ONLY_OTHER_CLOCKS(GetShiftFraction, NOT_TIMED, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ONLY_OTHER_CLOCKS(SetIntervalDecimal, NOT_TIMED, const fmi3Float64 intervals[])
ONLY_OTHER_CLOCKS(SetIntervalFraction, NOT_TIMED, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ONLY_OTHER_CLOCKS(SetShiftDecimal, NOT_TIMED, const fmi3Float64 shifts[])
ONLY_OTHER_CLOCKS(SetShiftFraction, NOT_TIMED, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n)
{
    (void)vr;
    (void)n;
    return (fmi3Status)instance_not_provided(
        c, __func__, "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t dependent_elements[],
                                       fmi3ValueReference independents[], size_t independent_elements[],
                                       fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent;
    (void)dependent_elements;
    (void)independents;
    (void)independent_elements;
    (void)kinds;
    (void)n;
    return (fmi3Status)instance_not_provided(
        c, __func__, "dependencies are in modelDescription.xml (providesPerElementDependencies is false)");
}

/* directional derivatives take a seed per known and give a number per unknown, adjoint ones the other way round */
#define DERIVATIVES_OF(Name, derive, n_given, n_found)                                                                 \
    fmi3Status fmi3Get##Name##Derivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,       \
                                         const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], \
                                         size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)               \
    {                                                                                                                  \
        if (instance_enter(c, PHASES_ALL, __func__)) return fmi3Error;                                                 \
        if (instance_same(c, __func__, n_given, n_seed) || instance_same(c, __func__, n_found, n_sensitivity))         \
            return fmi3Error;                                                                                          \
        return (fmi3Status)derive(c, __func__, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);             \
    }

DERIVATIVES_OF(Directional, variables_directional, n_knowns, n_unknowns)
DERIVATIVES_OF(Adjoint, variables_adjoint, n_unknowns, n_knowns)
