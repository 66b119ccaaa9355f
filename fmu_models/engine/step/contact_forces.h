/* Forces and impulses of contacts, per kind of number: the one in force where this is included (model/scalar.h). */
#include "cone_forces.h"
#include "contact_factor.h"

#define contact_forces KIND(contact_forces)
#define contact_rate KIND(contact_rate)
#define contact_rest_rate KIND(contact_rest_rate)
#define contact_project KIND(contact_project)
#define contact_impulse KIND(contact_impulse)
#define contact_targets KIND(contact_targets)
#define contact_apply KIND(contact_apply)

/* force series at order k of every contact in its present state */
void contact_forces(Point *at, Jets *j, int k);
/* order k of the rate of v[i], contact forces included */
Real contact_rate(const Jets *j, int i, int k);
/* the rate of y of contact c, which may rest; j holds order 0 of the rates */
Real contact_rest_rate(const Point *at, Jets *j, int c);
/* move the velocities by the impulses of the member contacts that bring their slip speed (order 0 of j) to zero, with
   the friction that slips in these states (NULL: without); 1 if they moved */
int contact_project(Point *at, Jets *j, const signed char *member, const signed char *state);
/* impulses of one phase of an impact, from the rates before it (order 0 of slip), given impulses of contacts that are
   not held, and the rates that held ones have after it */
void contact_impulse(const Point *at, const Jets *j, const ImpactPhase *phase, const Real *given, const Real *target,
                     Real *impulse);
/* what phase number 0 or 1 of an impact starts from; before: the impulses of phase 0 */
void contact_targets(const Point *at, const Jets *j, int number, const Real *before, Real *given, Real *target);
/* velocities, and the rates in order 0 of slip, after the impulses */
void contact_apply(Point *at, Jets *j, const Real *impulse);
