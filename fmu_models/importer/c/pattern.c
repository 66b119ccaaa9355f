/*
 * Columns are coloured one after another, each with the first colour that its rows have not met (A. R. Curtis,
 * M. J. D. Powell, J. K. Reid, J. Inst. Math. Appl. 13 (1974)). The order is that of E. Cuthill and J. McKee, reversed
 * (A. George, J. W. H. Liu, Computer Solution of Large Sparse Positive Definite Systems (1981), chapter 4): by distance
 * from a state at the rim.
 */
#include "pattern.h"

#include "elimination.h"

#include <stdlib.h>
#include <string.h>

/* time of a multiplication with an entry that is looked for, in those of a band */
static const double LOOKING = 2.0;

void pattern_free(Pattern *p)
{
    free(p->start);
    free(p->row);
    free(p->colour);
    *p = (Pattern){0};
}

/* the entries by rows: a pattern of the columns of each row */
static int transposed(const Pattern *p, int n, Pattern *rows)
{
    rows->start = calloc((size_t)n + 2, sizeof *rows->start);
    rows->row = malloc(((size_t)p->start[n] + 1) * sizeof *rows->row);
    if (!rows->start || !rows->row) return 0;
    for (int64_t k = 0; k < p->start[n]; k++)
        rows->start[p->row[k] + 2]++;
    for (int i = 2; i <= n; i++)
        rows->start[i] += rows->start[i - 1];
    for (int j = 0; j < n; j++)
        for (int64_t k = p->start[j]; k < p->start[j + 1]; k++)
            rows->row[rows->start[p->row[k] + 1]++] = j;
    return 1;
}

/* in the order of the states: of a band that gives as few colours as it is wide. room (2 n), zero */
static void colour(Pattern *p, const Pattern *rows, int n, int *room)
{
    int *sequence = room, *met = room + n;
    int64_t longest = 0;
    for (int i = 0; i < n; i++) {
        const int64_t length = rows->start[i + 1] - rows->start[i];
        longest = length > longest ? length : longest;
        sequence[p->place[i]] = i;
        p->colour[i] = -1;
    }
    for (int s = 0; s < n; s++) {
        const int j = sequence[s];
        /* a long row leaves little to share */
        int own = 2 * longest > n ? s : 0;
        for (int64_t k = p->start[j]; k < p->start[j + 1] && !own; k++) {
            const int64_t i = p->row[k];
            for (int64_t l = rows->start[i]; l < rows->start[i + 1]; l++)
                if (p->colour[rows->row[l]] >= 0) met[p->colour[rows->row[l]]] = s;
        }
        while (s > 0 && own < p->colours && met[own] == s)
            own++;
        p->colour[j] = own;
        p->colours = own + 1 > p->colours ? own + 1 : p->colours;
    }
}

static int64_t links(const Pattern *p, const Pattern *rows, int i)
{
    return p->start[i + 1] - p->start[i] + rows->start[i + 1] - rows->start[i];
}

/* what is linked with root, the nearest first, among them the least linked first; returns how many */
static int gather(const Pattern *p, const Pattern *rows, int root, int *queue, int *seen, int mark)
{
    int n = 1;
    queue[0] = root;
    seen[root] = mark;
    for (int next = 0; next < n; next++) {
        const int state = queue[next], first = n;
        for (int side = 0; side < 2; side++) {
            const Pattern *ways = side ? rows : p;
            for (int64_t k = ways->start[state]; k < ways->start[state + 1]; k++) {
                const int other = ways->row[k];
                if (seen[other] == mark) continue;
                seen[other] = mark;
                int at = n++;
                for (; at > first && links(p, rows, queue[at - 1]) > links(p, rows, other); at--)
                    queue[at] = queue[at - 1];
                queue[at] = other;
            }
        }
    }
    return n;
}

/* room (2 n), zero */
static void order(Pattern *p, const Pattern *rows, int n, int *room)
{
    int *queue = room, *seen = room + n;
    int mark = 0, left = n;
    for (int root = 0; root < n; root++) {
        if (seen[root]) continue;
        /* from the farthest one once more: a state at the rim */
        const int linked = gather(p, rows, root, queue, seen, ++mark);
        gather(p, rows, queue[linked - 1], queue, seen, ++mark);
        for (int k = 0; k < linked; k++)
            p->place[queue[k]] = --left;
    }
}

static Band band_of(const Pattern *p, int n)
{
    int lower = 0, upper = 0;
    for (int j = 0; j < n; j++) {
        for (int64_t k = p->start[j]; k < p->start[j + 1]; k++) {
            const int below = p->place[p->row[k]] - p->place[j];
            lower = below > lower ? below : lower;
            upper = -below > upper ? -below : upper;
        }
    }
    return linear_band(n, lower, upper);
}

/* factors by entries instead of by a band, where these are so much fewer that it pays to look for them */
static void eliminate_sparsely(Pattern *p, const Pattern *rows, int n)
{
    const double band = (double)n * p->band.lower * (p->band.lower + p->band.upper);
    if (p->band.lower < PATTERN_NARROW) return;
    int *order = p->place + 3 * n;
    const double most = band / LOOKING;
    const int64_t *starts[] = {p->start, rows->start};
    if (elimination_order(n, starts, (const int *[]){p->row, rows->row}, most, order) < 0.0) return;
    p->elimination = order;
    for (int i = 0; i < n; i++)
        p->place[i] = i;
}

int pattern_set(Pattern *p, int n, const int64_t *start, const int *rows)
{
    const int64_t entries = start ? start[n] : (int64_t)n * n, full = entries == (int64_t)n * n;
    Pattern made = {0}, across = {0};
    made.start = malloc(((size_t)n + 1) * sizeof *made.start);
    made.row = malloc(((size_t)entries + 1) * sizeof *made.row);
    made.colour = calloc(5 * (size_t)n + 1, sizeof *made.colour);
    int fits = made.start && made.row && made.colour;
    if (fits) {
        made.place = made.colour + n;
        for (int j = 0; j <= n; j++)
            made.start[j] = start ? start[j] : (int64_t)j * n;
        for (int64_t k = 0; k < entries; k++)
            made.row[k] = rows ? rows[k] : (int)(k % n);
        for (int j = 0; j < n; j++)
            made.colour[j] = made.place[j] = j;
        made.colours = n;
        fits = full || transposed(&made, n, &across);
    }
    if (fits && !full) {
        int *room = made.place + n;
        order(&made, &across, n, room);
        made.colours = 0;
        memset(room, 0, 2 * (size_t)n * sizeof *room);
        colour(&made, &across, n, room);
    }
    if (fits) made.band = band_of(&made, n);
    if (fits && !full) eliminate_sparsely(&made, &across, n);
    pattern_free(&across);
    pattern_free(p);
    if (!fits) pattern_free(&made);
    *p = made;
    return fits;
}
