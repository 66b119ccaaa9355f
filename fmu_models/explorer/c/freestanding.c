/*
 * What the engine asks of a C library, where there is none: in a page. A library for WebAssembly would have to be built
 * before the first page, in half a minute, for a dozen functions; these have the meaning of the standard (C11, 7.21 to
 * 7.24), for what the engine asks of them.
 *
 *     memory    zeros from the end of what the module holds, never given back: it is asked for once, before the first run
 *     text      %s, %d, %u, %e and %g, with a precision, without a width. A number m 2^e is n 10^min(e, 0) with a whole
 *               n = m 2^e or m 5^-e, of which all digits are known, so that rounding is exact, ties to even
 */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    WORDS = 120, /* of nine digits: the smallest number has 751 digits, 5^1074 */
    DIGITS = 9 * WORDS,
    PAGE = 65536 /* bytes by which memory grows */
};

double ldexp(double x, int n)
{
    /* powers of two that are numbers themselves, the last of which rounds once */
    for (; n > 1023; n -= 1023)
        x *= 0x1p1023;
    for (; n < -1022; n += 969)
        x *= 0x1p-969;
    const union {
        uint64_t bits;
        double value;
    } power = {.bits = (uint64_t)(n + 1023) << 52};
    return x * power.value;
}

double frexp(double x, int *n)
{
    union {
        double value;
        uint64_t bits;
    } number = {.value = x};
    *n = 0;
    if (x == 0.0 || !isfinite(x)) return x;
    if (fabs(x) < DBL_MIN) {
        number.value *= 0x1p54;
        *n = -54;
    }
    *n += (int)(number.bits >> 52 & 2047) - 1022;
    number.bits = (number.bits & ~(2047ull << 52)) | 1022ull << 52;
    return number.value;
}

/* or a compiler would see that the loop is strlen, and call it */
__attribute__((no_builtin)) size_t strlen(const char *text)
{
    size_t n = 0;
    while (text[n])
        n++;
    return n;
}

int strcmp(const char *a, const char *b)
{
    while (*a && *a == *b)
        a++, b++;
    return (unsigned char)*a - (unsigned char)*b;
}

/* a compiler compares a few numbers without it, but not the speeds of nine coordinates */
int memcmp(const void *a, const void *b, size_t size)
{
    const unsigned char *one = a, *other = b;
    for (; size; size--, one++, other++)
        if (*one != *other) return *one - *other;
    return 0;
}

void *memchr(const void *room, int wanted, size_t size)
{
    const unsigned char *at = room;
    for (; size; size--, at++)
        if (*at == (unsigned char)wanted) return (void *)(uintptr_t)at;
    return NULL;
}

#if defined(__wasm__)
void *calloc(size_t count, size_t size)
{
    extern unsigned char __heap_base;
    static uintptr_t next, end;
    if (!next) {
        next = (uintptr_t)&__heap_base;
        end = __builtin_wasm_memory_size(0) * PAGE;
    }
    if (size && count > (SIZE_MAX / 2) / size) return NULL;
    const uintptr_t begin = (next + 15) & ~(uintptr_t)15, wanted = begin + count * size;
    if (wanted > end) {
        const size_t pages = (wanted - end + PAGE - 1) / PAGE;
        if (__builtin_wasm_memory_grow(0, pages) == SIZE_MAX) return NULL;
        end += pages * PAGE;
    }
    next = wanted;
    return (void *)begin; /* memory is made of zeros, and none of it comes twice */
}

void free(void *room) { (void)room; }
#endif

/* text that is kept as far as there is room */
typedef struct {
    char *at;
    size_t room, length;
} Sink;

static void put(Sink *sink, const char *text, size_t size)
{
    for (size_t i = 0; i < size; i++)
        if (sink->length++ + 1 < sink->room) sink->at[sink->length - 1] = text[i];
}

static void put_character(Sink *sink, char c) { put(sink, &c, 1); }

static void put_whole(Sink *sink, unsigned long long value, int least)
{
    char digits[24];
    int n = sizeof digits;
    for (; value || least > 0; value /= 10, least--)
        digits[--n] = (char)('0' + value % 10);
    put(sink, digits + n, sizeof digits - (size_t)n);
}

/* digits of a positive number, of which the first is not zero; returns their count, and by place the power of ten of the
   first */
static int decimals(double value, char *digits, int *place)
{
    uint32_t words[WORDS];
    int e, n = 0;
    uint64_t m = (uint64_t)ldexp(frexp(value, &e), 53);
    for (e -= 53; !(m & 1); e++)
        m >>= 1;
    for (; m; m /= 1000000000)
        words[n++] = (uint32_t)(m % 1000000000);
    for (int k = 0; k < abs(e); k++) {
        uint64_t carry = 0;
        for (int i = 0; i < n; i++) {
            carry += (uint64_t)words[i] * (e < 0 ? 5 : 2);
            words[i] = (uint32_t)(carry % 1000000000);
            carry /= 1000000000;
        }
        if (carry) words[n++] = (uint32_t)carry;
    }
    int count = 0;
    for (int i = n - 1; i >= 0; i--)
        for (uint32_t unit = 100000000; unit; unit /= 10) {
            const char digit = (char)('0' + words[i] / unit % 10);
            if (count || digit != '0') digits[count++] = digit;
        }
    *place = count - 1 + (e < 0 ? e : 0);
    return count;
}

/* to so many digits, at least one, the last rounded, ties to even; place as before */
static void rounded(char *digits, int count, int kept, int *place)
{
    if (kept >= count) {
        memset(digits + count, '0', (size_t)(kept - count));
        return;
    }
    int up = digits[kept] > '5' || (digits[kept] == '5' && (digits[kept - 1] & 1));
    for (int i = kept + 1; digits[kept] == '5' && i < count && !up; i++)
        up = digits[i] != '0';
    int i = kept - 1;
    for (; up && i >= 0 && digits[i] == '9'; i--)
        digits[i] = '0';
    if (up && i >= 0) digits[i]++;
    if (up && i < 0) {
        digits[0] = '1';
        ++*place;
    }
}

/* as %e, or as %g */
static void put_number(Sink *sink, double value, int precision, int general)
{
    char digits[DIGITS + 32];
    int place = 0, kept = precision < 0 ? 6 : precision > 30 ? 30 : precision;
    if (!general) kept++;
    if (!kept) kept = 1;
    if (signbit(value)) put_character(sink, '-');
    if (!isfinite(value)) {
        put(sink, isnan(value) ? "nan" : "inf", 3);
        return;
    }
    memset(digits, '0', (size_t)kept);
    if (value != 0.0) rounded(digits, decimals(fabs(value), digits, &place), kept, &place);
    const int powers = !general || place < -4 || place >= kept, before = powers || place < 0 ? 1 : place + 1;
    while (general && kept > 1 && (kept > before || place < 0) && digits[kept - 1] == '0')
        kept--;
    if (!powers && place < 0) {
        put(sink, "0.0000", (size_t)(1 - place));
        put(sink, digits, (size_t)kept);
    } else {
        put(sink, digits, (size_t)before);
        if (kept > before) put_character(sink, '.');
        if (kept > before) put(sink, digits + before, (size_t)(kept - before));
    }
    if (!powers) return;
    put(sink, place < 0 ? "e-" : "e+", 2);
    put_whole(sink, (unsigned long long)abs(place), 2);
}

int vsnprintf(char *text, size_t room, const char *format, va_list given)
{
    Sink sink = {text, room, 0};
    for (; *format; format++) {
        if (*format != '%') {
            put_character(&sink, *format);
            continue;
        }
        int precision = -1, longs = 0;
        if (*++format == '.')
            for (precision = 0, format++; *format >= '0' && *format <= '9'; format++)
                precision = 10 * precision + *format - '0';
        for (; *format == 'l' || *format == 'z'; format++)
            longs += *format == 'l' ? 1 : (int)(sizeof(size_t) / sizeof(long));
        if (*format == 's') {
            const char *part = va_arg(given, const char *);
            const char *end = precision < 0 ? NULL : memchr(part, 0, (size_t)precision);
            put(&sink, part, end ? (size_t)(end - part) : precision < 0 ? strlen(part) : (size_t)precision);
        } else if (*format == 'd') {
            const long long value = longs > 1 ? va_arg(given, long long)
                                    : longs   ? va_arg(given, long)
                                              : va_arg(given, int);
            if (value < 0) put_character(&sink, '-');
            put_whole(&sink, value < 0 ? 0ull - (unsigned long long)value : (unsigned long long)value, 1);
        } else if (*format == 'u') {
            put_whole(&sink,
                      longs > 1 ? va_arg(given, unsigned long long)
                      : longs   ? va_arg(given, unsigned long)
                                : va_arg(given, unsigned),
                      1);
        } else if (*format == 'g' || *format == 'e') {
            put_number(&sink, va_arg(given, double), precision, *format == 'g');
        } else {
            put_character(&sink, *format); /* %% */
        }
    }
    if (room) text[sink.length < room ? sink.length : room - 1] = 0;
    return (int)sink.length;
}

int snprintf(char *text, size_t room, const char *format, ...)
{
    va_list given;
    va_start(given, format);
    const int length = vsnprintf(text, room, format, given);
    va_end(given);
    return length;
}
