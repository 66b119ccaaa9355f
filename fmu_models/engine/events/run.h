/* A run from event to event; the FMI interfaces and whole runs are thin layers over these calls. */
#pragma once

#include "../model/run_state.h"

/* choose the contact states for the state x at r->time from scratch; RUN_ERROR with message if p or x is unusable */
RunStatus run_initialize(Run *r);
/* after a jump to another point of a motion, whose contact states are known: what the run watches begins there */
void run_resume(Run *r);
/* inputs may have jumped: choose again for contacts at zero slip or with a violated stick; changed (may be NULL): x
   moved */
RunStatus run_reconsider(Run *r, int *changed);

/*
 * Move to time t with events handled inside. With stop_at_event, return RUN_EVENT right after the first change of a
 * contact state; r->time says where. sink (may be NULL) gets every change of contact state. With a section watched,
 * return RUN_CROSSING at each of its crossings; with pause_at set, RUN_PAUSED once so many steps are made, to be called
 * again.
 */
RunStatus run_advance(Run *r, double t, int stop_at_event, EventSink sink, void *context);

RunStatus run_outputs(Run *r, double *y); /* MODEL_NY */
/* derivatives in time of one order of states, their rates and outputs */
typedef struct {
    double states[MODEL_ROOM(MODEL_NX)], rates[MODEL_ROOM(MODEL_NX)], outputs[MODEL_ROOM(MODEL_NY)];
} TimeDerivatives;

/* those of some order, below MODEL_MAX_ORDER, in the present contact states */
void run_time_derivatives(Run *r, int order, TimeDerivatives *found);

/* the parts of an advance, for derivatives that are carried along */
/* whether the run will come to its end in hours */
RunStatus run_check_pace(Run *r);
/* how far a step may reach on the way to a time */
double run_step_limit(const Run *r, double end);
/* the time at the end of the segment, and what rounding takes from it */
double run_segment_end(const Run *r, double *rest);
/* go to the end of the segment, or to a time inside it */
void run_finish_segment(Run *r);
void run_move_inside(Run *r, double time, double since_start);
/* contacts that stick, slide or are closed are without slip, whatever rounding adds up to from step to step */
RunStatus run_keep_without_slip(Run *r);
