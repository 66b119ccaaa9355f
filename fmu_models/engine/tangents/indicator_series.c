/*
 * What falls at an event, as a series: the depth, or the force of a closed rigid contact; the slip speed, the stick
 * margin, or the release.
 */
#include "indicator_series.h"

#include "../step/cone_rest.h"

int indicator_is_margin(const Run *r, int c, int slot)
{
    return slot == SLOT_TANGENTIAL && r->at.state[c] == CONTACT_STICK;
}

void indicator_series(const Run *r, const Variation *l, int c, int slot, int side, IndicatorSeries *f)
{
    const Jets *j = &r->jets;
    const int closed = model_contact_impulsive[c] && r->at.state[c] != CONTACT_AWAY;
    const int margin = indicator_is_margin(r, c, slot);
    const int released = slot == SLOT_TANGENTIAL && model_contact_compliant[c];
    const int normal = slot == SLOT_NORMAL;
    const double *value = closed ? j->force[c] : normal ? j->depth[c] : released ? j->release[c] : j->slip[c];
    const Pair *pairs = closed ? l->force[c] : normal ? l->depth[c] : released ? l->release[c] : l->slip[c];
    const double *bound = stick_bound(j, c, side);
    const Pair *moved = MODEL_DIRECTED && side < 0 ? l->capacity_minus[c] : l->capacity[c];
    f->order = l->order - (margin || closed);
    if (margin && cone_is_whole(c)) {
        cone_margin(j, c, f->order, f->value);
        for (int k = 0; k <= f->order; k++) {
            f->derivative[k] = PAIR_ZERO;
            for (int i = 0; i <= k; i++)
                f->derivative[k] += 2.0
                                    * (j->capacity[c][i] * l->capacity[c][k - i]
                                       - j->force[c + 1][i] * l->force[c + 1][k - i]
                                       - j->force[c + 2][i] * l->force[c + 2][k - i]);
        }
        return;
    }
    for (int k = 0; k <= f->order; k++) {
        f->value[k] = margin ? bound[k] - side * j->force[c][k] : value[k];
        f->derivative[k] = margin ? moved[k] - side * l->force[c][k] : pairs[k];
    }
}

#define Number Pair
#define POLYNOMIAL(name) pair_##name
#include "../step/polynomial.h"

double indicator_bend(const double *series, int order, double s)
{
    double rate[POLYNOMIAL_TERMS] = {0.0};
    for (int k = 1; k <= order; k++)
        rate[k - 1] = k * series[k];
    return polynomial_slope(rate, order - 1, s);
}
