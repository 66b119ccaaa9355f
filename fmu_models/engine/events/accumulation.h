/* Events that accumulate at one time. */
#pragma once

#include "../model/run_state.h"

/* note which indicators fall now, since time last moved; 1 if bounds of regions are among all these */
int accumulation_note(Run *r);
/* whether it is time to ask if the body rests where they accumulate */
int accumulation_ends(const Run *r);
/* put the body to rest where its crossings of bounds accumulate; contact states are to be chosen again */
void accumulation_place(Run *r);
/* the same of switches: those that crossed are to slide, where one may rest; 0 if there is none, or not yet */
int accumulation_rest(Run *r);
/* whether events speed up without end; asked once per event of contact c that is no impact */
RunStatus accumulation_check_pace(Run *r, int c);
/* whether time still moves; asked once per instant with events. last: a contact that changed; bounds: as noted */
RunStatus accumulation_check(Run *r, int last, int bounds);
