/* Functions of the clocks of a model (FMI 3), in the order of their value references from 601 on. The C file that
   includes this after model.h defines tick; intervals that it tells are asked for once each */

/* clock number k is active: its part of the model moves on */
static void tick(Model *m, int k);

static void tell(Model *m, int k, double interval)
{
    m->interval[k] = interval;
    m->qualifier[k] = fmi3IntervalChanged;
}

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Clock *values)
{
    for (size_t i = 0; i < n; i++) {
        values[i] = ((Model *)c)->active[v[i] - 601];
        ((Model *)c)->active[v[i] - 601] = 0;
    }
    return fmi3OK;
}
fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Float64 *intervals,
                                  fmi3IntervalQualifier *qualifiers)
{
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        qualifiers[i] = (fmi3IntervalQualifier)m->qualifier[v[i] - 601];
        intervals[i] = m->interval[v[i] - 601];
        if (qualifiers[i] == fmi3IntervalChanged) m->qualifier[v[i] - 601] = fmi3IntervalUnchanged;
    }
    return fmi3OK;
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3Float64 *shifts)
{
    for (size_t i = 0; i < n; i++)
        shifts[i] = 0.0;
    return fmi3OK;
}
