/*
 * Whether what forces a motion is the same after a period: at the point of the run, with the time moved, rates of the
 * states and indicators of the contacts must be what they are a period later. Of two frequencies, a ramp, or a period that
 * is none, one shows it.
 */
#include "forcing.h"

#include "../events/model_exchange.h"
#include "../events/run.h"

enum { MOMENTS = 3, WATCHED = MODEL_NX + MODEL_NI };

/* parts of the period; none of them a simple one */
static const double moments[MOMENTS] = {0.1371, 0.4483, 0.7719};
/* of the largest value met: what the rounding of the time may do to a stiff contact stays below */
static const double SAME = 1e-6;

static RunStatus forcing_values(Run *r, double time, double *values)
{
    r->at.time = time;
    run_place_signals(r);
    run_touched(r);
    return exchange_derivatives(r, values) == RUN_ERROR ? RUN_ERROR : exchange_indicators(r, values + MODEL_NX);
}

RunStatus forcing_check(Run *r, double period)
{
    double now[MOMENTS][WATCHED + 1], later[MOMENTS][WATCHED + 1];
    const double start = r->at.time;
    signed char known[NC][SLOTS];
    memcpy(known, r->at.known, sizeof known);
    int told = 1;
    for (int k = 0; k < MOMENTS && told; k++) {
        const double time = start + moments[k] * period;
        told = forcing_values(r, time, now[k]) == RUN_OK && forcing_values(r, time + period, later[k]) == RUN_OK;
    }
    r->at.time = start;
    run_place_signals(r);
    run_touched(r);
    memcpy(r->at.known, known, sizeof known);
    for (int i = 0; i < WATCHED && told; i++) {
        double size = 0.0, most = 0.0;
        for (int k = 0; k < MOMENTS; k++) {
            size = fmax(size, fmax(fabs(now[k][i]), fabs(later[k][i])));
            most = fmax(most, fabs(later[k][i] - now[k][i]));
        }
        if (most > SAME * size) {
            return run_fail(
                r,
                "What forces the motion is another %.6g s later. Strobe it with a period that all its "
                "forcing fits into, or with several at a time (every); where there is none, look at it where "
                "a state crosses a level or a contact begins.",
                period);
        }
    }
    return RUN_OK;
}
