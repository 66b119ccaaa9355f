/* Vectors of LANES_W numbers, and masks of them; included once per target by lane_code.h, which undefines their names. */
typedef double NAME(V) __attribute__((ext_vector_type(LANES_W)));
typedef int64_t NAME(M) __attribute__((ext_vector_type(LANES_W)));
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
/* lane l of a vector in memory */
#define AT(v, l) (((NAME(Number) *)(void *)&(v))[l])

typedef double NAME(Number) __attribute__((may_alias));

static INLINE V NAME(fill)(double a) { return (V)a; }

static INLINE V NAME(pick)(M m, V a, V b) { return m ? a : b; }

static INLINE V NAME(size)(V a) { return __builtin_elementwise_abs(a); }

static INLINE V NAME(least)(V a, V b) { return a < b ? a : b; }

static INLINE V NAME(most)(V a, V b) { return a > b ? a : b; }

static INLINE int NAME(any)(M m) { return __builtin_reduce_or(m) != 0; }

static INLINE M NAME(none)(void) { return (M)(int64_t)0; }
