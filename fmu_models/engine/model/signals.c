/*
 * Periodic signals, on the pieces of a point:
 *
 *     t_k = start + (cycle + place_k) period
 *     s   = value_k + rate (t - t_k),    rate = (value_k+1 - value_k)/((place_k+1 - place_k) period)
 *
 * Of a point with a tangent knots move with parameters, and so do the values.
 */
#include "signals.h"

static Real KIND(knot_time)(const Signal *s, double cycle, int k)
{
    return s->start + (cycle + s->place[k]) * s->period;
}

Real signals_knot(const Point *at, int i, double cycle, int k)
{
    Signal s = {0}; /* gcc looks into calls that a model without signals never makes */
    model_signal(at->p, at->d, i, &s);
    return KIND(knot_time)(&s, cycle, k);
}

void signals_load(Point *at)
{
    for (int i = 0; i < MODEL_NS; i++) {
        Signal s;
        model_signal(at->p, at->d, i, &s);
        const int k = at->piece[i];
        const Real rate = (s.value[k + 1] - s.value[k]) / ((s.place[k + 1] - s.place[k]) * s.period);
        at->u[MODEL_SET_INPUTS + i] = s.value[k] + rate * (at->time - KIND(knot_time)(&s, at->cycle[i], k));
        at->du[MODEL_SET_INPUTS + i] = rate;
    }
}

void inputs_move(Point *at, Real since)
{
    const int degree = at->curved ? MODEL_INPUT_DEGREE : 1;
    for (int i = 0; i < MODEL_NU; i++) {
        for (int n = 0; n < degree; n++) {
            Real *moved = n == 0 ? &at->u[i] : n == 1 ? &at->du[i] : &at->bend[i][n - 2];
            Real share = since; /* since^m/m! */
            for (int m = 1; m <= degree - n; m++) {
                *moved += (n + m == 1 ? at->du[i] : at->bend[i][n + m - 2]) * share;
                share *= since / (m + 1);
            }
        }
    }
}
