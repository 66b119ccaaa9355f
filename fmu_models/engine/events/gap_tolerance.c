/* How far an importer that integrates by itself may be off at the wall of a rigid contact. */
#include "gap_tolerance.h"

#include "../step/taylor.h"

void gap_measure_nominal(Run *r)
{
    Jets *j = &r->scratch;
    memset(r->nominal_gap, 0, sizeof r->nominal_gap);
    if (MODEL_IMPACTS == 0 || r->tolerances.drift == 0.0) {
        return;
    }
    taylor_load(r, j);
    model_slip(r->at.p, r->at.d, j, 0);
    model_depth(r->at.p, r->at.d, j, 0);
    j->t[1] = 0.0;
    for (int i = 0; i < MODEL_NU; i++) {
        j->u[i][1] = 0.0;
    }
    for (int k = 0; k < MODEL_NQ; k++) {
        for (int i = 0; i < MODEL_NX; i++) {
            j->x[i][1] = i == k ? model_nominal_states[k] : 0.0;
        }
        model_slip(r->at.p, r->at.d, j, 1);
        model_depth(r->at.p, r->at.d, j, 1);
        for (int c = 0; c < MODEL_NC; c++) {
            r->nominal_gap[c] += model_contact_is_impact[c] ? fabs(j->depth[c][1]) : 0.0;
        }
    }
}

double gap_shift(const Run *r, const Jets *j, int c)
{
    return r->tolerances.importer * (model_depth_magnitude(r->at.p, r->at.d, j, c) + r->nominal_gap[c]);
}

double gap_resolution(const Run *r, const Jets *j, int c)
{
    return r->tolerances.drift * (model_depth_magnitude(r->at.p, r->at.d, j, c) + r->nominal_gap[c]);
}
