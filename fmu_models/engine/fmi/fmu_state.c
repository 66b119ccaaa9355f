/*
 * FMU states of an instance (FMI: get, set and free FMU state). A state handed out stays on a list of its instance, so
 * that a pointer which was never handed out, or was freed already, is refused instead of followed. Serialised, it is a
 * header that says of what build and how long it is, and a checksum: bytes of another model or damaged ones are
 * refused.
 */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "fmu_state.h"

typedef struct {
    char magic[8];
    uint64_t size, token, checksum;
} Header;

static const char state_magic[8] = "STICKSL";

/* of a core, what is a state */
#define STATE_SIZE offsetof(Core, run.linear)

/* FNV-1a */
static uint64_t digest(const void *bytes, size_t size)
{
    const unsigned char *byte = bytes;
    uint64_t hash = 14695981039346656037u;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ byte[i]) * 1099511628211u;
    return hash;
}

/* the place that points to a state of this instance, or NULL */
static FmuState **find(Instance *m, const void *state)
{
    for (FmuState **link = &m->fmu_states; *link; link = &(*link)->next)
        if (*link == state) return link;
    return NULL;
}

static Status no_such_state(Instance *m, const char *function)
{
    return instance_refuse(m, "%s: the FMU state is not one of this instance, or was freed", function);
}

static FmuState *keep(Instance *m, void **state)
{
    FmuState **link = *state ? find(m, *state) : NULL;
    if (link) return *link;
    FmuState *copy = calloc(1, sizeof *copy);
    if (!copy) return NULL;
    copy->next = m->fmu_states;
    m->fmu_states = copy;
    *state = copy;
    return copy;
}

Status fmu_state_get(Instance *m, const char *function, void **state)
{
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    if (instance_array(m, state, 1, function, "FMU state")) return STATUS_ERROR;
    if (*state && !find(m, *state)) return no_such_state(m, function);
    FmuState *copy = keep(m, state);
    if (!copy) return instance_refuse(m, "%s: out of memory", function);
    memcpy(&copy->core, &m->core, STATE_SIZE);
    return STATUS_OK;
}

Status fmu_state_set(Instance *m, const char *function, void *state)
{
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    FmuState **link = find(m, state);
    if (!link) return no_such_state(m, function);
    if ((*link)->core.co_simulation != m->core.co_simulation)
        return instance_refuse(m, "%s: a state of Model Exchange does not fit Co-Simulation, nor the other way round",
                               function);
    memcpy(&m->core, &(*link)->core, STATE_SIZE);
    m->core.run.linear_known = 0;
    return STATUS_OK;
}

Status fmu_state_free(Instance *m, const char *function, void **state)
{
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    if (!state || !*state) return STATUS_OK;
    FmuState **link = find(m, *state);
    if (!link) return no_such_state(m, function);
    FmuState *copy = *link;
    *link = copy->next;
    free(copy);
    *state = NULL;
    return STATUS_OK;
}

Status fmu_state_serialized_size(Instance *m, const char *function, void *state, size_t *size)
{
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    if (instance_array(m, size, 1, function, "size")) return STATUS_ERROR;
    if (!find(m, state)) return no_such_state(m, function);
    *size = sizeof(Header) + STATE_SIZE;
    return STATUS_OK;
}

Status fmu_state_serialize(Instance *m, const char *function, void *state, unsigned char *bytes, size_t size)
{
    Header header = {{0}, STATE_SIZE, 0, 0};
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    if (instance_array(m, bytes, 1, function, "serialized state")) return STATUS_ERROR;
    FmuState **link = find(m, state);
    if (!link) return no_such_state(m, function);
    if (size < sizeof(Header) + STATE_SIZE)
        return instance_refuse(m, "%s: %zu bytes given, %zu needed", function, size, sizeof(Header) + STATE_SIZE);
    memcpy(header.magic, state_magic, sizeof header.magic);
    header.token = digest(MODEL_TOKEN, sizeof MODEL_TOKEN);
    header.checksum = digest(&(*link)->core, STATE_SIZE);
    memcpy(bytes, &header, sizeof header);
    memcpy(bytes + sizeof header, &(*link)->core, STATE_SIZE);
    return STATUS_OK;
}

Status fmu_state_deserialize(Instance *m, const char *function, const unsigned char *bytes, size_t size, void **state)
{
    Header header;
    if (instance_enter(m, PHASES_SETTABLE, function)) return STATUS_ERROR;
    if (instance_array(m, bytes, 1, function, "serialized state")) return STATUS_ERROR;
    if (instance_array(m, state, 1, function, "FMU state")) return STATUS_ERROR;
    if (size < sizeof(Header) + STATE_SIZE)
        return instance_refuse(m, "%s: %zu bytes given, a state of this model has %zu", function, size,
                               sizeof(Header) + STATE_SIZE);
    memcpy(&header, bytes, sizeof header);
    if (memcmp(header.magic, state_magic, sizeof header.magic) != 0 || header.size != STATE_SIZE
        || header.token != digest(MODEL_TOKEN, sizeof MODEL_TOKEN))
        return instance_refuse(m, "%s: the bytes are not a state of this build of " MODEL_NAME, function);
    if (header.checksum != digest(bytes + sizeof header, STATE_SIZE))
        return instance_refuse(m, "%s: the bytes were damaged: their checksum is wrong", function);
    *state = NULL; /* by the standard the importer passes no state of its own here */
    FmuState *copy = keep(m, state);
    if (!copy) return instance_refuse(m, "%s: out of memory", function);
    memcpy(&copy->core, bytes + sizeof header, STATE_SIZE);
    return STATUS_OK;
}
