/* The matrix behind the forces of held contacts, per kind of number: the one in force where this is included. */
#include "../model/model.h"

#define contact_drag KIND(contact_drag)
#define contact_factor KIND(contact_factor)

/*
 * factor the system of the member contacts from order 0 of G and the capacities; where state (may be NULL) says that
 * the friction of a rigid contact slips, it goes along
 */
void contact_factor(const Point *at, const Jets *j, const signed char *member, const signed char *state, Sticking *s);
/* force of the slipping friction of rigid contact c per force of c, in these states (may be NULL); 0 if it has none that
   slips */
Real contact_drag(const Point *at, const signed char *state, int c);
