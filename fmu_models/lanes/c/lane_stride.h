/* Exact steps of one length away from home; included once per target by lane_code.h. */
/* lanes in which no guard falls on a step of length h from z: the cubic through values and rates at both ends stays above what it
   leaves of the guard, h^4/384 max|g''''|; of one that is zero at the start both are taken over the time since then */
static INLINE M NAME(stays)(const V *z, const M *zeros, V h, const V *f0, const V *d0, const V *f1, const V *d1,
                            V (*tail)[MODEL_NX], const V *tail_constant)
{
    const V zero = NAME(fill)(0.0);
    const V third = h * NAME(fill)(1.0 / 3.0);
    const V fourth = (h * h) * (h * h);
    V size[MODEL_NX];
    M found = ~NAME(none)();
    for (int i = 0; i < MODEL_NX; i++)
        size[i] = NAME(size)(z[i]);
    for (int g = 0; g < LANES_GUARDS; g++) {
        V rest = tail_constant[g];
        for (int i = 0; i < MODEL_NX; i++)
            rest += tail[g][i] * size[i];
        rest *= fourth;
        const M known = (zeros[g] > NAME(none)()) | ((f0[g] == zero) & (d0[g] > zero));
        const V b1 = f0[g] + third * d0[g];
        const V b2 = f1[g] - third * d1[g];
        const V free = NAME(least)(NAME(least)(f0[g], b1), NAME(least)(b2, f1[g]));
        const V start = third * d0[g];
        const V since = NAME(least)(NAME(least)(start + start + start, NAME(fill)(1.5) * b2), f1[g]);
        const V low = NAME(pick)(known, since, free);
        found &= zeros[g] <= NAME(none)() + 1;
        found &= (low > rest * NAME(pick)(known, NAME(fill)(4.0 / 27.0), NAME(fill)(1.0 / 16.0)));
    }
    return found;
}

/* steps of some lanes until a guard may fall, or less than one is left */
static __attribute__((noinline)) void NAME(stride)(Pool *pool, NAME(Batch) * b, M some)
{
    V flow[MODEL_NX][LANES_Z + 1], turn[2 * LANES_NH];
    V tail[LANES_NG][MODEL_NX], tail_constant[LANES_NG];
    V f0[LANES_NG], d0[LANES_NG], f1[LANES_NG], d1[LANES_NG], now[LANES_Z];
    M known[LANES_NG];
    V steps = NAME(fill)(0.0);
    const V h = b->longest;
    for (int i = 0; i < MODEL_NX; i++)
        for (int j = 0; j <= LANES_Z; j++)
            EACH(flow[i][j], b->mode[l]->stride[i][j])
    for (int j = 0; j < 2 * LANES_HARMONICS; j++)
        EACH(turn[j], b->mode[l]->turn[j])
    for (int g = 0; g < LANES_GUARDS; g++) {
        EACH(tail_constant[g], b->mode[l]->tail_constant[g])
        for (int i = 0; i < MODEL_NX; i++)
            EACH(tail[g][i], b->mode[l]->tail[g][i])
    }
    NAME(guard_line)(b, b->z, f0, d0);
    const V most = NAME(fill)((double)LANES_ROUNDS);
    M going = some & (b->left >= h);
    M open = NAME(none)();
    memcpy(now, b->z, sizeof now);
    memcpy(known, b->known, sizeof known);
    /* all lanes go on, to where it is known that they may: a step waits for no comparison */
    while (NAME(any)(going)) {
        V next[LANES_Z];
        for (int i = 0; i < MODEL_NX; i++) {
            next[i] = flow[i][LANES_Z];
            for (int j = LANES_Z - 1; j >= 0; j--)
                next[i] += flow[i][j] * now[j];
        }
        for (int j = MODEL_NX; j < LANES_Z; j += 2) {
            const V c = turn[j - MODEL_NX];
            const V s = turn[j - MODEL_NX + 1];
            next[j] = c * now[j] - s * now[j + 1];
            next[j + 1] = s * now[j] + c * now[j + 1];
        }
        NAME(guard_line)(b, next, f1, d1);
        const M stays = NAME(stays)(now, known, h, f0, d0, f1, d1, tail, tail_constant);
        open |= going & ~stays;
        going &= stays;
        for (int j = 0; j < LANES_Z; j++) {
            now[j] = next[j];
            b->z[j] = NAME(pick)(going, next[j], b->z[j]);
        }
        for (int n = 0; n < pool->directions; n++) {
            V moved[MODEL_NX];
            for (int i = 0; i < MODEL_NX; i++) {
                moved[i] = NAME(fill)(0.0);
                for (int j = 0; j < MODEL_NX; j++)
                    moved[i] += flow[i][j] * b->tangent[n][j];
            }
            for (int i = 0; i < MODEL_NX; i++)
                b->tangent[n][i] = NAME(pick)(going, moved[i], b->tangent[n][i]);
        }
        for (int g = 0; g < LANES_GUARDS; g++) {
            f0[g] = f1[g];
            d0[g] = d1[g];
            known[g] = NAME(none)();
            b->known[g] &= ~going;
        }
        b->left = NAME(pick)(going, b->left - h, b->left);
        steps = NAME(pick)(going, steps + NAME(fill)(1.0), steps);
        going &= (b->left >= h) & (steps < most);
    }
    b->wants = NAME(choose)(open, NAME(none)() + QUEUE_EVENT, b->wants);
    WHERE (some) {
        b->lane[l]->rounds += (int)steps[l];
        if (!open[l] || b->lane[l]->rounds > LANES_ROUNDS) NAME(pass_on)(pool, b, l);
    }
}
