/* Sub-steps in which guards fall, and events that are like most in all lanes at once; included once per target by
   lane_code.h. */
/* impacts of a batch that are like most: fast enough to rebound, and alone. The lanes in which guards fell and that are not
   among them are returned */
static INLINE M NAME(impacts)(NAME(Batch) * b, M fell, V guard, int64_t directions)
{
    V value[LANES_NG], rate[LANES_NG], size[LANES_NG], push[MODEL_NX];
    V magnitude[LANES_Z], factor[LANES_NR];
    if (!LANES_IMPACTS) return fell;
    V plain;
    EACH(plain, b->mode[l]->plain)
    NAME(guard_line)(b, b->z, value, rate);
    for (int j = 0; j < LANES_Z; j++)
        magnitude[j] = NAME(size)(b->z[j]);
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++)
        factor[e] = NAME(size)(b->guard[e]);
    for (int g = 0; g < LANES_GUARDS; g++)
        size[g] = NAME(size)(b->guard_constant[g]);
    LANES_GUARD_SUMS(factor, magnitude, size);
    for (int g = 0; g < LANES_GUARDS; g++) {
        const int c = lanes_guard_contact[g];
        V e, fastest;
        M hit = fell & (guard == NAME(fill)((double)g));
        if (!lanes_impulsive[c] || lanes_partner[c] || lanes_poisson[c]) continue;
        hit &= plain != NAME(fill)(0.0);
        EACH(e, b->table[l]->restitution[c])
        EACH(fastest, b->lane[l]->motion.memory[c])
        fastest = NAME(most)(fastest, -rate[g]);
        hit &= rate[g] < NAME(fill)(0.0);
        hit &= -(e * rate[g]) > NAME(fill)(2.0 * LANES_CHATTER) * fastest;
        for (int other = 0; other < LANES_GUARDS; other++)
            if (other != g && lanes_impulsive[lanes_guard_contact[other]])
                hit &= NAME(size)(value[other]) > NAME(fill)(LANES_AT_WALL) * size[other];
        const V impulse = rate[g] + e * rate[g];
        for (int i = 0; i < MODEL_NX; i++) {
            EACH(push[i], b->table[l]->push[c][i < MODEL_NQ ? MODEL_NQ + i : i])
            const V moved = b->z[i] - (i < MODEL_NQ ? value[g] : impulse) * push[i];
            b->z[i] = NAME(pick)(hit, moved, b->z[i]);
        }
        NAME(strike)(b, hit, g, NAME(fill)(1.0) + e, push, directions);
        WHERE (hit) {
            LaneMotion *motion = &b->lane[l]->motion;
            motion->memory[c] = fastest[l];
            motion->began[c]++;
        }
        for (int other = 0; other < LANES_GUARDS; other++)
            b->known[other] = NAME(choose)(hit, NAME(none)() + (other == g), b->known[other]);
        fell &= ~hit;
    }
    return fell;
}

/* and crossings of switches that are fast enough: into the mode of the other side */
static INLINE M NAME(switches)(NAME(Batch) * b, M fell, V guard)
{
    V value[LANES_NG], rate[LANES_NG];
    NAME(Batch) sizes;
    if (LANES_SWITCHES == 0 || !NAME(any)(fell)) return fell;
    NAME(guard_line)(b, b->z, value, rate);
    for (int e = 0; e < LANES_FLOW; e++)
        sizes.flow[e] = NAME(size)(b->flow[e]);
    for (int i = 0; i < MODEL_NX; i++)
        sizes.constant[i] = NAME(size)(b->constant[i]);
    for (int j = 0; j < LANES_Z; j++)
        sizes.z[j] = NAME(size)(b->z[j]);
    for (int j = 0; j < LANES_HARMONICS; j++)
        sizes.wave[j] = NAME(fill)(0.0);
    for (int e = 0; e < LANES_GUARD_ENTRIES; e++)
        sizes.guard[e] = NAME(size)(b->guard[e]);
    for (int g = 0; g < LANES_GUARDS; g++)
        sizes.guard_constant[g] = NAME(fill)(0.0);
    V size[LANES_NG], held;
    EACH(held, b->mode[l]->held_count)
    const M free = held == NAME(fill)(0.0);
    NAME(guard_line)(&sizes, sizes.z, value, size);
    for (int g = 0; g < LANES_GUARDS; g++) {
        const int c = lanes_guard_contact[g];
        if (!lanes_surface[c] || lanes_sticks[c]) continue;
        const M hit = fell & free & (guard == NAME(fill)((double)g)) & (-rate[g] > NAME(fill)(LANES_ALONG) * size[g]);
        WHERE (hit) {
            signed char *state = &b->lane[l]->motion.state[c];
            *state = *state == CONTACT_SLIP_PLUS ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS;
            b->lane[l]->mode = b->mode[l]->with[c][*state == CONTACT_SLIP_MINUS];
            b->mode[l] = table_at(b->table[l], b->lane[l]->mode);
        }
        for (int other = 0; other < LANES_GUARDS; other++)
            b->known[other] = NAME(choose)(hit, NAME(none)() + (other == g), b->known[other]);
        fell &= ~hit;
    }
    return fell;
}

/* the event of guard g in lane l, which other rules than those of a batch decide */
static void NAME(happen)(Pool *pool, NAME(Batch) * b, int l, int g)
{
    Fall fall;
    Lane *lane = b->lane[l];
    const LaneTable *t = b->table[l];
    const int was_on_grid = b->mode[l]->on_grid;
    NAME(keep)(pool, b, l);
    const double before = t->h * lane->goal - lane->left;
    double time = before;
    for (int n = 0; n < pool->directions; n++)
        fall.later[n] = b->later[n][l];
    for (int j = 0; j < 2 * LANES_HARMONICS && pool->directions > 0; j++)
        fall.turn[j] = b->turn[j][l];
    const int told = lane_event(pool, b->slot[l], g, &time);
    if (pool->directions > 0 && told) tangents_jump(t, lane, &fall, pool->directions);
    lane->failed |= pool->directions > 0 && !told;
    NAME(fetch)(pool, b, l);
    if (b->mode[l]->on_grid != was_on_grid || time != before) NAME(go_to)(b, l, time);
}

/* a sub-step of some lanes in which some guard may fall */
static __attribute__((noinline)) void NAME(event)(Pool *pool, NAME(Batch) * b, M some)
{
    V y[LANES_ORDER + 1][LANES_Z];
    V q[LANES_NG][LANES_ORDER + 1];
    V guard;
    M undecided;
    const V h = NAME(least)(b->left, b->longest);
    NAME(expand)(b, h, y);
    NAME(guards)(b, y, LANES_ORDER, q);
    NAME(left_now)(b, q, some);
    for (int g = 0; g < LANES_GUARDS; g++) {
        NAME(deflate)(q[g], b->known[g]);
        b->known[g] &= ~some;
    }
    const V u = NAME(search)(q, some, &guard, &undecided);
    NAME(go)(b, y, h, u, some);
    NAME(vary)(b, NAME(pick)(some, h * u, NAME(fill)(0.0)), pool->directions);
    const M fell = some & ~undecided & (guard >= NAME(fill)(0.0));
    if (pool->directions > 0) undecided |= NAME(meet)(b, fell, guard, pool->directions);
    M special = NAME(switches)(b, NAME(impacts)(b, fell, guard, pool->directions), guard);
    const M stopped = NAME(stops)(b, special, guard);
    special &= ~stopped;
    if (LANES_SWITCHES > 0 && pool->directions > 0) NAME(gather_mode)(b);
    if (pool->directions > 0) NAME(leave)(b, fell & ~special, pool->directions);
    /* these go on at once */
    const M on = some & ~undecided & ~special & ~stopped & (b->left > NAME(fill)(0.0));
    const int odd = NAME(bits)(special);
    const int lost = NAME(bits)(undecided);
    WHERE (some & ~on) {
        b->lane[l]->rounds++;
        b->lane[l]->failed |= lost >> l & 1;
        if (odd >> l & 1) NAME(happen)(pool, b, l, (int)guard[l]);
        NAME(pass_on)(pool, b, l);
    }
    if (LANES_SWITCHES > 0 || NAME(any)(special)) NAME(gather_mode)(b);
    if (NAME(any)(on)) NAME(series)(pool, b, on);
}
