/* SIDE x SIDE cells of a plate between cold edges: x' = 1000 times the differences from the four neighbours */
#define SIDE 18
#define NX (SIDE * SIDE)
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS [0 ... NX - 1] = 0.0
#define RATES 1001
#include "model.h"

static double cell(const Model *m, int i, int j)
{
    return i >= 0 && i < SIDE && j >= 0 && j < SIDE ? m->x[i * SIDE + j] : 0.0;
}

static void derivatives(Model *m, double *dx)
{
    for (int i = 0; i < SIDE; i++) {
        for (int j = 0; j < SIDE; j++) {
            const double around = cell(m, i - 1, j) + cell(m, i + 1, j) + cell(m, i, j - 1) + cell(m, i, j + 1);
            dx[i * SIDE + j] = 1e3 * (around - 4.0 * cell(m, i, j));
        }
    }
}
static void indicators(Model *m, double *z) {}
static int update(Model *m) { return 0; }
static void after_step(Model *m) {}
