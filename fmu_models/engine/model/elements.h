/*
 * Arrays of springs behind sliders on one way: contact c of an array, and contact c - 1, the sign of the way's speed.
 *
 *     z_i' = way'    of a free one; 0 of one that is held at its bound, on the side to which the way goes
 *     pile = sum k_i z_i
 *     y    = D_i - side z_i of the free one that yields next, which is the nearest to its bound
 *
 * Series of all that are free agree but for their first term: pile and y cost as much as one of them. A way that turns
 * frees all at once, for they are held on its other side. Their states are the last of x, by array; their stiffnesses
 * and bounds the last of d. Included once per kind of number.
 */
#include <math.h>
#include <string.h>

static inline const Real *KIND(element_stiffness)(const Real *d, int c)
{
    return d + (MODEL_ND - 2 * MODEL_NE) + (model_contact_first[c] - (MODEL_NX - MODEL_NE));
}

static inline const Real *KIND(element_bound)(const Real *d, int c) { return KIND(element_stiffness)(d, c) + MODEL_NE; }

/* whether the element whose state is x[i] is held, of array c */
static inline int KIND(element_is_held)(const Jets *j, int c, int i)
{
    const int held = j->held[i - (MODEL_NX - MODEL_NE)];
    return held != 0 && held == j->sign[c - 1];
}

/* order k of the rate of internal state i */
static inline Real KIND(internal_rate)(const Jets *j, int i, int k)
{
    if (i < MODEL_NZ - MODEL_NE) return j->zrate[i][k];
    const int n = MODEL_NQ + MODEL_NV + i, c = array_of(n);
    return KIND(element_is_held)(j, c, n) ? 0.0 : j->slip[c - 1][k];
}

/* order 0 of pile and y, and which is next */
static inline void KIND(elements_begin)(const Real *d, Jets *j, int c)
{
    const int first = model_contact_first[c];
    const Real *stiffness = KIND(element_stiffness)(d, c), *bound = KIND(element_bound)(d, c);
    const double side = j->sign[c - 1];
    double least = INFINITY;
    j->next[c] = -1;
    j->slip[c][0] = bound[0]; /* which does not fall, where none is free */
    j->pile[c][0] = j->moving[c] = 0.0;
    for (int i = 0; i < model_contact_elements[c]; i++) {
        const Real z = j->x[first + i][0];
        j->pile[c][0] += stiffness[i] * z;
        if (KIND(element_is_held)(j, c, first + i)) continue;
        j->moving[c] += stiffness[i];
        if (PART(bound[i]) - side * PART(z) < least) {
            least = PART(bound[i]) - side * PART(z);
            j->next[c] = first + i;
            j->slip[c][0] = bound[i] - side * z;
        }
    }
}

/* order k of pile and y of array c */
static inline void KIND(elements_series)(const Real *d, Jets *j, int c, int k)
{
    const int next = j->next[c];
    if (k == 0) {
        KIND(elements_begin)(d, j, c);
        return;
    }
    j->pile[c][k] = next < 0 ? 0.0 : j->moving[c] * j->x[next][k];
    j->slip[c][k] = next < 0 ? 0.0 : -j->sign[c - 1] * j->x[next][k];
}

/* the elements of array c that are held, exactly at their bounds */
static inline void KIND(elements_hold)(const Real *d, int c, const signed char *held, Real *x)
{
    const Real *bound = KIND(element_bound)(d, c);
    for (int i = 0; i < model_contact_elements[c]; i++) {
        const int n = model_contact_first[c] + i, side = held[n - (MODEL_NX - MODEL_NE)];
        if (side != 0) x[n] = side * bound[i];
    }
}

/* the series of all elements, but for their first terms, from those that are next, to an order */
static inline void KIND(elements_spread)(Jets *j, int order)
{
    for (int c = 0; MODEL_NE > 0 && c < MODEL_NC; c++) {
        for (int i = model_contact_first[c]; i < model_contact_first[c] + model_contact_elements[c]; i++) {
            const size_t size = (size_t)order * sizeof(Real);
            if (KIND(element_is_held)(j, c, i))
                memset(&j->x[i][1], 0, size);
            else if (i != j->next[c])
                memcpy(&j->x[i][1], &j->x[j->next[c]][1], size);
        }
    }
}
