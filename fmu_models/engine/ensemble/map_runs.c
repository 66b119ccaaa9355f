/*
 * Steps of a run of a map: its rule, and the derivative of that along what is followed beside the motion.
 *
 *     quiet steps   all but the last of those that no row and nobody asks for, at once
 *     a step        and what a journey notes of it
 */
#include "map_runs.h"

#include <math.h>

#include "growth.h"

enum {
    MAP_PATIENCE = 1 << 14, /* steps between two looks at whether the run is to be stopped */
    MAP_APART = 8           /* steps over which two differences may lean on each other, unless they come closer */
};

/* sine of the angle between two differences below which they are set apart at once */
static const double MAP_CLOSE = 1e-3;

/* set differences at right angles: the last of all follows from the others and from what became of a small volume, since
   it is lost in the rounding of a strong stretch */
static void map_set_apart(Job *job, double volume)
{
    double factors[EXTENDED];
    const int n = (int)job->e->n_directions;
    for (int k = 0; k < n; k++)
        factors[k] = 1.0;
    growth_orthonormalize(job->directions[0], n, EXTENDED, MODEL_NX, 0, factors);
    if (n == MODEL_NX) {
        double others = 1.0;
        for (int k = 0; k < n - 1; k++)
            others *= factors[k];
        factors[n - 1] = others > 0.0 ? volume / others : factors[n - 1];
    }
    journey_grow(job, factors);
}

/* differences one step on; the factor by which a small volume grows */
static double map_differences(Job *job)
{
    const Run *r = &job->m->core.run;
    double jacobian[MODEL_ROOM(MODEL_NX) * MODEL_ROOM(MODEL_NX)];
    double before[MODEL_ROOM(MODEL_NX)];
    const double volume = fabs(model_iterate_derivative(r->at.p, r->at.x, jacobian));
    for (int k = 0; k < job->e->n_directions; k++) {
        double *d = job->directions[k];
        memcpy(before, d, MODEL_NX * sizeof *before);
        for (int i = 0; i < MODEL_NX; i++)
            d[i] = growth_product(jacobian + (size_t)i * MODEL_NX, before, MODEL_NX);
    }
    return volume;
}

/* whether differences must be set apart after so many steps since they were */
static int map_is_due(const Job *job, int64_t since, double volume)
{
    const int n = (int)job->e->n_directions;
    if (n < 2 || since == MAP_APART) return since == MAP_APART;
    const double sizes = growth_norm(job->directions[0], MODEL_NX) * growth_norm(job->directions[1], MODEL_NX);
    return MODEL_NX > 2 || !(volume > MAP_CLOSE * sizes);
}

/* so many steps; the number of those that arrive */
static int64_t map_steps(Job *job, int64_t steps, Outcome *outcome)
{
    const Ensemble *e = job->e;
    Run *r = &job->m->core.run;
    double next[MODEL_ROOM(MODEL_NX)], volume = 1.0;
    int64_t done, since = 0;
    *outcome = OUTCOME_FINISHED;
    if (!MODEL_IS_MAP) return 0;
    for (done = 0; done < steps && *outcome == OUTCOME_FINISHED; done++) {
        if (e->n_directions > 0) volume *= map_differences(job);
        if (e->jacobians) {
            journey_differences(job, 0.0);
        } else if (e->n_directions > 0 && (map_is_due(job, ++since, volume) || done == steps - 1)) {
            map_set_apart(job, volume);
            volume = 1.0;
            since = 0;
        }
        model_iterate(r->at.p, r->at.x, next);
        for (int i = 0; i < MODEL_NX; i++) {
            if (!(fabs(next[i]) < e->bound))
                *outcome = isfinite(next[i]) && *outcome != OUTCOME_BROKEN ? OUTCOME_ESCAPED : OUTCOME_BROKEN;
            r->at.x[i] = next[i];
        }
    }
    if (*outcome == OUTCOME_BROKEN) run_fail(r, "%s", "the rule has no value there");
    return done;
}

Outcome map_run(Job *job)
{
    Ensemble *e = job->e;
    const Run *r = &job->m->core.run;
    Outcome outcome = OUTCOME_FINISHED;
    if (e->transient == 0 && e->n_rows == 0) return outcome;
    while (1) {
        if (e->stop && *(const volatile int32_t *)e->stop) return OUTCOME_STOPPED;
        const int64_t quiet = journey_quiet(job);
        const int64_t done = map_steps(job, quiet < MAP_PATIENCE ? quiet : MAP_PATIENCE, &outcome);
        journey_pass(job, done);
        job->waited += (double)done;
        if (outcome == OUTCOME_FINISHED && done == quiet && map_steps(job, 1, &outcome) == 1
            && outcome == OUTCOME_FINISHED) {
            const Place at = {r->at.x, r->at.memory, r->at.state, r->at.time};
            if (journey_note(job, &at, 1.0, &outcome)) return outcome;
        } else if (outcome != OUTCOME_FINISHED) {
            return outcome;
        }
    }
}
