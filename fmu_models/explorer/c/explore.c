/*
 * The engine in a page: one instance, and the buffers through which a page and it talk, at addresses that it asks for.
 *
 *     write explore_values, explore_start(tolerance)      a motion from these values at time zero
 *     write explore_times, explore_ask(n, ...)            what to record of it, from where the last request ended
 *     until explore_continue(allowance) is not MORE       so many steps at once; read the rows, events and crossings
 *                                                         of each part before the next
 *
 * Nothing is allocated after the first start, and nothing that a page writes can reach beyond the buffers: counts are
 * held to their room.
 */
#include "explore.h"

#include <string.h>

#include "../../engine/fmi/variables.h"
#include "../../engine/whole_run/whole_run.h"

enum {
    ROWS = 8192,
    CROSSINGS = 256,
    MOST_ITERATIONS = 1000, /* of an instant, per contact: Tolerances */
    EVENTS = 2048 + MOST_ITERATIONS * NC,
    COLUMNS = 1 + MODEL_NX + MODEL_NC + MODEL_NY + MODEL_NC,          /* at most: not every contact has a memory */
    SETTABLE = MODEL_NP + 2 * MODEL_SET_INPUTS + MODEL_NX + MODEL_NC, /* the same */
    FIRST_SETTABLE = 2                                                /* reference of the first parameter; time is 1 */
};

static struct {
    void *instance;
    char message[WHOLE_RUN_MESSAGE];
    double values[SETTABLE], times[ROWS], rows[ROWS * COLUMNS], crossings[CROSSINGS * COLUMNS];
    uint32_t settable[SETTABLE], columns[COLUMNS];
    ContactEvent events[EVENTS];
    WholeRun run;
} page;

static int settable_count(void) { return SETTABLE - MODEL_NC + variables_memory_contact(MODEL_NC); }

static int memory_count(void) { return variables_memory_contact(MODEL_NC); }

static int column_count(void) { return COLUMNS - MODEL_NC + memory_count(); }

/* references of the first values of their kinds, one after the other; derivatives of the states are left out */
static void list_columns(void)
{
    const uint32_t states = FIRST_SETTABLE + MODEL_NP + 2 * MODEL_SET_INPUTS,
                   kept = MODEL_NX + (uint32_t)memory_count();
    const uint32_t outputs = states + kept + MODEL_NX;
    uint32_t *column = page.columns;
    *column++ = 1; /* the time */
    for (uint32_t i = 0; i < kept; i++)
        *column++ = states + i;
    for (uint32_t i = 0; i < MODEL_NY + MODEL_NC; i++)
        *column++ = outputs + i;
    for (uint32_t i = 0; i < SETTABLE; i++)
        page.settable[i] = FIRST_SETTABLE + i;
}

int explore_size(int what)
{
    switch (what) {
    case EXPLORE_PARAMETERS: return MODEL_NP;
    case EXPLORE_INPUTS: return MODEL_SET_INPUTS;
    case EXPLORE_STATES: return MODEL_NX;
    case EXPLORE_OUTPUTS: return MODEL_NY;
    case EXPLORE_CONTACTS: return MODEL_NC;
    case EXPLORE_VALUES: return settable_count();
    case EXPLORE_COLUMNS: return column_count();
    case EXPLORE_ROWS: return ROWS;
    case EXPLORE_CROSSINGS: return CROSSINGS;
    case EXPLORE_EVENT_BYTES: return (int)sizeof(ContactEvent);
    default: return 0;
    }
}

void *explore_buffer(int what)
{
    switch (what) {
    case EXPLORE_VALUES: return page.values;
    case EXPLORE_TIMES: return page.times;
    case EXPLORE_ROWS: return page.rows;
    case EXPLORE_CROSSINGS: return page.crossings;
    case EXPLORE_EVENTS: return page.events;
    case EXPLORE_MESSAGE: return page.message;
    default: return NULL;
    }
}

int explore_start(double tolerance)
{
    page.message[0] = 0;
    if (!page.instance) {
        list_columns();
        page.instance = stickslip_open(page.message);
        if (!page.instance) return WHOLE_RUN_ERROR;
    }
    const RunStart start = {settable_count(), page.settable, page.values, 0.0, tolerance};
    return stickslip_restart(page.instance, &start);
}

void explore_ask(int n_times, int crossing_state, double level, int direction)
{
    memset(&page.run, 0, sizeof page.run);
    page.run.n_times = n_times < 0 ? 0 : n_times < ROWS ? n_times : ROWS;
    page.run.times = page.times;
    page.run.n_values = column_count();
    page.run.references = page.columns;
    page.run.values = page.rows;
    page.run.event_capacity = EVENTS;
    page.run.events = page.events;
    page.run.crossings = page.crossings;
    if (crossing_state >= 0 && crossing_state < MODEL_NX) {
        page.run.crossing_capacity = CROSSINGS;
        page.run.crossing_state = (uint32_t)(FIRST_SETTABLE + MODEL_NP + 2 * MODEL_SET_INPUTS + crossing_state);
        page.run.level = level;
        page.run.direction = direction;
    }
}

int explore_continue(int allowance)
{
    if (!page.instance) return WHOLE_RUN_ERROR;
    page.message[0] = 0;
    page.run.n_events = page.run.n_crossings = 0;
    page.run.allowance = allowance;
    return stickslip_simulate(page.instance, &page.run);
}

int explore_count(int what)
{
    switch (what) {
    case EXPLORE_ROWS: return (int)page.run.next_time;
    case EXPLORE_CROSSINGS: return (int)page.run.n_crossings;
    case EXPLORE_EVENTS: return (int)page.run.n_events;
    case EXPLORE_STEPS: return (int)page.run.steps;
    default: return 0;
    }
}

double explore_period(void)
{
    const Instance *m = page.instance;
    if (!m) return 0.0;
    const double *p = m->core.run.at.p, *d = m->core.run.at.d;
    (void)p, (void)d;
    return EXPLORE_PERIOD;
}
