/*
 * The last of the way of a cone to rest: with a constant drive b and F = f G the time, (F w + b v)/(F^2 - b^2), and the way
 * are closed forms where the directions of the slip are alike (G a number); else they are integrals, by Runge and Kutta's
 * rule.
 */
#include "cone_end.h"

#include "cone_forces.h"
#include "flow.h"

#include <math.h>

/* time and way to rest where friction does not push along the slip alone: dv/ds = w b - f G v, dt = w ds */
static Real KIND(cone_integral)(const Real *b, Real f, Real G[2][2], const Real *v, Real *way)
{
    enum { STEPS = 4000 };
    const double END = 1e-9, h = 0.05 / PART(f * (G[0][0] + G[1][1]));
    const Real start = sqrt(v[0] * v[0] + v[1] * v[1]);
    Real time = 0.0, x = v[0] / start, y = v[1] / start;
    way[0] = way[1] = 0.0;
    for (int step = 0; step < STEPS && PART(x * x + y * y) > END * END; step++) {
        Real kx = 0.0, ky = 0.0, dx = 0.0, dy = 0.0;
        for (int stage = 0; stage < 4; stage++) {
            const double part = stage == 0   ? 0.0
                                : stage == 3 ? h
                                             : 0.5 * h,
                         weight = stage % 3 == 0 ? h / 6.0 : h / 3.0;
            const Real u = x + part * kx, p = y + part * ky, w = sqrt(u * u + p * p);
            kx = w * b[0] - f * (G[0][0] * u + G[0][1] * p);
            ky = w * b[1] - f * (G[1][0] * u + G[1][1] * p);
            dx += weight * kx;
            dy += weight * ky;
            time += weight * w * start;
            way[0] += weight * w * u * start * start;
            way[1] += weight * w * p * start * start;
        }
        x += dx;
        y += dy;
    }
    return time;
}

Real cone_rest_time(const Point *at, const Jets *j, int c, Real *way)
{
    const double EVEN = 1e-13;
    if (!cone_is_whole(c)) return -1.0;
    const Real w = j->slip[c][0], f = j->force[c][0], v[2] = {j->slip[c + 1][0], j->slip[c + 2][0]};
    Real G[2][2], b[2];
    cone_effects(at, j, c, G);
    for (int i = 0; i < 2; i++)
        b[i] = cone_rate(j, c + 1 + i, 0) - G[i][0] * j->force[c + 1][0] - G[i][1] * j->force[c + 2][0];
    const double size = PART(G[0][0] + G[1][1]);
    if (!(PART(f) > 0.0) || !(size > 0.0)) return -1.0;
    if (fabs(PART(G[0][0] - G[1][1])) > EVEN * size || fabs(PART(G[0][1])) > EVEN * size) {
        const Real det = G[0][0] * G[1][1] - G[0][1] * G[1][0];
        const Real x = (G[1][1] * b[0] - G[0][1] * b[1]) / det, y = (G[0][0] * b[1] - G[1][0] * b[0]) / det;
        return PART(f * f - x * x - y * y) > 0.0 ? KIND(cone_integral)(b, f, G, v, way) : -1.0;
    }
    const Real F = 0.5 * f * (G[0][0] + G[1][1]), square = b[0] * b[0] + b[1] * b[1];
    const Real along = (b[0] * v[0] + b[1] * v[1]) / w, rest = F * F - square, far = 4.0 * F * F - square;
    const Real by_slip = (2.0 * F + along) / far;
    const Real by_drive = (far + 6.0 * F * along + 3.0 * along * along) / (4.0 * rest * far);
    for (int i = 0; i < 2; i++)
        way[i] = w * (by_slip * v[i] + by_drive * w * b[i]);
    return (F * w + b[0] * v[0] + b[1] * v[1]) / rest;
}

/* constant forces of a cone that add so much to its slip, or to the way of it, over a time */
static void KIND(cone_push)(const Point *at, Jets *j, int c, const Real *missing)
{
    Real G[2][2];
    cone_effects(at, j, c, G);
    const Real det = G[0][0] * G[1][1] - G[0][1] * G[1][0];
    j->force[c + 1][0] += (G[1][1] * missing[0] - G[0][1] * missing[1]) / det;
    j->force[c + 2][0] += (G[0][0] * missing[1] - G[1][0] * missing[0]) / det;
}

Real cone_end(Point *at, Jets *j, int c)
{
    Real way[2], missing[2];
    if (!cone_is_whole(c)) return 0.0;
    const Real time = cone_rest_time(at, j, c, way);
    for (int i = 0; i < 2; i++)
        missing[i] = 2.0 * (way[i] / time - j->slip[c + 1 + i][0]) / time - cone_rate(j, c + 1 + i, 0);
    KIND(cone_push)(at, j, c, missing);
    flow_extend(j, 1, 0);
    for (int i = 0; i < MODEL_NX; i++)
        j->x[i][2] = i < MODEL_NQ ? 0.5 * j->x[MODEL_NQ + i][1] : 0.0;
    for (int i = 0; i < 2; i++)
        missing[i] = -j->slip[c + 1 + i][0] / time - cone_rate(j, c + 1 + i, 0);
    KIND(cone_push)(at, j, c, missing);
    flow_extend(j, 1, 0);
    flow_finish(at, j, 1);
    return time;
}
