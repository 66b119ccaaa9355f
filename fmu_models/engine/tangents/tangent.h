/* Derivatives of a motion along directions in start state, parameters and inputs (tangent.c). */
#pragma once

#include <stddef.h>

#include "../model/run_state.h"

typedef struct Tangents Tangents;
/* an input: a constant added to it; a memory: by the contact that has it */
typedef enum { ALONG_STATE, ALONG_PARAMETER, ALONG_INPUT, ALONG_MEMORY } Along;

/* bytes that n tangents need */
size_t tangents_room(int n);
/* n tangents, along nothing yet, in that room; r has its start values and is not initialized */
Tangents *tangents_start(void *room, const Run *r, int n);
/* let tangent k be along a state, parameter, input or memory */
void tangents_along(Tangents *tangents, int k, Along what, int index);
/* after run_initialize, and after run_reconsider with other inputs: repeat what it chose */
void tangents_choose(const Run *r, Tangents *tangents);
/* the tangents at the very time of the run: an event just passed came earlier or later for them */
void tangents_hold(Tangents *tangents);
/* tangent k from the present point of the run on, along a direction of states, memories of contacts, and time
   (MODEL_NX + MODEL_NC + 1 numbers), and the direction that it has come to */
void tangents_place(const Run *r, Tangents *tangents, int k, const double *direction);
void tangents_read(const Tangents *tangents, int k, double *direction);
/* tangents that have been placed lose what would move contacts that are held, as where a motion starts there */
void tangents_begin_held(Run *r, Tangents *tangents);
/* a step from r towards a time, where there is none in use; until: how far the tangents may be evaluated at or moved by
   it */
RunStatus tangents_expand(Run *r, Tangents *tangents, double end, double *until);
/* move run and tangents that far and resolve the event that waits there; RUN_ERROR also where the motion has no
   derivative */
RunStatus tangents_move(Run *r, Tangents *tangents, double end, EventSink sink, void *context);
/* tangents on whose way several events came at one instant, but not for neighbours: their derivatives are one-sided */
int tangents_corners(const Tangents *tangents);
/* derivative of the time of the last event, s per unit; NAN if it has no indicator (the end of a chatter) */
double tangents_event(const Tangents *tangents, int k);
/* the speed at which the indicator of the last event fell, in its unit per second, and the derivative of that; NAN as
   above */
double tangents_event_speed(const Tangents *tangents, int k, double *derivative);
