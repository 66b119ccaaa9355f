/*
 * Derivatives at one instant: rates and outputs of the point moved by i eps along the direction, whose imaginary parts
 * they are, exact to rounding.
 */
#include "point_derivative.h"

#include "tangent_series.h"

typedef struct {
    Point at;
    Jets jets;
} Room;

size_t point_derivative_room(void) { return sizeof(Room); }

static void move(Real *to, const double *from, const double *along, int n)
{
    for (int i = 0; i < n; i++)
        to[i] = from[i] + EPS * along[i] * _Complex_I;
}

void point_derivative(const Run *r, const Direction *along, void *room, double *dx, double *dy)
{
    Point *at = &((Room *)room)->at;
    Jets *j = &((Room *)room)->jets;
    move(&at->time, &r->at.time, &along->time, 1);
    move(at->p, r->at.p, along->p, MODEL_NP);
    move(at->u, r->at.u, along->u, MODEL_NU);
    move(at->du, r->at.du, along->du, MODEL_NU);
    move(at->x, r->at.x, along->x, MODEL_NX);
    move(at->memory, r->at.memory, along->memory, MODEL_NC);
    at->time_rest = r->at.time_rest;
    memcpy(at->state, r->at.state, sizeof at->state);
    memcpy(at->held, r->at.held, sizeof at->held);
    memcpy(at->settles, r->at.settles, sizeof at->settles);
    memcpy(at->known, r->at.known, sizeof at->known);
    memcpy(at->cycle, r->at.cycle, sizeof at->cycle);
    memcpy(at->piece, r->at.piece, sizeof at->piece);
    model_prepare(at->p, at->d);
    signals_load(at);
    flow_load(at, j, 0);
    model_inertia(at->p, at->d, j, 0);
    flow_field(at, j, 0, 0);
    model_outputs(at->p, at->d, j, 0);
    for (int i = 0; i < MODEL_NQ; i++)
        dx[i] = along->x[MODEL_NQ + i];
    for (int i = 0; i < MODEL_NV; i++)
        dx[MODEL_NQ + i] = cimag(contact_rate(j, i, 0)) / EPS;
    for (int i = 0; i < MODEL_NZ; i++)
        dx[MODEL_NQ + MODEL_NV + i] = cimag(KIND(internal_rate)(j, i, 0)) / EPS;
    for (int i = 0; i < MODEL_NY; i++)
        dy[i] = cimag(j->y[i][0]) / EPS;
}

#include "../model/scalar_real.h"
