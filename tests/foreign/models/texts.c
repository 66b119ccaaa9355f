/* x' = -x, and texts: an output echoes a parameter and says later that time went on; bytes are complemented then (FMI 3),
   a pair of texts is swapped (FMI 3). Counts its updates.
   One instance at a time. */
#define NX 1
#define NZ 0
#define NP 0
#define PARAMETERS 0.0
#define STARTS 1.0
#define CO_SIMULATION
#define TEXTS
#include "model.h"

#include <stdio.h>

enum { LABEL = 501, SAID, WORD, RAW, KEY, TOLD, NAMES, GREETINGS, LONGEST = 64 };

static char label[LONGEST], said[LONGEST], word[3 * LONGEST], names[2][LONGEST];
static unsigned char key[LONGEST], told[LONGEST];
static size_t length;

static void forget(void)
{
    strcpy(label, "pump");
    strcpy(said, "nothing");
    strcpy(names[0], "Ada");
    strcpy(names[1], "Bob");
    memcpy(key, "\1\0\2", length = 3);
}
static void derivatives(Model *m, double *dx) { dx[0] = -m->x[0]; }
static void indicators(Model *m, double *z) {}
static int update(Model *m)
{
    m->mode[0]++;
    return 0;
}
static void after_step(Model *m) {}
static int do_step(Model *m, double end)
{
    m->x[0] *= exp(m->t - end);
    m->t = end;
    return 0;
}
static const char *text(const Model *m, unsigned v)
{
    switch (v) {
    case LABEL: return label;
    case WORD: snprintf(word, sizeof word, m->t < 0.5 ? "%s, %s" : "%s, %s, später", label, said); return word;
    case RAW: return m->t < 0.5 ? "a\xff" : NULL;
    }
    return NULL;
}
static STATUS set_text(char *target, const char *value)
{
    if (strlen(value) >= LONGEST) return FAILED;
    strcpy(target, value);
    return OK;
}

#if FMI < 3
#if FMI == 1
#define STRING_FUNCTION(Name) F1(STATUS, Name)
#else
#define STRING_FUNCTION(Name) STATUS NAME(Name)
#endif
STRING_FUNCTION(GetString)(void *c, const REFERENCE *v, size_t n, const char **values)
{
    for (size_t i = 0; i < n; i++)
        values[i] = text(c, v[i]);
    return OK;
}
STRING_FUNCTION(SetString)(void *c, const REFERENCE *v, size_t n, const char *const *values)
{
    return set_text(v[0] == LABEL ? label : said, values[0]);
}
#else
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference *v, size_t n, fmi3String *values, size_t m)
{
    if (v[0] == GREETINGS && m == 2) {
        values[0] = names[1];
        values[1] = names[0];
    } else {
        values[0] = text(c, v[0]);
    }
    return fmi3OK;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference *v, size_t n, const fmi3String *values, size_t m)
{
    if (v[0] == NAMES) return m == 2 && set_text(names[0], values[0]) == OK ? set_text(names[1], values[1]) : FAILED;
    return set_text(v[0] == LABEL ? label : said, values[0]);
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference *v, size_t n, size_t *sizes, fmi3Binary *values,
                         size_t m)
{
    for (size_t i = 0; i < length; i++)
        told[i] = ((Model *)c)->t < 0.5 ? key[i] : (unsigned char)~key[i];
    *sizes = length;
    *values = told;
    return v[0] == TOLD ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference *v, size_t n, const size_t *sizes,
                         const fmi3Binary *values, size_t m)
{
    if (v[0] != KEY || *sizes > LONGEST) return fmi3Error;
    memcpy(key, *values, length = *sizes);
    return fmi3OK;
}
#endif
