/* x' = 1, FMI 3, and a clock of each kind: 601 sample (constant), 602 grow (changing: 0.1, 0.2, ...), 603 later
   (countdown: 0.05 after every third sample), 604 go (triggered by the importer), 605 fifth (triggered by every fifth
   tick of the others), 606 tuned (tunable, its interval is a parameter). Counts samples, all ticks and fifths; holds the
   last sample of x, 203. What has a clock can be read while that is active alone, and before the run */
#define NX 1
#define NZ 0
#define NP 3
#define PARAMETERS 1.0, 0.4, -1.0
#define STARTS 0.0
#define CLOCKS 6
#define CO_SIMULATION
#define READABLE(m, v)                                                                                                 \
    (((v) != 401 && (v) != 402 && (v) != 203) || (m)->initializes || (m)->active[0]                                    \
     || ((v) == 402 && ((m)->active[1] || (m)->active[2] || (m)->active[3] || (m)->active[5])))
#include "model.h"

#include "clocks.h"

enum { SAMPLE, GROW, LATER, GO, FIFTH, TUNED };

static void derivatives(Model *m, double *dx) { dx[0] = m->p[0]; }
static void indicators(Model *m, double *z) {}
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    m->x[0] += m->p[0] * (end - m->t);
    m->t = end;
    return 0;
}
/* the clocks are active until here */
static int update(Model *m)
{
    memset(m->active, 0, sizeof m->active);
    m->initializes = 0;
    return 0;
}
static void tick(Model *m, int k)
{
    m->mode[1]++;
    if (m->mode[1] % 5 == 0) {
        m->active[FIFTH] = 1;
        m->mode[2]++;
    }
    if (k == SAMPLE) {
        m->mode[0]++;
        m->p[2] = m->x[0];
        if (m->mode[0] % 3 == 0) tell(m, LATER, 0.05);
    }
    if (k == GROW) tell(m, GROW, m->interval[GROW] + 0.1);
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3Clock *values)
{
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        if (!values[i] || v[i] - 601 == FIFTH) return fmi3Error;
        m->active[v[i] - 601] = 1;
        tick(m, (int)(v[i] - 601));
    }
    return fmi3OK;
}
static void begin(Model *m)
{
    tell(m, GROW, 0.1);
    tell(m, TUNED, m->p[1]);
}
