/* Differences of neighbours over sub-steps of the lanes that go through events; included once per target by lane_code.h. */

/* into column l, and back */
static void NAME(load_tangents)(const Pool *pool, NAME(Bench) * b, int l, int64_t slot)
{
    for (int n = 0; n < pool->directions; n++) {
        for (int i = 0; i < MODEL_NX; i++) {
            AT(b->tangent[n][i], l) = pool->lanes[slot].tangent[n][i];
        }
    }
}

static void NAME(save_tangents)(const Pool *pool, const NAME(Bench) * b, int l, int64_t slot)
{
    for (int n = 0; n < pool->directions; n++) {
        for (int i = 0; i < MODEL_NX; i++) {
            pool->lanes[slot].tangent[n][i] = AT(b->tangent[n][i], l);
        }
    }
}

/* exp(A h) d in each lane, by the series of the states without harmonics and constants */
static __attribute__((noinline)) void NAME(vary)(NAME(Bench) * b, V h, int64_t directions)
{
    static const double part[] = {1.0,     1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,
                                  1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16};
    for (int n = 0; n < directions; n++) {
        V now[MODEL_NX], sum[MODEL_NX], next[MODEL_NX];
        for (int i = 0; i < MODEL_NX; i++) {
            sum[i] = now[i] = b->tangent[n][i];
        }
        LANES_UNROLL
        for (int k = 0; k < LANES_ORDER; k++) {
            const V f = h * NAME(fill)(part[k]);
            LANES_VARIATION(b->flow, now, next);
            for (int i = 0; i < MODEL_NX; i++) {
                now[i] = f * next[i];
                sum[i] += now[i];
            }
        }
        for (int i = 0; i < MODEL_NX; i++) {
            b->tangent[n][i] = sum[i];
        }
    }
}
