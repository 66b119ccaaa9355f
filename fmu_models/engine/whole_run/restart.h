/* An instance for whole runs, without an interface of FMI, and its way back to a start. */
#pragma once

#include "../fmi/instance.h"

#if defined(_WIN32)
#define WHOLE_RUN_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define WHOLE_RUN_EXPORT __attribute__((visibility("default")))
#else
#define WHOLE_RUN_EXPORT
#endif

enum { WHOLE_RUN_DONE = 0, WHOLE_RUN_MORE = 1, WHOLE_RUN_ERROR = 2 };

/* changes with what the headers of this folder and of ensemble offer */
enum { WHOLE_RUN_VERSION = 10 };

/* bytes of a message, its end included */
enum { WHOLE_RUN_MESSAGE = 512 };

/* where a run starts: values by reference (parameters, states, memories, inputs and their rates), all others have the
   defaults of the model */
typedef struct {
    int64_t n_initial;
    const uint32_t *initial;
    const double *initial_values;
    double start_time, tolerance;
} RunStart;

WHOLE_RUN_EXPORT int stickslip_native_version(void);

/* an instance that writes why it refuses into a room of WHOLE_RUN_MESSAGE bytes, which must outlive it; NULL without
   memory */
WHOLE_RUN_EXPORT void *stickslip_open(char *message);
WHOLE_RUN_EXPORT void stickslip_close(void *instance);
/* back to a start, whatever was before, an error included: WHOLE_RUN_DONE or WHOLE_RUN_ERROR */
WHOLE_RUN_EXPORT int stickslip_restart(void *instance, const RunStart *start);

/* the same up to the initialization, for what has to be prepared before contact states are chosen */
Status whole_run_enter_initialization(Instance *m, const char *function, const RunStart *start);
