/*
 * A cone close to its rest. Its slip is so small a part of the fastest since it began that drive and friction are
 * constant until then: the time of rest is that of the closed form, the states go there in a line, and what this leaves
 * of the slip, which others do not see, the event takes.
 */
#include "cone_rest.h"

#include "cone_end.h"
#include "flow.h"

/* part of the fastest slip: time is exact to its square, and the direction of the slip to what rounding is of it */
static const double CLOSE = 1e-8;

int cone_rests_at_once(Run *r, double limit)
{
    Jets *j = &r->jets;
    double soonest = INFINITY;
    r->segment_rests = -1;
    flow_load(&r->at, j, 0);
    model_slip(r->at.p, r->at.d, j, 0);
    for (int c = 0; c < MODEL_NC; c++) {
        if (!cone_is_whole(c) || r->at.state[c] != CONTACT_SLIP_PLUS) continue;
        if (j->rising[c]) r->fastest[c] = 0.0;
        const double slip = j->rising[c] ? 0.0 : j->slip[c][0];
        r->fastest[c] = fmax(r->fastest[c], slip);
        if (!(slip > 0.0) || slip > CLOSE * r->fastest[c]) continue;
        flow_field(&r->at, j, 0, 0);
        double way[2], time = cone_rest_time(&r->at, j, c, way);
        if (!(time > 0.0) || !(time <= limit) || time >= soonest) continue;
        soonest = time;
        r->segment_rests = c;
    }
    if (r->segment_rests < 0) return 0;
    flow_field(&r->at, j, 0, 0);
    cone_end(&r->at, j, r->segment_rests);
    memset(r->falling, 0, sizeof r->falling);
    r->falling[r->segment_rests][SLOT_TANGENTIAL] = 1;
    r->segment_event = 1;
    r->segment_order = 2;
    r->segment_start = r->at.time;
    r->segment_length = soonest;
    r->segment_valid = 1;
    r->steps++;
    return 1;
}

void cone_margin(const Jets *j, int c, int order, double *margin)
{
    for (int k = 0; k <= order; k++) {
        margin[k] = 0.0;
        for (int i = 0; i <= k; i++)
            margin[k] += j->capacity[c][i] * j->capacity[c][k - i] - j->force[c + 1][i] * j->force[c + 1][k - i]
                         - j->force[c + 2][i] * j->force[c + 2][k - i];
    }
}
