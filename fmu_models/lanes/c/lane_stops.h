/* Bounds of stops that are met, let go or left, in all lanes of a batch; included once per target by lane_code.h. */
/* values of the guards of a batch, and their rates along the flow */
static INLINE void NAME(guard_line)(const NAME(Batch) * b, const V *z, V *value, V *rate)
{
    V along[LANES_Z];
    NAME(rates)(b, z, along);
    for (int g = 0; g < LANES_GUARDS; g++) {
        value[g] = b->guard_constant[g];
        rate[g] = NAME(fill)(0.0);
    }
    LANES_GUARD_SUMS(b->guard, z, value);
    LANES_GUARD_SUMS(b->guard, along, rate);
}

/* of stops that have just been entered: they are at their bounds exactly, where the origin of the mode lies there */
static INLINE void NAME(place_on_bound)(NAME(Batch) * b, M entered, V guard)
{
    for (int g = 0; g < LANES_GUARDS; g++) {
        V depth = NAME(fill)(0.0);
        V size = NAME(fill)(0.0);
        const M some = entered & (guard == NAME(fill)((double)g));
        if (!lanes_compliant[lanes_guard_contact[g]] || !NAME(any)(some)) continue;
        for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++) {
            if (lanes_guard_column[e] >= MODEL_NQ) continue;
            size += b->guard[e] * b->guard[e];
            depth += b->guard[e] * b->z[lanes_guard_column[e]];
        }
        const V along = NAME(pick)(some, depth / size, NAME(fill)(0.0));
        for (int e = lanes_guard_first[g]; e < lanes_guard_first[g + 1]; e++)
            if (lanes_guard_column[e] < MODEL_NQ) b->z[lanes_guard_column[e]] -= along * b->guard[e];
    }
}

/* away from home nothing is to be done at the points of the grid: what lane l goes to in its new mode, at a time */
static INLINE void NAME(go_to)(NAME(Batch) * b, int l, double time)
{
    Lane *lane = b->lane[l];
    const LaneTable *t = b->table[l];
    const int next = (int)(time / t->h) + 1;
    lane->goal = b->mode[l]->on_grid && next < t->steps ? next : t->steps;
    AT(b->left, l) = fmax(t->h * lane->goal - time, 0.0);
}

/* guards of stops that fall in some lanes, where no force holds a contact: those lanes, in their next modes */
static INLINE M NAME(stops)(NAME(Batch) * b, M some, V guard)
{
    V value[LANES_NG], rate[LANES_NG], held, from[MODEL_NX], walled;
    M hit = NAME(none)();
    M entered = NAME(none)();
    for (int g = 0; g < LANES_GUARDS; g++)
        if (lanes_compliant[lanes_guard_contact[g]]) hit |= some & (guard == NAME(fill)((double)g));
    if (!LANES_STOPS || !NAME(any)(hit)) return NAME(none)();
    EACH(held, b->mode[l]->held_count)
    hit &= held == NAME(fill)(0.0);
    NAME(guard_line)(b, b->z, value, rate);
    for (int i = 0; i < MODEL_NX; i++)
        EACH(from[i], b->mode[l]->shift[i])
    WHERE (hit) {
        Lane *lane = b->lane[l];
        const int g = (int)guard[l];
        const int n = lanes_guard_slot[g] == GUARD_TANGENTIAL ? g - 1 : g;
        const int away = lane->motion.state[lanes_guard_contact[g]] == CONTACT_AWAY;
        const int was_on_grid = b->mode[l]->on_grid;
        const double sign = away ? -1.0 : 1.0;
        const double time = b->table[l]->h * lane->goal - b->left[l];
        lane_stop(b->table[l], lane, g, sign * value[n][l], sign * rate[n][l], time);
        b->mode[l] = &b->table[l]->mode[lane->mode];
        entered[l] = -away;
        if (b->mode[l]->on_grid != was_on_grid) NAME(go_to)(b, l, time);
        for (int e = 0; e < LANES_GUARDS; e++)
            b->known[e][l] = lane->known[e];
    }
    NAME(gather_mode)(b);
    for (int i = 0; i < MODEL_NX; i++) {
        V to;
        EACH(to, b->mode[l]->shift[i])
        b->z[i] = NAME(pick)(hit, (b->z[i] + from[i]) - to, b->z[i]);
    }
    EACH(walled, b->mode[l]->walled)
    NAME(place_on_bound)(b, entered & (walled != NAME(fill)(0.0)), guard);
    return hit;
}
