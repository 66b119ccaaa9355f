/* Vectors of LANES_W numbers, and masks of them; included once per target by lane_code.h, which undefines their names. */
typedef double NAME(V) __attribute__((vector_size(8 * LANES_W)));
typedef int64_t NAME(M) __attribute__((vector_size(8 * LANES_W)));
#define V NAME(V)
#define M NAME(M)
#define INLINE inline __attribute__((always_inline))
/* every lane l of a vector from a value of its own */
#define EACH(vector, value)                                                                                            \
    {                                                                                                                  \
        V each_ = NAME(fill)(0.0);                                                                                     \
        for (int l = 0; l < LANES_W; l++) {                                                                            \
            each_[l] = (value);                                                                                        \
        }                                                                                                              \
        (vector) = each_;                                                                                              \
    }
/* a statement for every lane l of a mask: those beside it cost no branch */
#define WHERE(mask)                                                                                                    \
    for (int l = 0, left_ = NAME(bits)(mask); left_ && (l = __builtin_ctz((unsigned)left_), 1); left_ &= left_ - 1)
/* lane l of a vector in memory */
#define AT(v, l) (((NAME(Number) *)(void *)&(v))[l])

typedef double NAME(Number) __attribute__((may_alias));

/* less a zero: the sign of a zero stays */
static INLINE V NAME(fill)(double a) { return a - (V){0.0}; }

static INLINE M NAME(choose)(M m, M a, M b) { return (a & m) | (b & ~m); }

static INLINE V NAME(pick)(M m, V a, V b) { return (V)NAME(choose)(m, (M)a, (M)b); }

static INLINE V NAME(size)(V a) { return (V)((M)a & INT64_MAX); }

static INLINE V NAME(least)(V a, V b) { return NAME(pick)(a < b, a, b); }

static INLINE V NAME(most)(V a, V b) { return NAME(pick)(a > b, a, b); }

static INLINE V NAME(root_of)(V a)
{
#if __has_builtin(__builtin_elementwise_sqrt)
    return __builtin_elementwise_sqrt(a);
#else
    V root;
    EACH(root, sqrt(a[l]))
    return root;
#endif
}

static INLINE int NAME(any)(M m)
{
    int64_t bits = 0;
    for (int l = 0; l < LANES_W; l++)
        bits |= m[l];
    return bits != 0;
}

/* a bit for each lane of a mask */
static INLINE int NAME(bits)(M m)
{
#if LANES_X86 && LANES_W == 8
    return (unsigned char)__builtin_ia32_cvtq2mask512((__attribute__((vector_size(64))) long long)m);
#elif LANES_X86 && LANES_W == 4
    return __builtin_ia32_movmskpd256((V)m);
#else
    int bits = 0;
    for (int l = 0; l < LANES_W; l++)
        bits |= (int)m[l] & 1 << l;
    return bits;
#endif
}

static INLINE M NAME(none)(void) { return (M){0}; }
