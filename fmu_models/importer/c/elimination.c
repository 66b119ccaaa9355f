/*
 * Minimum degree on the quotient graph (A. George, J. W. H. Liu, SIAM Review 31 (1989)): a state that is eliminated
 * becomes a clique of its neighbours, into which those go that it belonged to.
 */
#include "elimination.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    int *entry, n, room;
} List;

typedef struct {
    List *near, *cliques; /* (n): neighbours by entries, of a clique its members; cliques of a state */
    int *mark, *degree;   /* (n); degree negative: eliminated */
    int64_t *seen, count;
    int fails;
} Graph;

static void add(Graph *g, List *list, int entry)
{
    if (list->n == list->room) {
        const int room = 2 * list->room + 4;
        int *longer = realloc(list->entry, (size_t)room * sizeof *longer);
        g->fails |= !longer;
        if (!longer) return;
        list->entry = longer;
        list->room = room;
    }
    list->entry[list->n++] = entry;
}

static void drop(List *list)
{
    free(list->entry);
    *list = (List){0};
}

/* the entries of a list that carry another mark */
static void keep_unmarked(List *list, const int *mark, int marked)
{
    int kept = 0;
    for (int k = 0; k < list->n; k++)
        if (mark[list->entry[k]] != marked) list->entry[kept++] = list->entry[k];
    list->n = kept;
}

static int count_neighbours(Graph *g, int state)
{
    int n = g->near[state].n;
    g->seen[state] = ++g->count;
    for (int k = 0; k < n; k++)
        g->seen[g->near[state].entry[k]] = g->count;
    for (int c = 0; c < g->cliques[state].n; c++) {
        const List *clique = &g->near[g->cliques[state].entry[c]];
        for (int k = 0; k < clique->n; k++) {
            n += g->seen[clique->entry[k]] != g->count;
            g->seen[clique->entry[k]] = g->count;
        }
    }
    return n;
}

/* returns the number of its neighbours; marks: two a state that is eliminated */
static int eliminate(Graph *g, int state, int round)
{
    List members = {0};
    const int marked = 2 * round + 1, absorbed = 2 * round + 2;
    g->mark[state] = marked;
    for (int c = -1; c < g->cliques[state].n; c++) {
        List *from = &g->near[c < 0 ? state : g->cliques[state].entry[c]];
        for (int k = 0; k < from->n; k++) {
            const int other = from->entry[k];
            if (g->mark[other] != marked) add(g, &members, other);
            g->mark[other] = marked;
        }
        if (c >= 0) g->mark[g->cliques[state].entry[c]] = absorbed;
        drop(from);
    }
    drop(&g->cliques[state]);
    g->near[state] = members;
    g->degree[state] = -1;
    for (int k = 0; k < members.n; k++) {
        const int other = members.entry[k];
        keep_unmarked(&g->near[other], g->mark, marked);
        keep_unmarked(&g->cliques[other], g->mark, absorbed);
        add(g, &g->cliques[other], state);
        g->degree[other] = count_neighbours(g, other);
    }
    return members.n;
}

double elimination_order(int n, const int64_t *starts[2], const int *lists[2], double most, int *order)
{
    Graph g = {.near = calloc((size_t)n + 1, sizeof(List)), .cliques = calloc((size_t)n + 1, sizeof(List))};
    g.mark = calloc(2 * (size_t)n + 1, sizeof *g.mark);
    g.seen = calloc((size_t)n + 1, sizeof *g.seen);
    double work = 0.0;
    g.fails = !g.near || !g.cliques || !g.mark || !g.seen;
    g.degree = g.mark ? g.mark + n : NULL;
    for (int i = 0; i < n && !g.fails; i++) {
        g.mark[i] = -i - 1;
        for (int side = 0; side < 2; side++) {
            for (int64_t k = starts[side][i]; k < starts[side][i + 1]; k++) {
                const int other = lists[side][k];
                if (other == i || g.mark[other] == -i - 1) continue;
                add(&g, &g.near[i], other);
                g.mark[other] = -i - 1;
            }
        }
        g.degree[i] = g.near[i].n;
    }
    if (g.mark) memset(g.mark, 0, (size_t)n * sizeof *g.mark);
    for (int k = 0; k < n && !g.fails && work <= most; k++) {
        int least = -1;
        for (int i = 0; i < n; i++)
            if (g.degree[i] >= 0 && (least < 0 || g.degree[i] < g.degree[least])) least = i;
        order[k] = least;
        const double neighbours = eliminate(&g, least, k);
        work += neighbours * neighbours;
    }
    for (int i = 0; i < n && g.near && g.cliques; i++) {
        drop(&g.near[i]);
        drop(&g.cliques[i]);
    }
    free(g.near);
    free(g.cliques);
    free(g.mark);
    free(g.seen);
    return g.fails || work > most ? -1.0 : work;
}
