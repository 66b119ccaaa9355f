/*
 * One stepper per width of vectors, and which this processor has. The library is built once for all processors of a
 * kind; functions of a target are only called where CPUID, and the system by XCR0, say that its registers are there.
 */
#include "lane_event.h"
#include "lane_grid.h"
#include "lane_modes.h"

#if defined(__x86_64__)
#define LANES_X86 1
#include <cpuid.h>
#else
#define LANES_X86 0
#endif

/* clang and gcc say the same in words of their own */
#if defined(__clang__)
#define LANES_UNROLL _Pragma("unroll")
#define LANES_TARGET(names)                                                                                            \
    _Pragma(LANES_TEXT(clang attribute push(__attribute__((target(names))), apply_to = function)))
#define LANES_TARGET_END _Pragma("clang attribute pop")
#else
#define LANES_UNROLL _Pragma("GCC unroll 32")
#define LANES_TARGET(names) _Pragma("GCC push_options") _Pragma(LANES_TEXT(GCC target(names)))
#define LANES_TARGET_END _Pragma("GCC pop_options")
#endif
#define LANES_TEXT(x) #x

#define LANES_W 1
#define NAME(x) x##_1
#include "lane_code.h"

#define LANES_W 2
#define NAME(x) x##_2
#include "lane_code.h"

#if LANES_X86
LANES_TARGET("avx2")
#define LANES_W 4
#define NAME(x) x##_4
#include "lane_code.h"
LANES_TARGET_END
LANES_TARGET("avx512f,avx512dq,avx512vl")
#define LANES_W 8
#define NAME(x) x##_8
#include "lane_code.h"
LANES_TARGET_END
#endif

/* lanes of the widest vectors that processor and system have */
static int widest(void)
{
#if LANES_X86
    unsigned a, b, c, d, low, high;
    const unsigned AVX = 0x6, AVX512 = 0xe6; /* registers that the system keeps */
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_OSXSAVE)) return 2;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & AVX) != AVX || !__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(b & bit_AVX2)) return 2;
    const unsigned wanted = bit_AVX512F | bit_AVX512DQ | bit_AVX512VL;
    return (low & AVX512) == AVX512 && (b & wanted) == wanted ? 8 : 4;
#else
    return 2;
#endif
}

typedef struct {
    int64_t tables, lanes, queue[QUEUES], columns, used;
} Layout;

static Layout layout(int64_t motions, int64_t width, int64_t group)
{
    Layout l = {0};
    const int64_t groups = (motions + width - 1) / width;
    l.used = ((int64_t)sizeof(Pool) + 63) / 64 * 64;
    l.tables = pool_reserve(&l.used, motions * (int64_t)sizeof(LaneTable));
    l.lanes = pool_reserve(&l.used, motions * (int64_t)sizeof(Lane));
    for (int q = 0; q < QUEUES; q++)
        l.queue[q] = pool_reserve(&l.used, groups * width * (int64_t)sizeof(int32_t));
    l.columns = pool_reserve(&l.used, groups * group);
    return l;
}

static void open_pool(void *room, int64_t motions, int64_t width, int64_t group)
{
    const Layout l = layout(motions, width, group);
    Pool *pool = room;
    char *base = room;
    pool->motions = motions;
    pool->tables = (LaneTable *)(void *)(base + l.tables);
    pool->lanes = (Lane *)(void *)(base + l.lanes);
    for (int q = 0; q < QUEUES; q++)
        pool->queue[q] = (Queue){0, (int32_t *)(void *)(base + l.queue[q])};
    pool->columns = (double *)(void *)(base + l.columns);
    for (int64_t i = 0; i < motions; i++) {
        pool->tables[i].usable = 0;
        pool->tables[i].steps = 0;
        pool->lanes[i].settled = 0;
        pool->lanes[i].failed = 1; /* it is in no mode */
    }
}

/* the same numbers as before, of this slot or of the one before it, need no table */
static int is_table_of(const LaneTable *t, const double *p, const double *u, double period)
{
    return t->steps > 0 && t->period == period && memcmp(t->p, p, MODEL_NP * sizeof *p) == 0
           && memcmp(t->u, u, MODEL_NU * sizeof *u) == 0;
}

static int place(void *room, int64_t slot, const double *p, const double *u, double period)
{
    Pool *pool = room;
    LaneTable *t = &pool->tables[slot];
    if (is_table_of(t, p, u, period)) return t->usable;
    pool->lanes[slot].settled = 0;
    t->steps = 0;
    if (slot > 0 && is_table_of(t - 1, p, u, period)) {
        memcpy(t, t - 1, sizeof *t);
        return t->usable;
    }
    return table_make(t, p, u, period);
}

#define STEPPER(width)                                                                                                 \
    static int64_t room_##width(int64_t motions) { return layout(motions, width, group_bytes_##width()).used; }        \
    static void open_##width(void *room, int64_t motions)                                                              \
    {                                                                                                                  \
        open_pool(room, motions, width, group_bytes_##width());                                                        \
        clear_groups_##width(room);                                                                                    \
    }                                                                                                                  \
    static int64_t step_##width(void *room, LaneMotion *motions, int64_t periods, double bound, int64_t directions,    \
                                double *tangents, double *growth, LaneResolve resolve, void *context)                  \
    {                                                                                                                  \
        Pool *pool = room;                                                                                             \
        int64_t made = 1;                                                                                              \
        pool->bound = bound;                                                                                           \
        pool->directions = directions;                                                                                 \
        pool->tangents = tangents;                                                                                     \
        pool->growth = growth;                                                                                         \
        pool->resolve = resolve;                                                                                       \
        pool->context = context;                                                                                       \
        for (int64_t slot = 0; slot < pool->motions; slot++)                                                           \
            motions[slot].made = 0;                                                                                    \
        while (period_##width(pool, motions) && made < periods)                                                        \
            made++;                                                                                                    \
        return made;                                                                                                   \
    }                                                                                                                  \
    static const LaneStepper stepper_##width = {LANE_STEPPER_VERSION, MODEL_TOKEN, width,       room_##width,          \
                                                open_##width,         place,       step_##width};

STEPPER(1)
STEPPER(2)
#if LANES_X86
STEPPER(4)
STEPPER(8)
#endif

#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
const void *stickslip_lanes(int64_t width);

/* the stepper with so many lanes, 0: as many as this processor has; NULL where it has not so many */
const void *stickslip_lanes(int64_t width)
{
    const int most = widest();
    switch (width == 0 ? most : width <= most ? width : -1) {
    case 1: return &stepper_1;
    case 2: return &stepper_2;
#if LANES_X86
    case 4: return &stepper_4;
    case 8: return &stepper_8;
#endif
    default: return NULL;
    }
}
