/*
 * Impacts of rigid contacts: the velocities after one.
 *
 *     gamma = rates of the gaps, and slip speeds; gamma+ = gamma- + G Lambda
 *     Newton    Lambda_N >= 0,             gamma_N+ >= -e gamma_N-,   one of them an equality; gamma_T by Coulomb's law
 *     Poisson   compression: Lambda_N >= 0,  gamma_N >= 0,    one of them an equality
 *               expansion:   Lambda_N >= e Lambda_N of compression,  gamma_N+ >= 0,  one of them an equality
 *     Coulomb   |Lambda_T| <= mu Lambda_N; gamma_T+ = 0 where smaller, else Lambda_T against gamma_T+
 *
 * All contacts at their wall take part, closed ones too. A phase is one complementarity problem with boxes
 * (complementarity.c), in which all start held.
 *
 *     several:  with much friction there may be more than one solution. Of those found the one that loses most energy is
 *               taken, of equal ones the one with most contacts held, which is the first. Others are looked for from
 *               every state of each contact with friction, and of each two, kept while the others are solved for; of
 *               more than FEW contacts with friction the first solution stands.
 *     none:     an error that names the contacts.
 *
 * Newton's restitution with friction can gain energy; work says so. Poisson's cannot.
 *
 * Sources: Glocker and Pfeiffer, Multiple impacts with friction in rigid multibody systems, Nonlinear Dynamics 7
 *          (1995).
 */
#include "impact.h"

#include "../step/contact_forces.h"
#include "contact_box.h"

/* contacts with friction up to which other solutions are looked for, and states of such a contact */
enum { FEW = 6, STATES = 6 };

typedef struct {
    int count;
    int contact[NC]; /* rigid contacts that take part */
    Real given[NC], target[NC];
    double speed; /* scale of the rates */
} Problem;

/* a solution, or none yet */
typedef struct {
    int found;
    double work;
    signed char state[NC];
} Solution;

/* unknown: impulse of contact c, or of its friction, if normal is not -1 */
static void add_impulse(const Run *r, const Problem *problem, ContactBox *o, int i, int c, int normal)
{
    o->contact[i] = c;
    o->unknown[c] = i;
    o->b[i] = r->scratch.slip[c][0] - (normal < 0 ? problem->target[c] : 0.0);
    /* impulses of an expansion may be as small as the rounding of those of the compression */
    o->size[i] = fabs(o->b[i]);
    o->lower[i] = normal < 0 ? problem->given[c] : 0.0;
    o->upper[i] = normal < 0 ? INFINITY : 0.0;
    o->mu[i] = normal < 0 ? 0.0 : model_friction(r->at.p, r->at.d, c);
    o->partner[i] = normal < 0 ? -1 : o->unknown[normal];
}

static void set_impulses(const Run *r, const Problem *problem, ContactBox *o)
{
    int n = 0;
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        add_impulse(r, problem, o, n++, c, -1);
        if (model_contact_partner[c] >= 0) {
            add_impulse(r, problem, o, n++, model_contact_partner[c], c);
        }
    }
    for (int i = 0; i < n; i++) {
        for (int e = 0; e < n; e++) {
            o->G[i * n + e] = r->scratch.G[o->contact[i]][o->contact[e]][0];
        }
    }
    contact_box_close(o, n, r->tolerances.margin);
}

/* whether friction i has nothing to rub with: its contact stays open */
static int has_no_load(const ContactBox *o, int i)
{
    return o->partner[i] >= 0 && o->state[o->partner[i]] != 0 && o->lower[o->partner[i]] == 0.0;
}

/* whether the rates after the impulses are those of the states; work: of the impulses */
static int rates_fit(const Run *r, const Problem *problem, const ContactBox *o, double *work)
{
    const double zero = r->tolerances.margin * problem->speed;
    *work = 0.0;
    for (int i = 0; i < o->problem.n; i++) {
        double change = 0.0;
        for (int e = 0; e < o->problem.n; e++) {
            change += o->G[i * o->problem.n + e] * o->force[e];
        }
        const double rate = o->b[i] + change;
        *work += o->force[i] * (r->scratch.slip[o->contact[i]][0] + 0.5 * change);
        /* not a number fits nowhere */
        if (!(o->state[i] == 0 ? fabs(rate) <= zero : has_no_load(o, i) || -o->state[i] * rate >= -zero)) {
            return 0;
        }
    }
    return 1;
}

/* the solution that the states in the box lead to, if it loses more than the best */
static void try_states(const Run *r, const Problem *problem, ContactBox *o, Solution *best)
{
    double work;
    if (!contact_box_solve(o, !best->found) || !rates_fit(r, problem, o, &work)) {
        return;
    }
    if (!best->found || work < best->work - r->tolerances.margin * fabs(best->work)) {
        best->found = 1;
        best->work = work;
        memcpy(best->state, o->state, sizeof best->state);
    }
}

/* state number of friction i and its contact, kept while the others are solved for */
static void keep_state(ContactBox *o, signed char *fixed, int i, int number)
{
    const int normal = o->partner[i];
    o->state[normal] = (signed char)(number < 3 ? 0 : -1);
    o->state[i] = (signed char)(has_no_load(o, i) ? -1 : number % 3 - 1);
    fixed[normal] = fixed[i] = 1;
}

/* try all states of two contacts, or of one, from the best so far, or from all held */
static void try_pair(const Run *r, const Problem *problem, ContactBox *o, const int pair[2], Solution *best)
{
    const int numbers = pair[0] == pair[1] ? STATES : STATES * STATES;
    for (int number = 0; number < numbers; number++) {
        signed char fixed[NC] = {0};
        memcpy(o->state, best->state, sizeof o->state);
        keep_state(o, fixed, pair[0], number % STATES);
        if (pair[0] != pair[1]) {
            keep_state(o, fixed, pair[1], number / STATES);
        }
        o->problem.fixed = fixed;
        const int others = contact_box_solve(o, 0);
        o->problem.fixed = NULL;
        if (others) {
            try_states(r, problem, o, best);
        }
    }
}

/* look for other solutions, as long as one is better */
static void try_others(const Run *r, const Problem *problem, ContactBox *o, Solution *best)
{
    int friction[NC];
    int count = 0;
    int better = 1;
    for (int i = 0; i < o->problem.n; i++) {
        if (o->mu[i] > 0.0) {
            friction[count++] = i;
        }
    }
    if (best->found && count > FEW) {
        return;
    }
    for (int pass = 0; better && pass < o->problem.n; pass++) {
        const Solution before = *best;
        for (int i = 0; i < count; i++) {
            for (int e = i; e < (count > FEW ? i + 1 : count); e++) {
                try_pair(r, problem, o, (int[2]){friction[i], friction[e]}, best);
            }
        }
        better = best->found && !(before.found && before.work == best->work);
    }
}

/* the phase that the states of the unknowns say */
static void write_phase(const Problem *problem, const ContactBox *o, ImpactPhase *phase)
{
    memset(phase->held, 0, sizeof phase->held);
    memset(phase->friction, CONTACT_AWAY, sizeof phase->friction);
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        const int friction = model_contact_partner[c];
        phase->held[c] = o->state[o->unknown[c]] == 0;
        if (friction >= 0 && !has_no_load(o, o->unknown[friction])) {
            /* at the lower bound of its force it slips in positive direction */
            phase->friction[friction] = (signed char)-o->state[o->unknown[friction]];
            phase->held[friction] = phase->friction[friction] == CONTACT_STICK;
        }
    }
}

/* the impulses of one phase; 0 if no states fit */
static int solve_phase(const Run *r, const Problem *problem, ImpactPhase *phase, double *impulse)
{
    ContactBox o;
    Solution best = {.found = 0};
    set_impulses(r, problem, &o);
    memset(o.state, 0, sizeof o.state);
    try_states(r, problem, &o, &best);
    try_others(r, problem, &o, &best);
    if (!best.found) {
        return 0;
    }
    memcpy(o.state, best.state, sizeof o.state);
    write_phase(problem, &o, phase);
    contact_impulse(&r->at, &r->scratch, phase, problem->given, problem->target, impulse);
    return 1;
}

/* work of impulses, before they are applied */
static double work_of(const Jets *j, const double *impulse)
{
    double work = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        double after = j->slip[c][0];
        for (int e = 0; e < MODEL_NC; e++) {
            after += j->G[c][e][0] * impulse[e];
        }
        work += 0.5 * impulse[c] * (j->slip[c][0] + after);
    }
    return work;
}

static RunStatus no_solution(Run *r, const Problem *problem)
{
    char names[128];
    run_name_contacts(problem->contact, problem->count, names, sizeof names);
    return run_fail(
        r,
        "no impulses of %s obey the laws of impact and friction at t = %.17g: friction so strong jams them; "
        "lower their coefficients of friction",
        names, r->at.time);
}

RunStatus impact_resolve(Run *r, const signed char *takes_part)
{
    Problem problem = {.count = 0};
    double impulse[NC] = {0.0};
    int poisson = 0;
    r->impact_work = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        if (!takes_part[c]) {
            continue;
        }
        problem.contact[problem.count++] = c;
        problem.speed = fmax(problem.speed, fabs(r->scratch.slip[c][0]));
        poisson |= model_contact_poisson[c];
        if (model_contact_partner[c] >= 0) {
            problem.speed = fmax(problem.speed, fabs(r->scratch.slip[(int)model_contact_partner[c]][0]));
        }
    }
    r->impact_phases = 1 + poisson;
    for (int number = 0; number < r->impact_phases; number++) {
        contact_targets(&r->at, &r->scratch, number, impulse, problem.given, problem.target);
        if (!solve_phase(r, &problem, &r->impact[number], impulse)) {
            return no_solution(r, &problem);
        }
        r->impact_work += work_of(&r->scratch, impulse);
        contact_apply(&r->at, &r->scratch, impulse);
    }
    return RUN_OK;
}
