/* Differences of neighbours over sub-steps of lanes that go through events; included once per target by lane_code.h. */

/* from their records, and back */
static INLINE void NAME(load_tangents)(const Pool *pool, NAME(Batch) * b)
{
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            EACH(b->tangent[n][i], b->lane[l]->tangent[n][i])
}

static INLINE void NAME(save_tangents)(const Pool *pool, const NAME(Batch) * b, int l)
{
    for (int n = 0; n < pool->directions; n++)
        for (int i = 0; i < MODEL_NX; i++)
            b->lane[l]->tangent[n][i] = b->tangent[n][i][l];
}

/* exp(A h) d in each lane, by the series of the states without harmonics and constants; two at a time: the terms of one
   wait for each other */
static __attribute__((noinline)) void NAME(vary)(NAME(Batch) * b, V h, int64_t directions)
{
    static const double part[] = {1.0,     1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,  1.0 / 7,  1.0 / 8,
                                  1.0 / 9, 1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16};
    enum { TERMS = LANES_VARIED ? LANES_VARIED : LANES_ORDER };
    for (int n = 0; n < directions; n += 2) {
        V now[2][MODEL_NX], sum[2][MODEL_NX], next[2][MODEL_NX];
        memcpy(now, b->tangent[n], sizeof now);
        memcpy(sum, b->tangent[n], sizeof sum);
        LANES_UNROLL
        for (int k = 0; k < TERMS; k++) {
            const V f = h * NAME(fill)(part[k]);
            LANES_VARIATION(b->flow, now[0], next[0]);
            LANES_VARIATION(b->flow, now[1], next[1]);
            for (int i = 0; i < MODEL_NX; i++) {
                now[0][i] = f * next[0][i];
                now[1][i] = f * next[1][i];
                sum[0][i] += now[0][i];
                sum[1][i] += now[1][i];
            }
        }
        memcpy(b->tangent[n], sum, sizeof sum);
    }
}
