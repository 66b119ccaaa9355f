/* Derivatives of the rates of a point and of its outputs along a direction (point_derivative.c). */
#pragma once

#include <stddef.h>

#include "../model/run_state.h"

/* of all that rates and outputs depend on */
typedef struct {
    double time;
    double p[MODEL_ROOM(MODEL_NP)];
    double u[MODEL_ROOM(MODEL_NU)];
    double du[MODEL_ROOM(MODEL_NU)];
    double x[MODEL_ROOM(MODEL_NX)];
    double memory[MODEL_ROOM(MODEL_NC)];
} Direction;

/* bytes that an evaluation needs; zero them before the first */
size_t point_derivative_room(void);
/* in the present contact states: of the rates (MODEL_NX) and of the outputs (MODEL_NY) */
void point_derivative(const Run *r, const Direction *along, void *room, double *dx, double *dy);
