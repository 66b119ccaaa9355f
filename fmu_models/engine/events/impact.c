/*
 * Impacts of rigid contacts: the velocities after one, and the end of a chatter of infinitely many.
 *
 *     impact:   gamma = rates of the gaps, and slip speeds; gamma+ = gamma- + G Lambda
 *               Newton    Lambda_N >= 0,             gamma_N+ >= -e gamma_N-,   one of them an equality; gamma_T by
 *                         Coulomb's law
 *               Poisson   compression: Lambda_N >= 0,  gamma_N >= 0,    one of them an equality
 *                         expansion:   Lambda_N >= e Lambda_N of compression,  gamma_N+ >= 0,  one of them an equality
 *               Coulomb   |Lambda_T| <= mu Lambda_N; gamma_T+ = 0 where smaller, else Lambda_T against gamma_T+
 *               All contacts at their wall take part, closed ones too. All assignments {no impulse, slip+, slip-,
 *               stick} are tried; of several solutions the one that loses most energy is taken, of equal ones the one
 *               with most contacts held.
 *               None: an error that names the contacts.
 *     chatter:  after an impact with speed w+ off a wall that is approached with the acceleration P (P' its rate), the
 *               bounces end after   2 u / P - (4/3) P' u^2 / P^3,   u = w+ / (1 - e).
 *               From the bounce on at which w+ is below `chatter` of the fastest, the contact is held and the end of
 *               the bounces is an event.
 *
 * Newton's restitution with friction can gain energy; work says so. Poisson's cannot.
 *
 * Sources: Glocker and Pfeiffer, Multiple impacts with friction in rigid multibody systems, Nonlinear Dynamics 7
 *          (1995).
 */
#include "impact.h"

#include "../step/contact_forces.h"
#include "../step/roots.h"
#include "../step/taylor.h"
#include "gap_tolerance.h"

typedef struct {
    int count;
    int contact[NC]; /* rigid contacts that take part */
    int choices[NC]; /* assignments of each */
    Real given[NC], target[NC];
    double speed; /* scale of the rates */
} Problem;

/* the tangential state of choice 0, 1, 2: most held first */
static signed char friction_state(int choice)
{
    return choice == 0 ? CONTACT_STICK : choice == 1 ? CONTACT_SLIP_PLUS : CONTACT_SLIP_MINUS;
}

/* write assignment number code into a phase; the number of held contacts */
static int write_phase(const Problem *problem, long code, ImpactPhase *phase)
{
    int held = 0;
    memset(phase->held, 0, sizeof phase->held);
    memset(phase->friction, CONTACT_AWAY, sizeof phase->friction);
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        const int friction = model_contact_partner[c];
        const int choice = (int)(code % problem->choices[i]);
        const int tangential = friction < 0 ? 1 : 3;
        code /= problem->choices[i];
        phase->held[c] = choice < tangential;
        held += phase->held[c];
        if (friction >= 0 && (phase->held[c] || problem->given[c] > 0.0)) {
            phase->friction[friction] = friction_state(choice % 3);
            phase->held[friction] = phase->friction[friction] == CONTACT_STICK;
            held += phase->held[friction];
        }
    }
    return held;
}

/* whether impulses and the rates after them obey the laws of the assignment; work: of the impulses */
static int phase_holds(const Run *r, const Problem *problem, const ImpactPhase *phase, const double *impulse,
                       double *work)
{
    const Jets *j = &r->scratch;
    const double tolerance = r->tolerances.margin;
    double after[NC];
    double largest = 0.0;
    *work = 0.0;
    for (int c = 0; c < MODEL_NC; c++) {
        after[c] = j->slip[c][0];
        for (int e = 0; e < MODEL_NC; e++) {
            after[c] += j->G[c][e][0] * impulse[e];
        }
        *work += 0.5 * impulse[c] * (j->slip[c][0] + after[c]);
        largest = fmax(largest, fabs(impulse[c]));
    }
    const double speed = tolerance * problem->speed;
    for (int i = 0; i < problem->count; i++) {
        const int c = problem->contact[i];
        const int friction = model_contact_partner[c];
        /* more contacts than the motion has directions cannot all be held: their equations have no solution */
        if (phase->held[c] && !(fabs(after[c] - problem->target[c]) <= speed)) {
            return 0;
        }
        /* not a number holds nowhere */
        if (!(phase->held[c] ? impulse[c] - problem->given[c] >= -tolerance * largest
                             : after[c] - problem->target[c] >= -speed)) {
            return 0;
        }
        if (friction < 0 || phase->friction[friction] == CONTACT_AWAY) {
            continue;
        }
        const double limit = model_friction(r->at.p, r->at.d, friction) * impulse[c];
        const double sign = phase->friction[friction] == CONTACT_SLIP_PLUS ? 1.0 : -1.0;
        if (!(phase->friction[friction] == CONTACT_STICK
                  ? fabs(impulse[friction]) <= limit + tolerance * largest && fabs(after[friction]) <= speed
                  : sign * after[friction] >= -speed)) {
            return 0;
        }
    }
    return 1;
}

/* the impulses of one phase; 0 if no assignment fits */
static int solve_phase(const Run *r, const Problem *problem, ImpactPhase *best, double *impulse, double *work)
{
    long codes = 1;
    int found = 0;
    int most = -1;
    for (int i = 0; i < problem->count; i++) {
        codes *= problem->choices[i];
    }
    for (long code = 0; code < codes; code++) {
        ImpactPhase phase;
        double trial[NC];
        double trial_work;
        const int held = write_phase(problem, code, &phase);
        contact_impulse(&r->at, &r->scratch, &phase, problem->given, problem->target, trial);
        if (!phase_holds(r, problem, &phase, trial, &trial_work)) {
            continue;
        }
        const double even = r->tolerances.margin * fabs(*work);
        if (!found || trial_work < *work - even || (trial_work <= *work + even && held > most)) {
            *best = phase;
            *work = trial_work;
            memcpy(impulse, trial, sizeof trial);
            most = held;
            found = 1;
        }
    }
    return found;
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
        double work = 0.0;
        contact_targets(&r->at, &r->scratch, number, impulse, problem.given, problem.target);
        for (int i = 0; i < problem.count; i++) {
            const int c = problem.contact[i];
            problem.choices[i] = model_contact_partner[c] < 0 ? 2 : problem.given[c] > 0.0 ? 6 : 4;
        }
        if (!solve_phase(r, &problem, &r->impact[number], impulse, &work)) {
            return no_solution(r, &problem);
        }
        contact_apply(&r->at, &r->scratch, impulse);
        r->impact_work += work;
        for (int c = 0; c < MODEL_NC; c++) {
            r->impulse[c] += impulse[c];
        }
    }
    return RUN_OK;
}

/* whether another open contact that feels c reaches its wall within a time; tail: it too is in the tail of a chatter */
static int disturbed(const Run *r, int c, double wait, int *tail)
{
    enum { ORDER = 4 };
    const Jets *j = &r->scratch;
    *tail = -1;
    for (int e = 0; e < MODEL_NC; e++) {
        if (e == c || !model_contact_is_impact[e] || r->at.state[e] != CONTACT_AWAY || j->G[c][e][0] == 0.0) {
            continue;
        }
        double gap[ORDER + 1];
        const int known = r->at.known[e][SLOT_NORMAL] < ORDER ? r->at.known[e][SLOT_NORMAL] : ORDER;
        for (int k = known; k <= ORDER; k++) {
            gap[k - known] = -j->depth[e][k];
        }
        if (first_fall(gap, ORDER - known, wait) >= 0.0) {
            if (!(fabs(j->slip[e][0]) <= r->tolerances.chatter * r->at.memory[e])) {
                return 1;
            }
            *tail = e;
        }
    }
    return 0;
}

int impact_settles(Run *r, int c, double *wait, int *other)
{
    enum { ORDER = 4 };
    /* of the second term of the sum to the first: its square bounds what the series leaves out */
    const double SLOW = 1e-2;
    Jets *j = &r->scratch;
    const double e = model_restitution(r->at.p, r->at.d, c);
    const double speed = j->slip[c][0];
    const int slow = speed <= r->tolerances.chatter * r->at.memory[c];
    if (!(e < 1.0) || !(slow || r->tolerances.drift > 0.0)) {
        return 0;
    }
    taylor_series(r, j, ORDER, INFINITY);
    const double P = 2.0 * j->depth[c][2];
    const double rate = 6.0 * j->depth[c][3];
    const double u = speed / (1.0 - e);
    /* an importer cannot follow bounces lower than its own errors */
    if (!slow && !(speed * speed <= 2.0 * P * gap_resolution(r, j, c))) {
        return 0;
    }
    if (!(P > 0.0) || !(u * fabs(rate) <= SLOW * P * P)) {
        return 0;
    }
    *wait = 2.0 * u / P - 4.0 / 3.0 * rate * u * u / (P * P * P);
    return !disturbed(r, c, *wait, other);
}
