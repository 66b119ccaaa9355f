/* A library of FMI 1.0 behind the functions of FMI 2.0. Value references from first_made on are none of the library's:
   variables that its description means without giving them one. */
#pragma once

#include "master.h"

/* minus another variable (not, of a Boolean); a state; its derivative */
typedef enum { MADE_NEGATED, MADE_STATE, MADE_RATE } MadeKind;

typedef struct {
    int32_t kind;    /* MadeKind */
    uint32_t source; /* value reference of the other variable; number of the state in the order of the description */
} Made;

/* an instance; functions of the library by their names, NULL where it has none */
typedef struct {
    int64_t n_states, first_made, n_made;
    const uint32_t *states; /* (n_states): value references in the order of the description; made: not told there */
    const Made *made;
    uint32_t *told_states; /* (n_states): those that the library says */
    int64_t *order;        /* (n_states): number in the description of each state of the library */
    double *vector, *room; /* (n_states) */
    Log *log;
    void *component;
    int64_t slave, initializing;
    int64_t moved;  /* the library has the states in another order */
    int64_t told;   /* info is what the next update says */
    double info[2]; /* fmi1EventInfo */
    double start, stop, tolerance;
    void *InstantiateModel, *FreeModelInstance, *Initialize, *EventUpdate, *CompletedIntegratorStep, *SetTime;
    void *SetContinuousStates, *GetContinuousStates, *GetDerivatives, *GetEventIndicators, *GetNominalContinuousStates;
    void *GetStateValueReferences, *Terminate, *InstantiateSlave, *FreeSlaveInstance, *InitializeSlave, *TerminateSlave;
    void *DoStep, *GetRealStatus, *SetRealInputDerivatives, *GetRealOutputDerivatives;
    void *GetReal, *GetInteger, *GetBoolean, *GetString, *SetReal, *SetInteger, *SetBoolean, *SetString;
} Adapter;
