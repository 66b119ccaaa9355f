/*
 * A free flight in one step. Where no state is driven by a harmonic, and none is more than a parabola of the time since
 * the start s, gaps are parabolas and harmonics, of which a series needs the more terms the longer the flight:
 *
 *     g(s) = g0 + g1 s + g2 s^2 + sum_h (C_h (cos(w_h s) - 1) + S_h sin(w_h s)),
 *     g'' >= m = 2 g2 - sum_h w_h^2 |(C_h, S_h)|
 *
 * The parabola g + g' d + m d^2/2 from any place is below the gap, and so is its first zero before that of the gap. From
 * zero to zero of these parabolas the way to the wall is certain, and as quick as Newton's at its end.
 */
#include "flight.h"

#if MODEL_LINEAR

typedef struct {
    double parabola[3];
    int harmonics;
    double rate[MODEL_ROOM(MODEL_NH)];
    /* a place, and there C cos + S sin and the same a quarter of a period before */
    double s, cosine[MODEL_ROOM(MODEL_NH)], sine[MODEL_ROOM(MODEL_NH)];
    double value, slope, bend;   /* g, g' and half of g'' there */
    double least, most, fastest; /* bounds of g'' and of its magnitude; the fastest rate */
    double largest;              /* of places seen */
    double closes;               /* when, as far as it is known: INFINITY */
} Gap;

int flight_is_flight(const LinearMode *m)
{
    int flies = m->rows > MODEL_NX;
    for (int i = 0; i < MODEL_NX; i++)
        flies &= m->last[i] <= 2;
    for (int i = MODEL_NX; i < m->rows; i++)
        flies &= m->quantity[i - MODEL_NX] == Y_DEPTH;
    return flies;
}

/* that of a row of depths, at the start */
static void gap_start(const Run *r, const LinearMode *m, int row, Gap *g)
{
    const Jets *j = &r->jets;
    const int c = m->contact[row - MODEL_NX], starts = r->at.known[c][SLOT_NORMAL] > 0;
    const double *depth = j->depth[c];
    *g = (Gap){.parabola = {starts ? 0.0 : -depth[0], -depth[1], -depth[2]}, .closes = INFINITY};
    g->value = g->parabola[0];
    g->slope = g->parabola[1];
    g->bend = g->parabola[2];
    double swing = 0.0, by[MODEL_ROOM(MODEL_NH)][2] = {{0.0}};
    for (int e = m->first[row]; e < m->first[row + 1]; e++) {
        const int n = m->column[e] - Z_SINE;
        if (n >= 0 && n < 2 * MODEL_NH) by[n / 2][n % 2] = -m->factor[e][0];
    }
    for (int h = 0; h < MODEL_NH; h++) {
        const double sine = j->w[model_sine[h]][0], cosine = j->w[model_cosine[h]][0], rate = m->rate[h];
        if (by[h][0] == 0.0 && by[h][1] == 0.0) continue;
        const double C = by[h][0] * sine + by[h][1] * cosine, S = by[h][0] * cosine - by[h][1] * sine;
        g->parabola[0] -= C;
        g->parabola[1] -= rate * S;
        g->parabola[2] += 0.5 * rate * rate * C;
        g->rate[g->harmonics] = rate;
        g->cosine[g->harmonics] = C;
        g->sine[g->harmonics++] = S;
        swing += rate * rate * (fabs(by[h][0]) + fabs(by[h][1]));
        g->fastest = fmax(g->fastest, fabs(rate));
    }
    g->least = 2.0 * g->parabola[2] - swing;
    g->most = fabs(2.0 * g->parabola[2]) + swing;
}

/* by series where the angle is small, in a third of the time */
static void turn(double angle, double *cosine, double *sine)
{
    enum { TERMS = 7 };
    static const double EVEN[TERMS] = {1.0 / 182, 1.0 / 132, 1.0 / 90, 1.0 / 56, 1.0 / 30, 1.0 / 12, 1.0 / 2};
    static const double ODD[TERMS] = {1.0 / 210, 1.0 / 156, 1.0 / 110, 1.0 / 72, 1.0 / 42, 1.0 / 20, 1.0 / 6};
    const double SMALL = 0.5, square = angle * angle;
    if (fabs(angle) > SMALL) {
        *cosine = cos(angle);
        *sine = sin(angle);
        return;
    }
    *cosine = *sine = 1.0;
    for (int k = 0; k < TERMS; k++) {
        *cosine = 1.0 - square * EVEN[k] * *cosine;
        *sine = 1.0 - square * ODD[k] * *sine;
    }
    *sine *= angle;
}

/* go so much on */
static void gap_move(Gap *g, double along)
{
    const double s = g->s += along;
    g->value = g->parabola[0] + s * (g->parabola[1] + s * g->parabola[2]);
    g->slope = g->parabola[1] + 2.0 * s * g->parabola[2];
    g->bend = g->parabola[2];
    for (int h = 0; h < g->harmonics; h++) {
        const double rate = g->rate[h], was = g->cosine[h];
        double cosine, sine;
        turn(rate * along, &cosine, &sine);
        g->cosine[h] = was * cosine + g->sine[h] * sine;
        g->sine[h] = g->sine[h] * cosine - was * sine;
        g->value += g->cosine[h];
        g->slope += rate * g->sine[h];
        g->bend -= 0.5 * rate * rate * g->cosine[h];
    }
    g->largest = fmax(g->largest, g->value);
}

/* one place on, or the zero where no other place is needed; 0 where series tell as soon, or better */
static int gap_follow(Gap *g)
{
    const double LONG = 1.0; /* radians of the first parabola */
    const double newton = -g->value / g->slope;
    double along;
    if (g->slope < 0.0 && 4.0 * g->most * fabs(newton) < -g->slope) { /* it falls until beyond the zero */
        const double ratio = g->bend / g->slope * newton, turned = newton * g->fastest;
        along = newton * (1.0 - ratio);
        if (8.0 * (ratio * ratio + turned * turned) * fabs(newton) <= DBL_EPSILON * g->s) {
            g->closes = g->s += along;
            return 1;
        }
    } else {
        const double root = sqrt(fmax(g->slope * g->slope - 2.0 * g->least * g->value, 0.0));
        along = g->slope < 0.0 ? 2.0 * g->value / (root - g->slope) : (g->slope + root) / -g->least;
        if (!(along >= 0.0) || g->value < 0.0 || (g->s == 0.0 && along * g->fastest < LONG)) return 0;
    }
    gap_move(g, along);
    return 1;
}

/* the first zero of all, none before `end`; INFINITY if there is none, -1 where series tell as soon, or better */
static double first_closing(Gap *gap, int count, double end)
{
    enum { PLACES = 24 };
    for (int places = PLACES * count; places > 0; places--) {
        Gap *behind = gap;
        for (int i = 1; i < count; i++)
            behind = gap[i].s < behind->s ? &gap[i] : behind;
        if (behind->s > end || behind->s == behind->closes) return behind->closes;
        if (!gap_follow(behind)) return -1.0;
    }
    return -1.0;
}

int flight_step(Run *r, double limit)
{
    const LinearMode *m = &r->linear[r->segment_linear - 1];
    const int count = m->rows - MODEL_NX;
    Gap gap[LINEAR_READ];
    if (!m->flies || r->at.curved || !isfinite(limit)) return 0;
    for (int i = 0; i < count; i++) {
        gap_start(r, m, MODEL_NX + i, &gap[i]);
        if (!(gap[i].value > 0.0 || (gap[i].value == 0.0 && gap[i].slope > 0.0))) return 0;
    }
    const double first = first_closing(gap, count, limit);
    if (first < 0.0) return 0;
    r->segment_event = first <= limit;
    memset(r->falling, 0, sizeof r->falling);
    for (int i = 0; i < count; i++) {
        r->falling[m->contact[i]][SLOT_NORMAL] = r->segment_event && gap[i].closes <= first * (1.0 + 4.0 * DBL_EPSILON);
        r->largest_gap[m->contact[i]] = fmax(r->largest_gap[m->contact[i]], gap[i].largest);
    }
    r->segment_order = 2;
    r->segment_start = r->at.time;
    r->segment_length = fmin(first, limit);
    return 1;
}

#else

int flight_step(Run *r, double limit)
{
    (void)r, (void)limit;
    return 0;
}

#endif
