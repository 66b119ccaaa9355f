/* Contacts that can be held, as the unknowns of one complementarity problem. */
#pragma once

#include "../model/model.h"
#include "complementarity.h"

/* Lemke's algorithm is for friction of rigid contacts, and for switches that slide */
enum { LEMKE = MODEL_IMPACTS > 0 || MODEL_NQ == 0 || MODEL_YIELDS };

typedef struct {
    int contact[NC]; /* of an unknown */
    int unknown[NC]; /* of a contact, -1: none */
    double G[NC * NC], b[NC], size[NC], lower[NC], upper[NC], mu[NC];
    int partner[NC];
    signed char state[NC];
    double force[NC];
    double room[COMPLEMENTARITY_ROOM(NC)];
    double lemke_room[LEMKE ? LEMKE_ROOM(NC) : 1];
    BoxProblem problem;
} ContactBox;

/* the problem of the first n unknowns, with what part of the magnitudes is zero */
static inline void contact_box_close(ContactBox *o, int n, double tolerance)
{
    o->problem = (BoxProblem){n, o->G, o->b, o->size, o->lower, o->upper, o->mu, o->partner, tolerance, NULL};
}

/* states and forces from the states in the box; 1 if there are any; lemke: also by Lemke's algorithm */
static inline int contact_box_solve(ContactBox *o, int lemke)
{
    return complementarity_solve(&o->problem, o->state, o->force, o->room, LEMKE && lemke ? o->lemke_room : NULL);
}
