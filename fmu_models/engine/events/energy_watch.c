/*
 * The balance of energy at events, watched in every run.
 *
 *     projection   onto zero slip or zero rate of a gap: what it moves is rounding, and T+ = T-
 *     impact       T+ - T- = sum over contacts of J (v- + v+)/2 Lambda,    y = J v + b
 *
 * T is the kinetic energy of the declaration, not of the factored form that steps and impulses are made of: a matrix
 * that is wrong, or whose inverse has no digits left, shows here, and so does a contact that holds without a lever.
 * What rounding may do is measured by the kinetic energy itself, and, where a body comes to rest, by its speeds over
 * the step before, by what an impact at the same instant took, and by typical ones.
 *
 * Steps are not watched: the power as a series, at every step, costs 40 to 80 % of a run.
 * Events of an importer that integrates by itself are located by its own errors, which these bounds do not know.
 */
#include "energy_watch.h"

Velocities energy_velocities(const Run *r)
{
    Velocities found = {{0.0}};
    memcpy(found.v, r->at.x + MODEL_NQ, MODEL_NV * sizeof found.v[0]);
    return found;
}

/* kinetic energy with other velocities */
static double kinetic_energy_at(Run *r, const double *v)
{
    const Velocities now = energy_velocities(r);
    memcpy(r->at.x + MODEL_NQ, v, MODEL_NV * sizeof *v);
    const double energy = model_kinetic_energy(&r->at);
    memcpy(r->at.x + MODEL_NQ, now.v, MODEL_NV * sizeof now.v[0]);
    return energy;
}

/* of the speeds that the rounding of the step before is a part of: the sums of the magnitudes of its terms */
static double energy_of_step(Run *r)
{
    double v[MODEL_ROOM(MODEL_NV)] = {0.0};
    const double s = r->segment_rooted ? sqrt(r->segment_length) : r->segment_length;
    for (int i = 0; i < MODEL_NV; i++)
        for (int k = r->segment_order; k >= 0; k--)
            v[i] = v[i] * s + fabs(r->jets.x[MODEL_NQ + i][k]);
    return kinetic_energy_at(r, v);
}

/* a projection takes back what this many coarse steps may have moved */
static const double STEPS = 100.0;

/* whether a change of the kinetic energy from one value to another is rounding */
static int is_rounding(Run *r, double change, double before, double after)
{
    const double tolerance = fmax(r->tolerances.energy, STEPS * r->tolerances.step);
    if (fabs(change) <= tolerance * (before + after)) return 1;
    const double typical = energy_of_step(r) + fabs(r->impact_work)
                           + kinetic_energy_at(r, model_nominal_states + MODEL_NQ);
    return fabs(change) <= tolerance * tolerance * typical;
}

/* a projection has nothing to watch where there is no body, and nothing to compare with where an importer integrates */
static int is_watched(const Run *r) { return MODEL_NQ > 0 && !(r->tolerances.drift > 0.0); }

RunStatus energy_check_projection(Run *r, const Velocities *before)
{
    if (!is_watched(r) || memcmp(before->v, r->at.x + MODEL_NQ, MODEL_NV * sizeof before->v[0]) == 0) return RUN_OK;
    const double was = kinetic_energy_at(r, before->v);
    const double is = model_kinetic_energy(&r->at);
    if (is_rounding(r, is - was, was, is)) return RUN_OK;
    int contact[NC], count = 0;
    char names[64];
    for (int c = 0; c < MODEL_NC; c++)
        if (r->projected[c] || contact_is_held(r->at.state, c)) contact[count++] = c;
    run_name_contacts(contact, count, names, sizeof names);
    return run_fail(r,
                    "energy is not kept at t = %.17g: holding %s would change the kinetic energy from %.6g to %.6g J, "
                    "though nothing slips there: next to no lever; change a parameter a little",
                    r->at.time, names, was, is);
}

/* work of the impulses on the bodies, its size added to what it is compared with: J v is order 1 of the rates along the
   mean velocities, all else held */
static double work_of_impulses(Run *r, const Velocities *before, double *size)
{
    Jets *j = &r->scratch;
    double work = 0.0;
    j->t[1] = 0.0;
    for (int i = 0; i < MODEL_NU; i++)
        j->u[i][1] = j->du[i][1] = 0.0;
    for (int i = 0; i < MODEL_NX; i++)
        j->x[i][1] = 0.0;
    for (int i = 0; i < MODEL_NV; i++)
        j->x[MODEL_NQ + i][1] = 0.5 * (before->v[i] + r->at.x[MODEL_NQ + i]);
    model_slip(r->at.p, r->at.d, j, 1);
    for (int c = 0; c < MODEL_NC; c++) {
        work += r->impulse[c] * j->slip[c][1];
        *size += fabs(r->impulse[c] * j->slip[c][1]);
    }
    return work;
}

RunStatus energy_check_impact(Run *r, const Velocities *before)
{
    if (!is_watched(r)) return RUN_OK;
    const double was = kinetic_energy_at(r, before->v);
    const double is = model_kinetic_energy(&r->at);
    double size = was;
    const double work = work_of_impulses(r, before, &size);
    if (is_rounding(r, is - was - work, size, is)) return RUN_OK;
    return run_fail(
        r,
        "energy is not kept at t = %.17g: an impact changes the kinetic energy from %.6g to %.6g J, but its "
        "impulses do the work %.6g J: the mass matrix has next to no inverse there; look at the masses",
        r->at.time, was, is, work);
}
