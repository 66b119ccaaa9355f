/*
 * Held contacts keep y' = 0, with the forces of those that slip put in:
 *
 *     G_ss lambda_s = -(rate of y along the flow without them),     as in engine/step/contact_forces.c
 *
 * solved once for the rows of all states. The slipping friction of a closed contact n counts with it: its column of W and
 * G is that of n less sign mu that of its friction.
 */
#include "lane_held.h"

/* of the largest entry of G: a pivot below it says that contacts hold the same motion */
static const double REDUNDANT = 1e-10;

double row_sum(const double *row, const double *z, double one)
{
    double sum = row[LANES_Z] * one;
    for (int j = 0; j < LANES_Z; j++)
        sum += row[j] * z[j];
    return sum;
}

double row_value(const double *row, const double *z) { return row_sum(row, z, 1.0); }

double row_size(const double *row, const double *z)
{
    double sum = fabs(row[LANES_Z]);
    for (int j = 0; j < LANES_Z; j++)
        sum += fabs(row[j] * z[j]);
    return sum;
}

double guard_rate(const LaneTable *t, const LaneMode *m, const double *z, int g, double *size)
{
    const double *row = m->full.guard[g];
    double rate = 0.0;
    *size = 0.0;
    for (int i = 0; i < MODEL_NX; i++) {
        if (row[i] != 0.0) {
            rate += row[i] * row_value(m->full.flow[i], z);
            *size += fabs(row[i]) * row_size(m->full.flow[i], z);
        }
    }
    for (int k = 0; k < LANES_HARMONICS; k++) {
        const int j = MODEL_NX + 2 * k;
        const double turn = t->wave[k] * (row[j + 1] * z[j] - row[j] * z[j + 1]);
        rate += turn;
        *size += fabs(turn);
    }
    return rate;
}

/* G x = b for some columns of b, which become x; 0 where G is singular */
static int solved(int n, double G[NC][NC], int width, double *b)
{
    double largest = 0.0;
    for (int i = 0; i < n * NC; i++)
        largest = i % NC < n ? fmax(largest, fabs(G[i / NC][i % NC])) : largest;
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            pivot = fabs(G[i][k]) > fabs(G[pivot][k]) ? i : pivot;
        if (!(fabs(G[pivot][k]) > REDUNDANT * largest)) return 0;
        for (int j = 0; pivot != k && j < n + width; j++) {
            double *one = j < n ? &G[k][j] : &b[k * width + j - n];
            double *other = j < n ? &G[pivot][j] : &b[pivot * width + j - n];
            const double kept = *one;
            *one = *other;
            *other = kept;
        }
        for (int i = 0; i < n; i++) {
            const double factor = i == k ? 0.0 : G[i][k] / G[k][k];
            for (int j = k; factor != 0.0 && j < n; j++)
                G[i][j] -= factor * G[k][j];
            for (int j = 0; factor != 0.0 && j < width; j++)
                b[i * width + j] -= factor * b[k * width + j];
        }
    }
    for (int i = 0; i < n * width; i++)
        b[i] /= G[i / width][i / width];
    return 1;
}

/* what the slipping friction of closed contact c has in parts of its force, and which contact that is; -1: none */
static int drag_of(const LaneRows *r, const LaneMode *m, int c, double *part)
{
    const int rub = lanes_impulsive[c] ? lanes_partner[c] - 1 : -1;
    *part = rub >= 0 ? -m->state[rub] * r->mu[rub] : 0.0;
    return rub >= 0 && abs(m->state[rub]) == 1 ? rub : -1;
}

/* the rate of a row of states and harmonics along the flow */
static void row_rate(const double *row, const double *wave, const Full *f, double *rate)
{
    memset(rate, 0, (LANES_Z + 1) * sizeof *rate);
    for (int i = 0; i < MODEL_NX; i++)
        for (int j = 0; row[i] != 0.0 && j <= LANES_Z; j++)
            rate[j] += row[i] * f->flow[i][j];
    for (int k = 0; k < LANES_HARMONICS; k++) {
        rate[MODEL_NX + 2 * k] += wave[k] * row[MODEL_NX + 2 * k + 1];
        rate[MODEL_NX + 2 * k + 1] -= wave[k] * row[MODEL_NX + 2 * k];
    }
}

/* what a unit of y of the members adds to the states so that all of them have none; along: 0 velocities, 1 coordinates */
static int corrections(const LaneRows *r, int n, const int *member, int along, double (*out)[MODEL_NX])
{
    double G[NC][NC];
    double inverse[NC * NC] = {0.0};
    for (int i = 0; i < n; i++) {
        inverse[i * n + i] = 1.0;
        for (int e = 0; e < n; e++)
            G[i][e] = r->G[member[i]][member[e]];
    }
    if (!solved(n, G, n, inverse)) return 0;
    for (int k = 0; k < n; k++) {
        for (int i = MODEL_NQ; i < MODEL_NX; i++) {
            double sum = 0.0;
            for (int e = 0; e < n; e++)
                sum += r->W[i][member[e]] * inverse[e * n + k];
            /* a depth is a negative gap */
            if (along == 0)
                out[k][i] = -sum;
            else if (i < 2 * MODEL_NQ)
                out[k][i - MODEL_NQ] = sum;
        }
    }
    return 1;
}

/* the corrections of the mode's held contacts; walls come first among them */
static int make_corrections(const LaneRows *r, LaneMode *m)
{
    int walls = 0;
    m->held_count = 0;
    memset(m->no_slip, 0, sizeof m->no_slip);
    memset(m->on_wall, 0, sizeof m->on_wall);
    for (int rigid = 1; rigid >= 0; rigid--) {
        for (int c = 0; c < MODEL_NC; c++)
            if (lane_holds(m->state, c) && (lanes_impulsive[c]) == rigid) m->held[m->held_count++] = c;
        walls = rigid ? m->held_count : walls;
    }
    return corrections(r, walls, m->held, 1, m->on_wall) && corrections(r, m->held_count, m->held, 0, m->no_slip);
}

int held_make(const LaneRows *r, const double *wave, LaneMode *m, Full *f, Held *held)
{
    double G[NC][NC];
    double force[NC][LANES_Z + 1];
    memset(held, 0, sizeof *held);
    if (!make_corrections(r, m)) return 0;
    const int n = m->held_count;
    for (int i = 0; i < n; i++) {
        const int c = m->held[i];
        double row[LANES_Z + 1];
        memcpy(row, r->slip[c], sizeof row);
        row_rate(row, wave, f, force[i]);
        for (int j = 0; j <= LANES_Z; j++)
            force[i][j] = -force[i][j];
        for (int e = 0; e < n; e++) {
            double part;
            const int rub = drag_of(r, m, m->held[e], &part);
            G[i][e] = r->G[c][m->held[e]] + (rub >= 0 ? part * r->G[c][rub] : 0.0);
        }
    }
    if (!solved(n, G, LANES_Z + 1, force[0])) return 0;
    for (int e = 0; e < n; e++) {
        const int c = m->held[e];
        double part;
        const int rub = drag_of(r, m, c, &part);
        memcpy(held->force[c], force[e], sizeof held->force[c]);
        for (int i = 0; i < MODEL_NX; i++) {
            const double push = r->W[i][c] + (rub >= 0 ? part * r->W[i][rub] : 0.0);
            for (int j = 0; push != 0.0 && j <= LANES_Z; j++)
                f->flow[i][j] += push * force[e][j];
        }
    }
    return 1;
}

void held_margin(const LaneRows *r, const LaneMode *m, const Held *held, int c, int side, double *row)
{
    const int normal = lanes_led[c] ? lanes_partner[c] - 1 : -1;
    const double *bound = r->capacity[c][side < 0];
    for (int j = 0; j <= LANES_Z; j++) {
        const double most = normal >= 0 ? r->mu[c] * held->force[normal][j] : bound[j];
        row[j] = most - side * held->force[c][j];
    }
    for (int i = 0; normal < 0 && i < MODEL_NX; i++)
        row[LANES_Z] += bound[i] * m->shift[i];
}

void held_settle(const LaneTable *t, const LaneMode *m, double *z)
{
    double y[NC], plain[LANES_Z];
    if (m->held_count == 0) return;
    memcpy(plain, z, sizeof plain);
    for (int i = 0; i < MODEL_NX; i++)
        plain[i] += m->shift[i];
    for (int k = 0; k < m->held_count; k++) {
        const int wall = lanes_impulsive[m->held[k]];
        y[k] = row_value(t->approach[m->held[k]], plain);
        const double depth = wall ? row_value(t->depth[m->held[k]], plain) : 0.0;
        for (int i = 0; i < MODEL_NQ; i++)
            z[i] += m->on_wall[k][i] * depth;
    }
    for (int k = 0; k < m->held_count; k++)
        for (int i = MODEL_NQ; i < MODEL_NX; i++)
            z[i] += m->no_slip[k][i] * y[k];
}
