/* FMI 2 and FMI 3 as one set of calls over raw function pointers. Each returns the status of FMI: 0 OK, 1 warning, 2 discard, 3 error. */
#ifndef STICKSLIP_FACE_H
#define STICKSLIP_FACE_H

#include "master.h"

enum { FMI_OK, FMI_WARNING, FMI_DISCARD, FMI_ERROR };

typedef struct {
    int again;                 /* discrete states need another update */
    int terminate;
    int nominals_changed, states_changed;
    double next_time;          /* infinity where none is defined */
} Update;

int face_plain(const Face *face, Function function);   /* the functions that take the instance only */
int face_initialize(const Face *face, double start, double stop, double tolerance); /* up to initialization mode */
int face_update(const Face *face, Update *update);
int face_completed(const Face *face, int *enter_event, int *terminate);
int face_set_time(const Face *face, double t);
int face_set_states(const Face *face, const double *x);
int face_get_states(const Face *face, double *x);
int face_derivatives(const Face *face, double *dx);
int face_indicators(const Face *face, double *z);
int face_nominals(const Face *face, double *nominals);
/* dx = J seed; seed (n_states) */
int face_directional(const Face *face, const double *seed, double *dx);
int face_read(const Face *face, const Variables *variables, double *values);
int face_write(const Face *face, const Variables *variables, const double *values);

typedef struct {
    int event, terminate, early;
    double reached;
} Stepped;
int face_do_step(const Face *face, double t, double length, Stepped *stepped);

#endif
