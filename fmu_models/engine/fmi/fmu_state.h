/* Copies of the whole state of an instance that the importer keeps. */
#pragma once

#include "instance.h"

Status fmu_state_get(Instance *m, const char *function, void **state);
Status fmu_state_set(Instance *m, const char *function, void *state);
Status fmu_state_free(Instance *m, const char *function, void **state);
Status fmu_state_serialized_size(Instance *m, const char *function, void *state, size_t *size);
Status fmu_state_serialize(Instance *m, const char *function, void *state, unsigned char *bytes, size_t size);
Status fmu_state_deserialize(Instance *m, const char *function, const unsigned char *bytes, size_t size, void **state);
