/* What the parts of the engine share among themselves; the faces see run.h only. */
#ifndef STICKSLIP_ENGINE_H
#define STICKSLIP_ENGINE_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "roots.h"
#include "run.h"

enum { NC = MODEL_ROOM(MODEL_NC) };

#include "kind_real.h"
#include "flow.h"

/* the power of the series variable that is time: 1, or 2 where the series run in the root of time */
static inline int time_power(int rooted) { return rooted ? 2 : 1; }

/* a rigid contact whose force decides, and whose gap is zero */
static inline int contact_is_closed(const Run *r, int c)
{
    return MODEL_IMPACTS > 0 && model_contact_is_impact[c] && r->at.state[c] != CONTACT_AWAY;
}

/* an open rigid contact: until it closes, its gap does nothing */
static inline int contact_is_open(const Run *r, int c)
{
    return MODEL_IMPACTS > 0 && model_contact_is_impact[c] && r->at.state[c] == CONTACT_AWAY;
}

/* taylor.c */
/* fill order k of all series from orders 0..k of t, u, x */
void taylor_field(Run *r, Jets *j, int k);
/* the series of x up to the order given, from r; stops early where the terms vanish within limit; returns the order reached */
int taylor_series(Run *r, Jets *j, int order, double limit);
/* a time over which the states change noticeably: the length of a step of this order; 1 where they do not change at all */
double taylor_time_scale(const Run *r, const Jets *j, int order);
/* the length over which a series keeps a relative tolerance */
double taylor_series_length(const double *x, int order, double tolerance);
/* order that the step tolerance asks for */
int taylor_order(const Run *r);
/* the next step from r, cut at the first fall of an indicator */
RunStatus taylor_step(Run *r, double limit);
/* load r's instant into the first orders of a set of series in time */
void taylor_load(const Run *r, Jets *j);

/* falls.c */
/* the indicator in use in a slot: +1 or -1 for a quantity that must stay of that sign, 0 if the slot has none now */
int falls_indicator(const Run *r, int c, Slot slot);
/* cut a step of length h at the first fall of an indicator and note all that fall there; gaps are exact up to a shorter length */
double falls_cut(Run *r, int order, double h, double exact);

/* placing.c */
/* slip speeds and depths at r's instant, and W and G, in scratch; what follows reads them */
void place_load(Run *r);
void place_load_inertia(Run *r);
int place_at_zero_slip(const Run *r, int c);
/* whether the gap of a rigid contact is zero, but for rounding */
int place_at_wall(const Run *r, int c);
/* a contact of friction that is inside slips as its slip speed says */
signed char place_slipping(const Run *r, int c);
/* a rigid contact leaves its wall, or is not at it */
void place_open(Run *r, int c);
/* friction and stops; marks candidates, and regions at whose end the body rests */
void place_all(Run *r, signed char *candidate, signed char *resting);
void place_others(Run *r, signed char *candidate);
/* the friction of a rigid contact that is closed; marks it if it is at zero slip */
void place_friction(Run *r, int normal, signed char *candidate);
/* a rigid contact; marks it if it rests at its wall; 1 if it runs into it, RUN_ERROR below it */
int place_rigid(Run *r, int c, signed char *candidate);
/* bodies at rest at the end of regions that they would go out of leave them */
RunStatus place_out_of_regions(Run *r, signed char *candidate, const signed char *resting, int *moved);
/* move the coordinates onto the walls of the contacts marked; after place_load and place_load_inertia */
void place_on_walls(Run *r, const signed char *at_walls);
/* closed rigid contacts stay at their walls, whatever rounding adds up to: moves the coordinates and marks the contacts; 1 if any */
int place_closed_on_walls(Run *r, signed char *closed);

/* impact.c */
/* velocities after an impact in which these rigid contacts take part; r->scratch has the rates before it, and then those after it */
RunStatus impact_resolve(Run *r, const signed char *takes_part);
/* whether rigid contact c, which has just bounced, is in the tail of a chatter that ends after `wait`; other: a contact whose chatter
   ends with it, or -1 */
int impact_settles(Run *r, int c, double *wait, int *other);

/* choice.c */
/* the contacts marked may change state: choose, set their known zeros, project; moved: x changed */
RunStatus choice_make(Run *r, const signed char *candidate, const signed char *at_limit, int *moved);

/* events.c */
/* choose the contact states from scratch; moved: x changed */
RunStatus events_reconsider(Run *r, int *moved);
/* resolve the fall of the indicators marked in r->falling */
RunStatus events_transit(Run *r, int *moved);
/* resolve the event that waits at r's instant */
RunStatus events_resolve(Run *r, EventSink sink, void *context);

/* section.c */
/* where the step in use next crosses the section, up to a place, in the variable of its series; -1 if it does not */
double section_next(Run *r, double to);

/* exchange.c */
/* the gaps that nominal values of the coordinates make, where an importer integrates */
void exchange_measure_gaps(Run *r);
/* by how much the indicator of the depth of contact c is shifted for an importer */
double exchange_shift(const Run *r, const Jets *j, int c);
/* the gap of rigid contact c that an importer may mistake for zero */
double exchange_resolution(const Run *r, const Jets *j, int c);

/* run.c */
/* RUN_ERROR with a message if a value is not finite */
RunStatus run_check_finite(Run *r, const char *what, const double *values, int n);
RunStatus run_fail(Run *r, const char *format, ...);
/* their names in quotes, as a list, cut where it does not fit */
void run_name_contacts(const int *contact, int count, char *names, size_t size);

#endif
