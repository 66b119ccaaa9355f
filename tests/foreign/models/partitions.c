/* Scheduled execution, FMI 3: partitions that count their activations. 601 each (every second), 602 asked (by the
   importer), 603 soon (countdown: at once, told in the midst of the first partition at t = 4), 604 fifth (triggered by
   every fifth activation); the third one hands 1000 on to the second */
#define NX 0
#define NZ 0
#define NP 1
#define PARAMETERS 0.0
#define STARTS 0.0
#define CLOCKS 4
#define READABLE(m, v) 1
#include "model.h"

#include "clocks.h"

enum { EACH, ASKED, SOON, FIFTH };

static void derivatives(Model *m, double *dx) {}
static void indicators(Model *m, double *z) {}
static void after_step(Model *m) {}
static int update(Model *m) { return 0; }
static void begin(Model *m) {}
static void tick(Model *m, int k)
{
    int tells = 0;
    m->mode[k]++;
    m->mode[3]++;
    if (k == EACH && m->t == 4.0) {
        tell(m, SOON, 0.0);
        tells = 1;
    }
    if (m->mode[3] % 5 == 0) tells = m->active[FIFTH] = 1;
    if (k == SOON) m->p[0] += 1000.0;
    if (tells) m->told(m->environment);
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback told, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    Model *m = fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, log);
    if (m) m->told = told;
    lock();
    unlock();
    return m;
}
fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    Model *m = c;
    if (time < m->t) return fmi3Error;
    m->t = time;
    tick(m, (int)(clock - 601));
    return fmi3OK;
}
fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3Clock *values)
{
    return fmi3Error; /* not in scheduled execution */
}
