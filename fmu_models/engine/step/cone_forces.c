/*
 * Friction with two directions: a cone. Its three contacts are the whole, c, whose y is the slip w = |v| and whose law
 * gives f(w), and its sides, c + 1 and c + 2, along which forces act:
 *
 *     slip     lambda = -f(w) n,  n = v/w
 *     stick    the sides are held; as long as |lambda|^2 < capacity^2
 *     rest     w falls to zero. With a drive v' = a - f G n, a below f, n turns with a power of the time that is left: no
 *              series reaches rest, steps shrink with that time, and cone_end.c takes the last of it in closed form
 *     onset    v = w n begins at zero, w = w1 t + w2 t^2 + ..., and n is not v/w: of each order k the rate of v,
 *
 *                  (k+1) sum w[k+1-i] n[i] = b[k] - (G sum f[k-i] n[i]),   n n = 1
 *
 *              gives n[k] across n[0] and w[k+1] along it. Where friction is no less in slip than it was in stick w1 is
 *              zero, and the series is asymptotic, not convergent: its terms fall, then grow; steps end where they are
 *              least. b: what drives the slip, with what others hold; G: with how those give way
 */
#include "cone_forces.h"

#include <float.h>
#include <math.h>

/* order k of the sum of a[i] b[k-i], i from first to last */
static Real KIND(cone_product)(const Real *a, const Real *b, int k, int first, int last)
{
    Real sum = 0.0;
    for (int i = first; i <= last; i++)
        sum += a[i] * b[k - i];
    return sum;
}

int cone_forces(const Point *at, Jets *j, int k, int c)
{
    if (!cone_is_whole(c)) return 0;
    const int held = at->state[c] == CONTACT_STICK, slips = !held && at->state[c] != CONTACT_AWAY;
    if (held || k == 0) model_stick(at->p, at->d, j, k, c);
    if (k == 0 && slips && PART(j->slip[c][0]) == 0.0) j->rising[c] = 1;
    if (k == 0 && j->rising[c] == 1) j->slip[c][0] = 0.0;
    if (held) j->slip[c][k] = 0.0;
    j->force[c][k] = 0.0;
    if (slips) model_law(at->p, at->d, j, k, c);
    for (int s = c + 1; s <= c + 2; s++) {
        const Real capacity = j->capacity[c][k];
        if (held || k == 0 || j->rising[c]) model_stick(at->p, at->d, j, k, s);
        j->capacity[s][k] = capacity;
        stick_mirror(j, s, k);
        j->force[s][k] = 0.0;
        if (slips && !j->rising[c]) {
            j->unit[s][k] = (j->slip[s][k] - KIND(cone_product)(j->unit[s], j->slip[c], k, 0, k - 1)) / j->slip[c][0];
            j->force[s][k] = -KIND(cone_product)(j->unit[s], j->force[c], k, 0, k);
        } else if (slips) {
            j->force[s][k] = -KIND(cone_product)(j->unit[s], j->force[c], k, 0, k - 1);
        }
    }
    return held;
}

/* order 0 of what the force of side e does to the rate of side c, with how held contacts give way */
static Real KIND(cone_effect)(const Point *at, const Jets *j, int c, int e)
{
    const Sticking *s = &at->sticking;
    Real sum = j->G[c][e][0];
    for (int i = 0; i < s->count; i++)
        for (int m = s->first[i]; m < s->last[i]; m++)
            sum -= j->G[c][s->contact[i]][0] * s->inverse[i][m] * j->G[s->contact[m]][e][0];
    return sum;
}

void cone_effects(const Point *at, const Jets *j, int c, Real G[2][2])
{
    for (int i = 0; i < 2 && cone_is_whole(c); i++)
        for (int e = 0; e < 2; e++)
            G[i][e] = KIND(cone_effect)(at, j, c + 1 + i, c + 1 + e);
}

Real cone_rate(const Jets *j, int c, int k)
{
    Real sum = j->slip_rate[c][k];
    for (int n = model_joined_first[c]; n < model_joined_first[c + 1]; n++) {
        const int e = model_joined[n];
        sum += MODEL_CONSTANT_INERTIA ? j->G[c][e][0] * j->force[e][k]
                                      : KIND(cone_product)(j->G[c][e], j->force[e], k, 0, k);
    }
    return sum;
}

/* n and w1 > 0 of (w1 + f G) n = b, by Newton's method for 1/|n| = 1 from below; where b is less than f G can be, w1 < 0 */
static Real KIND(cone_leave)(const Real *b, Real f, Real G[2][2], Real *n)
{
    enum { ROUNDS = 30 };
    const Real length = sqrt(b[0] * b[0] + b[1] * b[1]);
    if (PART(length) == 0.0) {
        n[0] = 1.0;
        n[1] = 0.0;
        return -f * G[0][0];
    }
    Real w = length - 0.5 * f * (G[0][0] + G[1][1]);
    for (int round = 0; round < ROUNDS; round++) {
        const Real A = w + f * G[0][0], B = f * G[0][1], C = f * G[1][0], D = w + f * G[1][1];
        const Real det = A * D - B * C;
        n[0] = (D * b[0] - B * b[1]) / det;
        n[1] = (A * b[1] - C * b[0]) / det;
        const Real size = sqrt(n[0] * n[0] + n[1] * n[1]);
        const Real slope = (n[0] * (D * n[0] - B * n[1]) + n[1] * (A * n[1] - C * n[0])) / (det * size);
        const Real step = size * (size - 1.0) / slope;
        if (round > 3 && fabs(PART(step)) <= DBL_EPSILON * PART(length)) break;
        w += step;
    }
    const Real size = sqrt(n[0] * n[0] + n[1] * n[1]);
    n[0] /= size;
    n[1] /= size;
    return w;
}

int cone_rise(const Point *at, Jets *j, int k, int c)
{
    if (!cone_is_whole(c)) return 0;
    Real *const w = j->slip[c], *const x = j->unit[c + 1], *const y = j->unit[c + 2];
    const Real f = j->force[c][0];
    Real G[2][2];
    cone_effects(at, j, c, G);
    Real r[2] = {cone_rate(j, c + 1, k), cone_rate(j, c + 2, k)};
    if (k == 0) {
        Real n[2];
        w[1] = KIND(cone_leave)(r, f, G, n);
        x[0] = n[0];
        y[0] = n[1];
    } else {
        const Real along =
            k > 1 ? -0.5 * (KIND(cone_product)(x, x, k, 1, k - 1) + KIND(cone_product)(y, y, k, 1, k - 1)) : 0.0;
        const Real Gn[2] = {G[0][0] * x[0] + G[0][1] * y[0], G[1][0] * x[0] + G[1][1] * y[0]};
        const Real Gt[2] = {G[0][1] * x[0] - G[0][0] * y[0], G[1][1] * x[0] - G[1][0] * y[0]};
        const double m = k + 1;
        r[0] -= m * KIND(cone_product)(x, w, k + 1, 1, k - 1) + along * (m * w[1] * x[0] + f * Gn[0]);
        r[1] -= m * KIND(cone_product)(y, w, k + 1, 1, k - 1) + along * (m * w[1] * y[0] + f * Gn[1]);
        const Real across = (x[0] * r[1] - y[0] * r[0]) / (m * w[1] + f * (x[0] * Gt[1] - y[0] * Gt[0]));
        w[k + 1] = (x[0] * r[0] + y[0] * r[1] - across * f * (x[0] * Gt[0] + y[0] * Gt[1])) / m;
        const Real x0 = x[0], y0 = y[0];
        x[k] = along * x0 - across * y0;
        y[k] = along * y0 + across * x0;
    }
    j->force[c + 1][k] -= f * x[k];
    j->force[c + 2][k] -= f * y[k];
    return 1;
}
