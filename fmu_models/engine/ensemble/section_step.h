/* One step of a section: from one meeting with it to the next. */
#pragma once

#include "../tangents/tangent.h"
#include "../model/run_state.h"
#include "request.h"

/* what is known of a motion on its way */
typedef struct {
    const Ensemble *e;
    int64_t run;
    int state;                /* of the section */
    double since;             /* time of the last meeting */
    int met;                  /* the event that makes the section came */
    int crossed;              /* the last step ended where the state crosses the level */
    int losing;               /* a contact was closed or stuck: differences may have been lost */
    double contact_since[NC]; /* from when on it is held */
    double held[NC];          /* time in contact or stick since the last row, and how often that began */
    int32_t began[NC];
} Walk;

/* numbers of an extended direction: states, memories, time */
enum { EXTENDED = MODEL_NX + MODEL_NC + 1 };

/* an event on the way; context: a Walk */
void section_step_note(void *context, const ContactEvent *event);
void section_step_start(const Run *r, Walk *w);
/* to the next meeting; OUTCOME_FINISHED if there is one */
Outcome section_step(Run *r, Walk *w);
/* the same with tangents along directions[k * EXTENDED + i], which are replaced by their derivatives; grown: NULL, or
   factors by which they have grown already where they had to be set at right angles on the way */
Outcome section_step_tangents(Run *r, Walk *w, Tangents *tangents, int n, double *directions, double *grown);
/* time in contact up to now, for a row */
void section_step_close_row(const signed char *state, double time, Walk *w);
