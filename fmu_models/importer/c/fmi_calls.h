/* FMI 2 and FMI 3 as one set of calls over raw function pointers. Each returns the status of FMI: 0 OK, 1 warning, 2
   discard, 3 error. */
#pragma once

#include "master.h"

enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR };

EXPORT void master_log3(void *environment, int status, const char *category, const char *message);

typedef struct {
    int again; /* discrete states need another update */
    int terminate;
    int nominals_changed, states_changed;
    double next_time; /* infinity where none is defined */
} Update;

EXPORT int fmi_plain(const FmuInstance *fmu, Function function); /* the functions that take the instance only */
int fmi_initialize(const FmuInstance *fmu, double start, double stop, double tolerance); /* up to initialization mode */
EXPORT int fmi_configure(const FmuInstance *fmu); /* structural parameters, if there are any to be set */
EXPORT int fmi_update(const FmuInstance *fmu, Update *update);
int fmi_completed(const FmuInstance *fmu, int *enter_event, int *terminate);
int fmi_set_time(const FmuInstance *fmu, double t);
int fmi_set_states(const FmuInstance *fmu, const double *x);
int fmi_get_states(const FmuInstance *fmu, double *x);
int fmi_derivatives(const FmuInstance *fmu, double *dx);
int fmi_indicators(const FmuInstance *fmu, double *z);
int fmi_nominals(const FmuInstance *fmu, double *nominals);
/* dx = J seed; seed (n_states) */
int fmi_directional(const FmuInstance *fmu, const double *seed, double *dx);
EXPORT int fmi_read(const FmuInstance *fmu, const Variables *variables, double *values);
EXPORT int fmi_write(const FmuInstance *fmu, const Variables *variables, const double *values);

/* FMI 3: one clock */
int fmi_set_clock(const FmuInstance *fmu, uint32_t reference);
int fmi_get_clock(const FmuInstance *fmu, uint32_t reference, int *active);
/* interval s, or how it is told: fmi3IntervalQualifier */
int fmi_get_interval(const FmuInstance *fmu, uint32_t reference, double *interval, int *qualifier);
int fmi_get_shift(const FmuInstance *fmu, uint32_t reference, double *shift);
int fmi_activate(const FmuInstance *fmu, uint32_t reference, double t);

typedef struct {
    int event, terminate, early;
    double reached;
} Stepped;
EXPORT int fmi_do_step(const FmuInstance *fmu, double t, double length, Stepped *stepped);
