/*
 * Series by sums. Where every function is affine in the states x, the time, the inputs and harmonics of the time, the
 * coefficients above order 0 follow from those of order 1 with the same factors everywhere in a mode:
 *
 *     z = (x, sine and cosine of each harmonic, u, u', t)   z[k+1] = L z[k]/(k+1),  k >= 1:   z[k] = T_k z[1]
 *     slip, depth, force, release, capacity             y[k] = R z[k] = R T_k z[1]
 *
 * and where inputs have terms of higher order, so many orders later the same again (LINEAR_ADD_CURVES). Order 0 is
 * evaluated as ever, and constants with it. L and R are what the model's own functions make at order 1 of
 * one column after the other, with the forces that hold contacts. Of the rows of T and R T those are kept that are not
 * zero.
 */
#include "linear.h"

#include "contact_forces.h"
#include "flight.h"
#include "flow.h"
#include "linear_factors.h"

#if MODEL_LINEAR

enum { Z_HALF = LINEAR_ORDER / 2 };

/* what the length of a step, or its events, read of the contacts */
static void note_read(const Run *r, const Jets *j, LinearMode *m)
{
    m->rows = MODEL_NX;
    for (int c = 0; c < MODEL_NC; c++) {
        const int sticks = r->at.state[c] == CONTACT_STICK;
        const int slips = r->at.state[c] != CONTACT_AWAY && slip_decides(r, j, c);
        const int read[Y_KINDS] = {slips,
                                   model_contact_bounded[c] && !contact_is_closed(r, c),
                                   contact_is_held(r->at.state, c),
                                   contact_may_release(r->at.state, c),
                                   sticks,
                                   sticks && MODEL_DIRECTED};
        for (int quantity = 0; quantity < Y_KINDS; quantity++) {
            if (!read[quantity]) continue;
            m->quantity[m->rows - MODEL_NX] = (signed char)quantity;
            m->contact[m->rows++ - MODEL_NX] = (short)c;
        }
    }
}

/* the rows without their zeros; 0 where there is no room for them */
static int keep_rows(LinearMode *m, const LinearFactors *f)
{
    int count = 0;
    for (int i = 0; i < m->rows; i++) {
        m->first[i] = (short)count;
        m->last[i] = 0;
        for (int n = 0; n < Z_COLUMNS; n++) {
            int last = LINEAR_ORDER;
            while (last > 0 && f->order[i][n][last - 1] == 0.0)
                last--;
            if (last == 0) continue;
            if (count == LINEAR_ENTRIES) return 0;
            memcpy(m->factor[count], f->order[i][n], sizeof f->order[i][n]);
            m->column[count++] = (unsigned char)n;
            m->last[i] = last > m->last[i] ? (unsigned char)last : m->last[i];
        }
        m->first[i + 1] = (short)count;
    }
    return 1;
}

/* about the fastest rate of a mode, in whatever units its states are; 0 where it has none */
static double rate_of(const LinearMode *m, const LinearFactors *f)
{
    double fastest = 0.0;
    for (int i = 0; i < MODEL_NX; i++) {
        double twice = 0.0;
        for (int n = 0; n < MODEL_NX; n++)
            twice += f->row[i][n] * f->row[n][i];
        fastest = fmax(fastest, fabs(twice));
    }
    fastest = sqrt(fastest);
    for (int h = 0; h < MODEL_NH; h++)
        fastest = fmax(fastest, fabs(m->rate[h]));
    return fastest;
}

static void make_mode(Run *r, const Jets *j, LinearMode *m)
{
    LinearFactors f;
    double factorial = 1.0;
    memcpy(m->state, r->at.state, sizeof m->state);
    note_read(r, j, m);
    linear_factors(&r->at, &r->scratch, m, &f);
    for (int h = 0; h < MODEL_NH; h++)
        m->rate[h] = f.rate[h];
    m->usable = !f.still && keep_rows(m, &f);
    m->flies = m->usable && flight_is_flight(m);
    /* the last terms but one of series that go with this rate are a quarter of what is asked for */
    for (int k = 2; k < LINEAR_ORDER; k++)
        factorial *= k;
    const double rate = rate_of(m, &f);
    m->length = rate > 0.0 ? pow(0.25 * r->tolerances.step * factorial, 1.0 / (LINEAR_ORDER - 1)) / rate : 0.0;
    m->power = pow(m->length, LINEAR_ORDER - 1);
}

/* the modes, unless they are of the parameters and the tolerance that the run has */
static void forget_others(Run *r)
{
    const size_t size = sizeof r->linear_parameters;
    if (memcmp(r->linear_parameters, r->at.p, size) != 0 || r->linear_tolerance != r->tolerances.step)
        r->linear_count = 0;
    memcpy(r->linear_parameters, r->at.p, size);
    r->linear_tolerance = r->tolerances.step;
    r->linear_known = 1;
}

/* the mode that the contacts are in; NULL where what holds them is shared by the size of their bounds, which changes */
static const LinearMode *mode_of(Run *r, const Jets *j)
{
    const Sticking *s = &r->at.sticking;
    for (int i = 0; i < s->count; i++)
        if (s->last[i] - s->first[i] > 1 && model_contact_partner[s->contact[i]] < 0) return NULL;
    if (!r->linear_known) forget_others(r);
    for (int i = 0; i < r->linear_count && i < LINEAR_MODES; i++) {
        const LinearMode *m = &r->linear[i];
        if (memcmp(m->state, r->at.state, sizeof m->state) == 0) return m->usable ? m : NULL;
    }
    LinearMode *m = &r->linear[r->linear_count++ % LINEAR_MODES];
    make_mode(r, j, m);
    return m->usable ? m : NULL;
}

int linear_series(Run *r, Jets *j, int order)
{
    double z[Z_COLUMNS];
    if (order > LINEAR_ORDER || r->tolerances.step < run_default_tolerances.step) return 0;
    flow_load(&r->at, j, 0);
    flow_field(&r->at, j, 0, 0);
    flow_extend(j, 1, 0);
    const LinearMode *m = mode_of(r, j);
    if (!m) return 0;
    for (int i = 0; i < MODEL_NX; i++)
        z[i] = j->x[i][1];
    for (int h = 0; h < MODEL_NH; h++) {
        z[Z_SINE + 2 * h] = m->rate[h] * j->w[model_cosine[h]][0];
        z[Z_SINE + 2 * h + 1] = -m->rate[h] * j->w[model_sine[h]][0];
    }
    for (int i = 0; i < MODEL_NU; i++) {
        z[Z_INPUT + i] = j->u[i][1];
        z[Z_RATE + i] = j->du[i][1];
    }
    z[Z_TIME] = 1.0;
    double by[LINEAR_ENTRIES];
    for (int e = 0; e < m->first[m->rows]; e++)
        by[e] = z[m->column[e]];
    for (int i = 0; i < m->rows; i++) {
        double *series = linear_row(j, m, i) + 1;
        for (int k = 0; k < LINEAR_ORDER; k += Z_HALF) {
            double sum[Z_HALF] = {0.0};
            for (int e = m->first[i]; e < m->first[i + 1] && k < m->last[i]; e++)
                for (int n = 0; n < Z_HALF; n++)
                    sum[n] += m->factor[e][k + n] * by[e];
            memcpy(series + k, sum, sizeof sum);
        }
        if (r->at.curved) LINEAR_ADD_CURVES(series - 1, j, m->column, m->factor, m->first[i], m->first[i + 1])
        if (!isfinite(series[LINEAR_ORDER - 1])) return 0;
    }
    r->evaluations += LINEAR_ORDER;
    return 1 + (int)(m - r->linear);
}

/* whether the last two terms of a series, over the length of the mode, are small beside the first two from term f */
static int is_short(const Run *r, const LinearMode *m, const double *series, int first)
{
    const double h = m->length;
    const double head = fmax(fabs(series[first]), fabs(series[first + 1]) * h) * (first ? h : 1.0);
    return fmax(fabs(series[LINEAR_ORDER - 1]), fabs(series[LINEAR_ORDER]) * h) * m->power <= r->tolerances.step * head;
}

double linear_length(Run *r)
{
    const LinearMode *m = &r->linear[r->segment_linear - 1];
    for (int i = 0; i < m->rows; i++) {
        const int quantity = i < MODEL_NX ? Y_RELEASE : m->quantity[i - MODEL_NX];
        const int c = i < MODEL_NX ? 0 : m->contact[i - MODEL_NX];
        const int slot = quantity == Y_SLIP ? SLOT_TANGENTIAL : SLOT_NORMAL;
        const int starts = quantity == Y_SLIP || quantity == Y_DEPTH
                           || (quantity == Y_FORCE && contact_is_closed(r, c));
        const int known = starts ? r->at.known[c][slot] : 0;
        if (known > 1 || !is_short(r, m, linear_row(&r->jets, m, i), known)) return 0.0;
    }
    return m->length;
}

double linear_power(const Run *r, double length)
{
    const LinearMode *m = &r->linear[r->segment_linear - 1];
    return length <= m->length ? m->power : pow(length, LINEAR_ORDER - 1);
}

#else

double linear_power(const Run *r, double length)
{
    (void)r;
    return pow(length, LINEAR_ORDER - 1);
}

int linear_series(Run *r, Jets *j, int order)
{
    (void)r, (void)j, (void)order;
    return 0;
}

double linear_length(Run *r)
{
    (void)r;
    return 0.0;
}

#endif
