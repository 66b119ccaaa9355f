/*
 * Arithmetic in a host that has traps on: infinity stands for "never" in the engine, and compilers compute both sides of
 * a choice, or several numbers at once, before they look which is asked for. Both raise flags that mean nothing, and a
 * host that traps INVALID, DIVBYZERO or OVERFLOW would die of them. So traps rest while a function of the interface
 * works; afterwards traps and flags of the host are as they were. What is not finite is found where it is looked for,
 * and is an error with a message.
 *
 * Without a compiler that runs a function at the end of a scope, or a processor that traps, nothing is done.
 */
#pragma once

#if defined(__GNUC__) && (defined(__SSE2__) || defined(__x86_64__))

typedef unsigned Traps;

static inline Traps traps_rest(void)
{
    const unsigned NONE = 0x1f80;                  /* the mask bits of all six exceptions */
    const Traps before = __builtin_ia32_stmxcsr(); /* without xmmintrin.h, the longest of all headers */
    if ((before & NONE) != NONE) __builtin_ia32_ldmxcsr(before | NONE);
    return before;
}

static inline void traps_return(const Traps *before)
{
    const unsigned NONE = 0x1f80;
    if ((*before & NONE) != NONE) __builtin_ia32_ldmxcsr(*before);
}

#define TRAPS_REST const Traps traps __attribute__((cleanup(traps_return), unused)) = traps_rest()

#elif defined(__GNUC__) && defined(__aarch64__)

#include <fenv.h>

static inline fenv_t traps_rest(void)
{
    fenv_t before;
    feholdexcept(&before);
    return before;
}

static inline void traps_return(const fenv_t *before) { fesetenv(before); }

#define TRAPS_REST const fenv_t traps __attribute__((cleanup(traps_return), unused)) = traps_rest()

#else

#define TRAPS_REST (void)0

#endif
