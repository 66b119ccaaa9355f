"""A library of FMI 1.0 as one of FMI 2.0: the functions of ``c/fmi1.c``, which call those of the library."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from typing import Any

import numpy as np

from fmu_models.codegen.c_structures import declarations
from fmu_models.fmu.fmu import Fmu

_C = declarations("importer/c/master.h", "importer/c/fmi1.h")
KIND = _C.constants("MadeKind", "MADE_")
MADE = np.dtype(_C.structure("Made"))
Adapter = _C.structure("Adapter")
# names in FMI 1.0 where they differ from those of FMI 2.0: in Model Exchange, in Co-Simulation
NAMES = {
    "Instantiate": ("InstantiateModel", "InstantiateSlave"),
    "FreeInstance": ("FreeModelInstance", "FreeSlaveInstance"),
    **dict.fromkeys(("EnterInitializationMode", "ExitInitializationMode"), ("Initialize", "InitializeSlave")),
    "SetupExperiment": ("SetTime", "InitializeSlave"),
    **dict.fromkeys(("EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode"), ("EventUpdate", "EventUpdate")),
    "GetNominalsOfContinuousStates": ("GetNominalContinuousStates", "GetNominalContinuousStates"),
    "Terminate": ("Terminate", "TerminateSlave"),
}


def called(fmu: Fmu, name: str) -> str:
    """The function of an FMU by its name in the FMI that it is called by, without prefix; as its standard has it."""
    if not fmu.adapted:
        return f"fmi{fmu.fmi}{name}"
    return f"fmi{NAMES.get(name, (name, name))[fmu.description.coSimulation is not None]}"


class Library1(ctypes.CDLL):
    """The library ``file`` of an FMU 1.0, whose functions go by their names in FMI 2.0; ``master`` has ``c/fmi1.c``."""

    def __init__(self, file: str, fmu: Fmu, identifier: str, master: ctypes.CDLL) -> None:
        self._fmu, self._prefix, self._master = fmu, f"{identifier}_", master
        super().__init__(file)
        states = [u.variable.derivative for u in fmu.description.derivatives if u.variable]
        added = [v for v in fmu.variables.values() if v.alias is not None or v.sourceline is None]
        rows = [
            (KIND.NEGATED, v.alias.valueReference)
            if v.alias is not None
            else (KIND.RATE if v.derivative else KIND.STATE, states.index(v.derivative or v))
            for v in added
        ]
        n = len(states)
        self._arrays = {
            "states": np.array([v.valueReference for v in states if v], dtype=np.uint32),
            "made": np.array(rows, dtype=MADE),
            **{
                "told_states": np.zeros(n, np.uint32),
                "order": np.zeros(n, np.int64),
                "vector": np.zeros(n),
                "room": np.zeros(n),
            },
        }
        self.adapter = Adapter(n, added[0].valueReference if added else 1 << 32, len(added))
        for name, array in self._arrays.items():
            setattr(self.adapter, name, array.ctypes.data)
        for name in [field[0] for field in Adapter._fields_ if field[0][0].isupper()]:
            with suppress(AttributeError):  # it has none of this name
                symbol = super().__getitem__(f"{self._prefix}fmi{name}")
                setattr(self.adapter, name, ctypes.cast(symbol, ctypes.c_void_p).value)

    def __getitem__(self, name: str | int) -> Any:
        super().__getitem__(f"{self._prefix}{called(self._fmu, str(name).removeprefix('fmi2'))}")  # there is one
        return self._master[str(name).replace("fmi2", "fmi1_")]
