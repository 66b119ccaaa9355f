/* Vectors of LANES_W numbers, and masks of them; included once per target, like lane_code.h, which undefines their names. */
#define LANES_BYTES (8 * LANES_W)

typedef double NAME(V) __attribute__((vector_size(LANES_BYTES), aligned(LANES_BYTES)));
typedef int64_t NAME(M) __attribute__((vector_size(LANES_BYTES), aligned(LANES_BYTES)));
#define V NAME(V)
#define M NAME(M)
#define INLINE inline __attribute__((always_inline))
/* every lane l of a vector from a value of its own */
#define EACH(v, value)                                                                                                 \
    for (int l = 0; l < LANES_W; l++) {                                                                                \
        (v)[l] = (value);                                                                                              \
    }
/* column l of a vector array */
#define COLUMN(values, n, l, out)                                                                                      \
    for (int i_ = 0; i_ < (n); i_++) {                                                                                 \
        (out)[i_] = AT((values)[i_], l);                                                                               \
    }
/* lane l of a vector in memory */
#define AT(v, l) (((NAME(Number) *)(void *)&(v))[l])
#define MARK(m, l) (((NAME(Sign) *)(void *)&(m))[l])

typedef double NAME(Number) __attribute__((may_alias));
typedef int64_t NAME(Sign) __attribute__((may_alias));

static INLINE V NAME(fill)(double a)
{
    V v;
    for (int l = 0; l < LANES_W; l++) {
        v[l] = a;
    }
    return v;
}

static INLINE V NAME(pick)(M m, V a, V b) { return (V)(((M)a & m) | ((M)b & ~m)); }

static INLINE V NAME(size)(V a)
{
    const V zero = NAME(fill)(-0.0);
    return (V)((M)a & ~(M)zero);
}

static INLINE V NAME(least)(V a, V b) { return NAME(pick)(a < b, a, b); }

static INLINE V NAME(most)(V a, V b) { return NAME(pick)(a > b, a, b); }

static INLINE int NAME(any)(M m)
{
#if LANES_REDUCE
    return __builtin_reduce_or(m) != 0;
#else
    int64_t found = 0;
    for (int l = 0; l < LANES_W; l++) {
        found |= m[l];
    }
    return found != 0;
#endif
}
