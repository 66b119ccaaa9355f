/* Where contacts are at one instant, and coordinates at walls. */
#pragma once

#include "../model/run_state.h"

/* slip speeds and depths at r's instant, and W and G, in scratch; what follows reads them */
void placement_load(Run *r);
void placement_load_inertia(Run *r);
int placement_at_zero_slip(const Run *r, int c);
/* before values are set: the slip speeds, of which only what the new values make is more than rounding where it sticks */
void placement_note_slips(Run *r);
/* whether a contact is at rest only since one that is held has the same motion: its speed is the rounding of that one's */
int placement_at_rest_by_others(const Run *r, int c);
/* whether forces of contact c move anything: its lever is more than the rounding of the place where it vanishes */
int placement_has_lever(const Run *r, int c);
/* whether the gap of a rigid contact is zero, but for rounding, that of start values, and where an importer lands */
int placement_at_wall(Run *r, int c);
/* a contact of friction that is inside slips as its slip speed says */
signed char placement_slipping(const Run *r, int c);
/* the side to which a switch that may rest leaves zero; stick where its function has no rate either */
signed char placement_leaving(Run *r, int c);
/* a rigid contact leaves its wall, or is not at it */
void placement_open(Run *r, int c);
/* a stop is entered at its bound */
void placement_enter(Run *r, int c);
/* friction and stops; marks candidates, and regions at whose end the body rests */
void placement_all(Run *r, signed char *candidate, signed char *resting);
void placement_others(Run *r, signed char *candidate);
/* the friction of a rigid contact that is closed; marks it if it is at zero slip */
void placement_friction(Run *r, int normal, signed char *candidate);
/*
 * Whether a gap that falls to zero only touches it, to within rounding, where its lever vanishes too: as that of a crank
 * whose slider just reaches a wall at its dead centre. What rounding leaves of its speed would stop the crank.
 */
int placement_touches(Run *r, int c);
/* a rigid contact; marks it if it rests at its wall; 1 if it runs into it, RUN_ERROR below it */
int placement_rigid(Run *r, int c, signed char *candidate);
/* move the coordinates onto the walls of the contacts marked; after placement_load and placement_load_inertia */
void placement_on_walls(Run *r, const signed char *at_walls);
/* closed rigid contacts stay at their walls, whatever rounding adds up to: moves the coordinates and marks the
   contacts; 1 if any */
int placement_closed_on_walls(Run *r, signed char *closed);
/* array c: the element that is next is at its bound */
void placement_hold_next(Run *r, int c);
/* elements of arrays: those at or beyond the bound that their way goes to are held there, all others free */
void placement_elements(Run *r, int *moved);
