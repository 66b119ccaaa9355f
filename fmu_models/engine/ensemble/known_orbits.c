/*
 * When a motion needs to be followed no farther.
 *
 *     period   the point of n steps before has come back, this time and the 2 n + 2 times before: n is its period, the
 *              least one for which that is so
 *     orbit    a point lies within the quadratic form about a known one, the next within that about the next, and so on,
 *              as often as is asked for
 */
#include "known_orbits.h"

enum { ARRIVAL_WIDTH = MODEL_NX + 1 };

/* the memory: a ring of the last points, number by number, then for how many steps each period has held */
static double *arrival_ring(const Arrival *a, int i) { return a->memory + i * a->e->longest; }

static double *arrival_held(const Arrival *a) { return a->memory + a->e->longest * ARRIVAL_WIDTH; }

int64_t arrival_numbers(int64_t longest) { return longest * (ARRIVAL_WIDTH + 1); }

void arrival_start(Arrival *a, const Ensemble *e, double *memory)
{
    *a = (Arrival){e, memory, 0, 0, -1, -1, 0};
    for (int64_t n = 0; n < e->longest; n++)
        arrival_held(a)[n] = 0.0;
    for (int i = 0; i < MODEL_NX && e->longest > 0 && a->telling < 0; i++)
        a->telling = e->weights[i] > 0.0 && !(e->turns[i] < INFINITY) ? i : -1;
    for (int64_t n = 0; n < e->longest && a->telling >= 0; n++)
        arrival_ring(a, a->telling)[n] = INFINITY;
}

/* the shortest difference of two values of a number of a point */
static double arrival_apart(const Ensemble *e, int i, double difference)
{
    if (i == MODEL_NX || !(e->turns[i] < INFINITY)) return difference;
    return difference - nearbyint(difference / e->turns[i]) * e->turns[i];
}

/* whether the point may be one of the last ones: for most steps of most motions it is far from all of them */
static int arrival_may_repeat(const Arrival *a, const double *point)
{
    const Ensemble *e = a->e;
    if (a->held || a->telling < 0) return 1;
    const double *before = arrival_ring(a, a->telling);
    const double here = point[a->telling], weight = e->weights[a->telling], settled = e->settled;
    int64_t near = 0;
    for (int64_t n = 0; n < e->longest; n++)
        near |= fabs(here - before[n]) * weight <= settled;
    return near != 0;
}

int64_t arrival_period(Arrival *a, const double *x, double time)
{
    const Ensemble *e = a->e;
    double point[ARRIVAL_WIDTH];
    int64_t found = 0;
    if (e->longest == 0) return 0;
    memcpy(point, x, MODEL_NX * sizeof *point);
    point[MODEL_NX] = time;
    const int64_t here = a->seen % e->longest;
    int64_t place = here;
    const int64_t looked = !arrival_may_repeat(a, point) ? 0 : a->seen < e->longest ? a->seen : e->longest;
    a->held = 0;
    for (int64_t n = 1; n <= looked; n++) {
        place = (place > 0 ? place : e->longest) - 1;
        int same = 1;
        for (int i = 0; same && i < ARRIVAL_WIDTH; i++) {
            const double before = arrival_ring(a, i)[place];
            same = e->weights[i] == 0.0 || fabs(arrival_apart(e, i, point[i] - before)) * e->weights[i] <= e->settled;
        }
        double *held = arrival_held(a) + n - 1;
        *held = same ? *held + 1.0 : 0.0;
        a->held |= same;
        if (!found && *held > (double)(2 * n + 2)) found = n;
    }
    for (int i = 0; i < ARRIVAL_WIDTH; i++)
        arrival_ring(a, i)[here] = point[i];
    a->seen++;
    return found;
}

static int arrival_near(const Ensemble *e, const double *x, int64_t k)
{
    const double *centre = e->known + k * MODEL_NX;
    const double *form = e->metric + k * MODEL_NX * MODEL_NX;
    double apart[MODEL_ROOM(MODEL_NX)], sum = 0.0;
    for (int i = 0; i < MODEL_NX; i++)
        apart[i] = arrival_apart(e, i, x[i] - centre[i]);
    for (int i = 0; i < MODEL_NX; i++)
        for (int j = 0; j < MODEL_NX; j++)
            sum += apart[i] * form[i * MODEL_NX + j] * apart[j];
    return sum <= 1.0;
}

int64_t arrival_orbit(Arrival *a, const double *x)
{
    const Ensemble *e = a->e;
    int64_t here = a->expected >= 0 && arrival_near(e, x, a->expected) ? a->expected : -1;
    if (here < 0) a->met = 0;
    for (int64_t k = 0; here < 0 && k < e->n_known; k++)
        here = arrival_near(e, x, k) ? k : -1;
    a->expected = here < 0 ? -1 : e->next[here];
    a->met += here >= 0;
    return here >= 0 && a->met >= e->passes[here] ? e->orbit[here] : -1;
}
