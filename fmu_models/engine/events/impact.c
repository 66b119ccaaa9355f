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
 *               taken, of equal ones the one with most contacts held, of those the one with the least impulses. Others
 *               are looked for from every state of each contact with friction, and of each two, kept while the others
 *               are solved for; of more than FEW contacts with friction the first solution stands.
 *     none:     an error that names the contacts.
 *
 * Newton's restitution with friction can gain energy; work says so. Poisson's of one coefficient cannot.
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
    double speed; /* largest rate, each in terms of what a unit of impulse makes of it */
} Problem;

/* a solution, or none yet */
typedef struct {
    int found;
    int lawful; /* redundant contacts share by least norm, which may be more than one of them can give */
    int held;
    double work;
    double load; /* sum of the squares of the impulses, each in terms of what it moves */
    signed char state[NC];
    ImpactPhase phase;
    double impulse[NC];
} Solution;

/* the speed of the impact, in the unit of the rate of unknown i */
static double speed_of(const Problem *problem, const ContactBox *o, int i)
{
    return problem->speed * sqrt(fmax(o->G[i * o->problem.n + i], 0.0));
}

/* unknown: impulse of contact c, or of its friction, if normal is not -1 */
static void add_impulse(const Run *r, const Problem *problem, ContactBox *o, int i, int c, int normal)
{
    o->contact[i] = c;
    o->unknown[c] = i;
    o->b[i] = r->scratch.slip[c][0] - (normal < 0 ? problem->target[c] : 0.0);
    o->lower[i] = normal < 0 ? problem->given[c] : 0.0;
    o->upper[i] = normal < 0 ? INFINITY : 0.0;
    o->mu[i] = normal < 0 ? 0.0 : model_friction(r->at.p, r->at.d, c);
    o->partner[i] = normal < 0 ? -1 : o->unknown[normal];
}

/* coarser: all rates are zero that are so beside the speed of the impact, not beside its rounding */
static void set_impulses(const Run *r, const Problem *problem, int coarser, ContactBox *o)
{
    const double ROUNDINGS = 64.0;
    const double floor = coarser ? 1.0 : ROUNDINGS * DBL_EPSILON / r->tolerances.margin;
    int n = 0;
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        add_impulse(r, problem, o, n++, c, -1);
        if (model_contact_partner[c] >= 0) add_impulse(r, problem, o, n++, model_contact_partner[c], c);
    }
    contact_box_close(o, n, r->tolerances.margin);
    for (int i = 0; i < n; i++) {
        for (int e = 0; e < n; e++)
            o->G[i * n + e] = r->scratch.G[o->contact[i]][o->contact[e]][0];
        o->size[i] = fabs(o->b[i]) + floor * speed_of(problem, o, i);
    }
}

/* whether friction i has nothing to rub with: its contact stays open */
static int has_no_load(const ContactBox *o, int i)
{
    return o->partner[i] >= 0 && o->state[o->partner[i]] != 0 && o->lower[o->partner[i]] == 0.0;
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

/* whether the rates after the impulses are those of the states; their work and load */
static int rates_fit(const Run *r, const Problem *problem, const ContactBox *o, Solution *s)
{
    s->work = s->load = 0.0;
    for (int i = 0; i < o->problem.n; i++) {
        const int c = o->contact[i];
        double change = 0.0;
        for (int e = 0; e < o->problem.n; e++)
            change += o->G[i * o->problem.n + e] * s->impulse[o->contact[e]];
        const double rate = o->b[i] + change;
        const double zero = r->tolerances.margin * speed_of(problem, o, i);
        s->load += o->G[i * o->problem.n + i] * s->impulse[c] * s->impulse[c];
        s->work += s->impulse[c] * (r->scratch.slip[c][0] + 0.5 * change);
        /* not a number fits nowhere */
        if (!(o->state[i] == 0 ? fabs(rate) <= zero : has_no_load(o, i) || -o->state[i] * rate >= -zero)) return 0;
    }
    return 1;
}

/* whether held contacts push by no less than given, and sticking ones by no more than their friction */
static int impulses_fit(const Run *r, const Problem *problem, const ContactBox *o, const Solution *s)
{
    double largest = 0.0;
    for (int i = 0; i < o->problem.n; i++)
        largest = fmax(largest, fabs(s->impulse[o->contact[i]]));
    const double zero = r->tolerances.margin * largest;
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        const int friction = model_contact_partner[c];
        if (s->impulse[c] < problem->given[c] - zero) return 0;
        if (friction >= 0 && s->phase.friction[friction] == CONTACT_STICK
            && fabs(s->impulse[friction]) > o->mu[o->unknown[friction]] * s->impulse[c] + zero) {
            return 0;
        }
    }
    return 1;
}

/* whether one solution comes before another */
static int is_better(const Run *r, const Solution *s, const Solution *best)
{
    const double even = r->tolerances.margin * fabs(best->work);
    if (!best->found || s->lawful != best->lawful) return !best->found || s->lawful;
    if (fabs(s->work - best->work) > even) return s->work < best->work;
    return s->held != best->held ? s->held > best->held : s->load < (1.0 - r->tolerances.margin) * best->load;
}

/* take the states in the box, if they are a solution better than the best; solved: they obey the laws, if redundant
   contacts may share otherwise than by least norm */
static void take_states(const Run *r, const Problem *problem, const ContactBox *o, int solved, Solution *best)
{
    Solution s = {.found = 1};
    write_phase(problem, o, &s.phase);
    contact_impulse(&r->at, &r->scratch, &s.phase, problem->given, problem->target, s.impulse);
    if (!rates_fit(r, problem, o, &s)) return;
    for (int c = 0; c < MODEL_NC; c++)
        s.held += s.phase.held[c];
    s.lawful = impulses_fit(r, problem, o, &s);
    if (solved && !s.lawful) {
        for (int i = 0; i < o->problem.n; i++)
            s.impulse[o->contact[i]] = o->force[i];
        if (!rates_fit(r, problem, o, &s)) return;
    }
    memcpy(s.state, o->state, sizeof s.state);
    if ((solved || s.lawful) && is_better(r, &s, best)) *best = s;
}

/* state number of friction i and its contact, kept while the others are solved for */
static void keep_state(ContactBox *o, signed char *fixed, int i, int number)
{
    const int normal = o->partner[i];
    o->state[normal] = (signed char)(number < 3 ? 0 : -1);
    o->state[i] = (signed char)(has_no_load(o, i) ? -1 : number % 3 - 1);
    fixed[normal] = fixed[i] = 1;
}

/* try all states of some frictions and their contacts, from the best so far, or from all held */
static void try_fixed(const Run *r, const Problem *problem, ContactBox *o, const int *friction, int count,
                      Solution *best)
{
    int numbers = 1;
    for (int k = 0; k < count; k++)
        numbers *= STATES;
    for (int number = 0; number < numbers; number++) {
        signed char fixed[NC] = {0};
        memcpy(o->state, best->state, sizeof o->state);
        for (int k = 0, rest = number; k < count; k++, rest /= STATES)
            keep_state(o, fixed, friction[k], rest % STATES);
        o->problem.fixed = fixed;
        const int others = contact_box_solve(o, 0);
        o->problem.fixed = NULL;
        if (others) {
            take_states(r, problem, o, 0, best);
            if (contact_box_solve(o, !best->found)) take_states(r, problem, o, 1, best);
        }
    }
}

/* whether the impulse of one contact with friction moves another */
static int meets(const ContactBox *o, int i, int e)
{
    const int n = o->problem.n;
    return o->G[i * n + e] != 0.0 || o->G[o->partner[i] * n + e] != 0.0 || o->G[i * n + o->partner[e]] != 0.0
           || o->G[o->partner[i] * n + o->partner[e]] != 0.0;
}

/* look for other solutions, as long as one is better */
static void try_others(const Run *r, const Problem *problem, ContactBox *o, Solution *best)
{
    int friction[NC], count = 0, better = 1;
    for (int i = 0; i < o->problem.n; i++)
        if (o->mu[i] > 0.0) friction[count++] = i;
    if (best->found && best->lawful && count > FEW) return;
    for (int pass = 0; better && pass < o->problem.n; pass++) {
        const Solution before = *best;
        for (int i = 0; i < count; i++) {
            try_fixed(r, problem, o, friction + i, 1, best);
            for (int e = i + 1; e < NC && e < (count > FEW ? 0 : count); e++)
                if (meets(o, friction[i], friction[e]))
                    try_fixed(r, problem, o, (int[2]){friction[i], friction[e]}, 2, best);
        }
        better = best->found && is_better(r, best, &before);
    }
}

/* the impulses of one phase; 0 if no states fit */
static int solve_phase(const Run *r, const Problem *problem, ImpactPhase *phase, double *impulse, double *work)
{
    ContactBox o;
    Solution best = {.found = 0};
    for (int coarser = 0; !best.found && coarser < 2; coarser++) {
        set_impulses(r, problem, coarser, &o);
        memset(o.state, 0, sizeof o.state);
        if (o.problem.n == 1) take_states(r, problem, &o, 0, &best); /* held, if it may be: nothing is to be chosen */
        if (best.found) break;
        if (contact_box_solve(&o, 1)) take_states(r, problem, &o, 1, &best);
        try_others(r, problem, &o, &best);
    }
    if (!best.found) return 0;
    *work = best.work;
    *phase = best.phase;
    memcpy(impulse, best.impulse, sizeof best.impulse);
    return 1;
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
    memset(r->impulse, 0, sizeof r->impulse);
    for (int c = 0; c < MODEL_NC; c++) {
        if (!takes_part[c]) continue;
        problem.contact[problem.count++] = c;
        poisson |= model_contact_poisson[c];
        for (int e = c; e >= 0; e = e == c ? model_contact_partner[c] : -1) {
            const double own = r->scratch.G[e][e][0];
            problem.speed = own > 0.0 ? fmax(problem.speed, fabs(r->scratch.slip[e][0]) / sqrt(own)) : problem.speed;
        }
    }
    r->impact_phases = 1 + poisson;
    for (int number = 0; number < r->impact_phases; number++) {
        contact_targets(&r->at, &r->scratch, number, impulse, problem.given, problem.target);
        double work;
        if (!solve_phase(r, &problem, &r->impact[number], impulse, &work)) return no_solution(r, &problem);
        r->impact_work += work;
        contact_apply(&r->at, &r->scratch, impulse);
        for (int c = 0; c < MODEL_NC; c++)
            r->impulse[c] += impulse[c];
    }
    return RUN_OK;
}
