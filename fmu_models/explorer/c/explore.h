/* What a page, and its twin in a program, calls; the numbers are read there from here. */
#pragma once

#include "explore_period.h" /* generated: EXPLORE_PERIOD, of the forcing by p and d, s; 0.0: nothing forces the motion */

#if defined(__wasm__)
#define EXPLORE_EXPORT(name) __attribute__((export_name(#name)))
#elif defined(_WIN32)
#define EXPLORE_EXPORT(name) __declspec(dllexport)
#else
#define EXPLORE_EXPORT(name) __attribute__((visibility("default")))
#endif

/* sizes, buffers and counts; values are parameters, inputs, rates of the inputs, states and memories (speeds at which
   stops were entered); a row or crossing holds the time, states, memories, outputs and states of contacts */
typedef enum {
    EXPLORE_PARAMETERS = 0,
    EXPLORE_INPUTS = 1,
    EXPLORE_STATES = 2,
    EXPLORE_OUTPUTS = 3,
    EXPLORE_CONTACTS = 4,
    EXPLORE_VALUES = 5,
    EXPLORE_TIMES = 6,
    EXPLORE_ROWS = 7,
    EXPLORE_CROSSINGS = 8,
    EXPLORE_EVENTS = 9,
    EXPLORE_MESSAGE = 10,
    EXPLORE_COLUMNS = 11,
    EXPLORE_EVENT_BYTES = 12,
    EXPLORE_STEPS = 13
} Explored;

EXPLORE_EXPORT(explore_size) int explore_size(int what);
EXPLORE_EXPORT(explore_buffer) void *explore_buffer(int what);
/* 0, or 2: refused, and the message says why */
EXPLORE_EXPORT(explore_start) int explore_start(double tolerance);
/* rows at the first so many of the times, and crossings of a level by a state; -1 for none */
EXPLORE_EXPORT(explore_ask) void explore_ask(int n_times, int crossing_state, double level, int direction);
/* 0: done, 1: more to come, 2: refused; rows are counted from the beginning, events and crossings are new ones */
EXPLORE_EXPORT(explore_continue) int explore_continue(int allowance);
EXPLORE_EXPORT(explore_count) int explore_count(int what);
EXPLORE_EXPORT(explore_period) double explore_period(void);
