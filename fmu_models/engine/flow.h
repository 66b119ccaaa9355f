/* What contact.c and flow.c offer, per kind of number. */

/*
 * contact.c: factor the system of the member contacts from order 0 of G and the capacities; where state (may be NULL) says that the
 * friction of a rigid contact slips, it goes along
 */
void contact_factor(const Point *at, const Jets *j, const signed char *member, const signed char *state, Sticking *s);
/* force series at order k of every contact in its present state */
void contact_forces(Point *at, Jets *j, int k);
/* order k of the rate of v[i], contact forces included */
Real contact_rate(const Jets *j, int i, int k);
/* move the velocities by the impulses of the member contacts that bring their slip speed (order 0 of j) to zero; 1 if they moved */
int contact_project(Point *at, Jets *j, const signed char *member);
/* impulses of one phase of an impact, from the rates before it (order 0 of slip), given impulses of contacts that are not held, and
   the rates that held ones have after it */
void contact_impulse(const Point *at, const Jets *j, const ImpactPhase *phase, const Real *given, const Real *target, Real *impulse);
/* what phase number 0 or 1 of an impact starts from; before: the impulses of phase 0 */
void contact_targets(const Point *at, const Jets *j, int number, const Real *before, Real *given, Real *target);
/* velocities, and the rates in order 0 of slip, after the impulses */
void contact_apply(Point *at, Jets *j, const Real *impulse);

/* flow.c: load a point into the first orders of the series */
void flow_load(const Point *at, Jets *j, int rooted);
/* order k of all series but the states, from orders 0..k of the states */
void flow_field(Point *at, Jets *j, int k, int rooted);
/* order n of the states from their rates: x' = rate in time, x' = 2 s rate in its root */
void flow_extend(Jets *j, int n, int rooted);
/* what the search for events reads of the last order */
void flow_finish(const Point *at, Jets *j, int order);
/* all of it to an order, in time and in the root of time */
void flow_series(Point *at, Jets *j, int order);
void flow_rooted_series(Point *at, Jets *j, int order);
/* the release indicators of touching and released stops up to an order */
void flow_releases(const Point *at, Jets *j, int order);
