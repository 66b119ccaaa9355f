"""Any FMU as raw function pointers for the master (importer/c), and the C structures of the contract."""

import ctypes
import sys
import weakref
from collections.abc import Callable, Collection
from ctypes import POINTER, byref, c_char_p, c_int, c_int32, c_int64, c_size_t, c_void_p
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.codegen.c_structures import declarations
from fmu_models.fmu.elements import element_names
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import library as library_file
from fmu_models.fmu.library import unload
from fmu_models.importer import dependencies, fmi1
from fmu_models.toolchain import compiler

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

_C = declarations("importer/c/master.h", "importer/c/fmi_calls.h")
F = _C.constants("Function", "F_")
T = _C.constants("Type", "T_")
STATUS = _C.constants(prefix="FMI_")

# names of the functions in FMI 2 and FMI 3, None where the version has none
FUNCTIONS: dict[int, tuple[str | None, str | None]] = {
    F.RESET: ("Reset", "Reset"),
    F.SETUP: ("SetupExperiment", None),
    F.ENTER_INITIALIZATION: ("EnterInitializationMode", "EnterInitializationMode"),
    F.EXIT_INITIALIZATION: ("ExitInitializationMode", "ExitInitializationMode"),
    F.ENTER_EVENT: ("EnterEventMode", "EnterEventMode"),
    F.UPDATE: ("NewDiscreteStates", "UpdateDiscreteStates"),
    F.ENTER_CONTINUOUS: ("EnterContinuousTimeMode", "EnterContinuousTimeMode"),
    F.ENTER_STEP: (None, "EnterStepMode"),
    F.COMPLETED: ("CompletedIntegratorStep", "CompletedIntegratorStep"),
    F.SET_TIME: ("SetTime", "SetTime"),
    F.SET_STATES: ("SetContinuousStates", "SetContinuousStates"),
    F.GET_STATES: ("GetContinuousStates", "GetContinuousStates"),
    F.GET_DERIVATIVES: ("GetDerivatives", "GetContinuousStateDerivatives"),
    F.GET_INDICATORS: ("GetEventIndicators", "GetEventIndicators"),
    F.NOMINALS: ("GetNominalsOfContinuousStates", "GetNominalsOfContinuousStates"),
    F.DIRECTIONAL: ("GetDirectionalDerivative", "GetDirectionalDerivative"),
    F.DO_STEP: ("DoStep", "DoStep"),
    F.SET_CLOCK: (None, "SetClock"),
    F.GET_CLOCK: (None, "GetClock"),
    F.GET_INTERVAL: (None, "GetIntervalDecimal"),
    F.GET_SHIFT: (None, "GetShiftDecimal"),
    F.ACTIVATE: (None, "ActivateModelPartition"),
    F.TERMINATE: ("Terminate", "Terminate"),
    F.BOOLEAN_STATUS: ("GetBooleanStatus", None),
    F.REAL_STATUS: ("GetRealStatus", None),
    F.ENTER_CONFIGURATION: (None, "EnterConfigurationMode"),
    F.EXIT_CONFIGURATION: (None, "ExitConfigurationMode"),
}
# the type that carries a variable of a type of FMI 2 or FMI 3
TYPES2 = {"Real": T.FLOAT64, "Integer": T.INT32, "Enumeration": T.INT32, "Boolean": T.BOOLEAN}
TYPES3 = {
    **{"Float64": T.FLOAT64, "Float32": T.FLOAT32, "Boolean": T.BOOLEAN, "Enumeration": T.INT64},
    **{f"{sign}Int{bits}": getattr(T, f"{sign}INT{bits}".upper()) for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
FLOATS = (T.FLOAT64, T.FLOAT32)


def types_of(fmu: Fmu) -> dict[str, int]:
    return TYPES2 if fmu.fmi == 2 else TYPES3


# where several share a getter, the one it is named after
_GETTERS2, _GETTERS3 = (
    {number: name for name, number in types.items() if name != "Enumeration"} for types in (TYPES2, TYPES3)
)
FUNCTIONS |= {
    first + number: (f"{verb}{_GETTERS2[number]}" if number in _GETTERS2 else None, f"{verb}{name}")
    for verb, first in (("Get", F.GETTERS), ("Set", F.SETTERS))
    for number, name in _GETTERS3.items()
}
# what an interface cannot do without; the rest is asked for when it is needed
COMMON = ("EnterInitializationMode", "ExitInitializationMode", "Terminate")
MODEL_EXCHANGE = (
    *("EnterEventMode", "EnterContinuousTimeMode", "SetTime", "SetContinuousStates", "GetContinuousStates"),
    *("GetEventIndicators", "GetNominalsOfContinuousStates"),
)

Log = _C.structure("Log")
FmuInstance = _C.structure("FmuInstance")
Variables = _C.structure("Variables")
Run = _C.structure("Run")
Update = _C.structure("Update")
Stepped = _C.structure("Stepped")
EVENT = np.dtype(_C.structure("MasterEvent"))


@cache
def master_library() -> ctypes.CDLL:
    """The compiled master. StickslipError: the compiler is missing."""
    package = Path(compiler.__file__).parents[1]
    files = sorted(path for path in (package / "importer" / "c").iterdir() if path.suffix in (".c", ".h"))
    files += [package / "engine" / "step" / name for name in ("polynomial.h", "roots.c", "roots.h")]
    files.append(package / "engine" / "model" / "traps.h")
    sources = {path.relative_to(package).as_posix(): path.read_text("utf-8") for path in files}
    # one unit: the calls into the FMU sit in the innermost loops
    names = [name for name in sources if name.endswith(".c")]
    sources["all.c"] = "".join(f'#include "{name}"\n' for name in names)
    with temporary_folder("master") as folder:
        file = compiler.compile_shared(sources, folder / f"master{compiler.this_platform()[3]}")
        dll = ctypes.CDLL(str(file))
    dll.master_new.restype, dll.master_new.argtypes = c_void_p, (POINTER(FmuInstance), c_int64, c_int64)
    dll.master_free.restype, dll.master_free.argtypes = None, (c_void_p,)
    dll.fmi_configure.restype, dll.fmi_configure.argtypes = c_int, (POINTER(FmuInstance),)
    dll.master_run.restype, dll.master_run.argtypes = c_int32, (c_void_p, POINTER(Run))
    return dll


class _Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions, and what c/fmi1.c takes behind it"""

    _fields_ = tuple((n, c_void_p) for n in ("logger", "allocate", "free", "step_finished", "environment", "adapter"))


class Instance:
    """One instance of an FMU, for one of its interfaces; ``calls`` is what the master takes.

    Without ``co_simulation`` and ``scheduled`` that is Model Exchange.

    Args:
        structure: names of the structural parameters to set to the start values that ``fmu`` says, which differ from
            those of the library.

    Attributes:
        states: names of the continuous states, in their order; ``x[2]`` for an element of an array.
        derivatives: names of their derivatives, in the same order.

    Raises:
        StickslipError: the FMU has no such interface or library, lacks a function, or refuses to be instantiated.
    """

    def __init__(
        self, fmu: Fmu, *, co_simulation: bool = False, scheduled: bool = False, structure: Collection[str] = ()
    ) -> None:
        self.fmu = fmu
        self.co_simulation, self.scheduled = co_simulation, scheduled
        self.log = Log()
        self._remarks: tuple[str, ...] = ()
        self._callbacks = _Callbacks()
        self.calls = FmuInstance(log=ctypes.addressof(self.log))
        kind = "scheduledExecution" if scheduled else "coSimulation" if co_simulation else "modelExchange"
        interface = getattr(fmu.description, kind)
        if interface is None:
            raise StickslipError(_no_interface(fmu, kind))
        file = library_file(fmu, str(interface.modelIdentifier))
        try:
            self.dll = ctypes.CDLL(str(file))
            if fmu.adapted:
                self.dll = fmi1.Library1(str(file), fmu, str(interface.modelIdentifier), master_library())
                self._callbacks.adapter = ctypes.addressof(self.dll.adapter)
        except OSError as error:
            raise StickslipError(f"'{fmu.path}': its library cannot be loaded: {error}.") from error
        self._fill()
        free = self.function("FreeInstance")
        free.restype, free.argtypes = None, (c_void_p,)
        pointers: list[int] = []
        self._finalizer = weakref.finalize(self, _release, free, pointers, self.dll, self.log, self._callbacks)
        self._pointers, self._free = pointers, free
        self._begin()
        self._configure(structure)
        self._size()

    def _begin(self) -> None:
        """Instantiate."""
        pointer = self._instantiate()
        if not pointer and self.calls.event_mode:
            self.calls.event_mode = 0
            pointer = self._instantiate()
            self._remarks = ("without the event mode that the FMU declares and refuses",)
        if not pointer:
            raise StickslipError(f"'{self.fmu.path}' cannot be instantiated: {self.message() or 'it says nothing'}")
        self.calls.instance = pointer
        self._pointers[:] = [pointer]

    def renew(self) -> None:
        """Replace an instance that cannot be reset by a fresh one, before a run after the first. StickslipError: it
        cannot be instantiated again."""
        if not self.calls.function[F.RESET]:
            while self._pointers:
                self._free(self._pointers.pop())
            self._begin()

    def close(self) -> None:
        """Free the instance; nothing may be asked of it afterwards."""
        self._finalizer()

    def message(self) -> str:
        """The last message of the FMU; empty if there was none."""
        return self.log.message.decode("utf-8", "replace").strip()

    @property
    def remark(self) -> str:
        """What the FMU declares but does not do, and its first warning, in words to be added to the method of a run."""
        warning = " ".join(self.log.warning.decode("utf-8", "replace").split())[:300]
        number = self.log.warnings
        warned = [f"the FMU warns{f' {number} times, first' * (number > 1)}: {warning}"] if number else []
        return ", ".join([*self._remarks, *warned])

    def function(self, name: str) -> Any:
        """One of the library by its name without ``fmi2``. StickslipError: the library has none."""
        try:
            return self.dll[f"fmi{self.fmu.fmi}{name}"]
        except AttributeError:
            raise StickslipError(
                f"'{self.fmu.path}': its library has no function {fmi1.called(self.fmu, name)}, which the standard "
                "requires."
            ) from None

    def _fill(self) -> None:
        calls = self.calls
        calls.fmi = self.fmu.fmi
        for index, pair in FUNCTIONS.items():
            name = pair[self.fmu.fmi - 2]
            symbol = name and getattr(self.dll, f"fmi{self.fmu.fmi}{name}", None)
            if symbol:
                calls.function[index] = ctypes.cast(symbol, c_void_p).value
        derivatives = FUNCTIONS[F.GET_DERIVATIVES][self.fmu.fmi - 2]
        update = FUNCTIONS[F.UPDATE][self.fmu.fmi - 2]
        needed = ["DoStep"] if self.co_simulation else [*MODEL_EXCHANGE, str(derivatives), str(update)]
        if self.scheduled:
            needed = ["ActivateModelPartition"]
        if any(v.type == "Clock" for v in self.fmu.variables.values()):
            needed += ["GetClock", "GetIntervalDecimal", "GetShiftDecimal", "SetClock"]
        for name in (*COMMON, *needed):
            self.function(name)
        self._early = self._shows = False
        if self.scheduled:
            return
        exchange, stepping = self.fmu.description.modelExchange, self.fmu.description.coSimulation
        if exchange is not None and not self.co_simulation:
            calls.completes = bool(exchange.needsCompletedIntegratorStep and calls.function[F.COMPLETED])
            offered = bool(exchange.providesDirectionalDerivative)
            calls.directional = offered and calls.function[F.DIRECTIONAL] is not None
        elif stepping is not None and self.fmu.fmi == 3:
            calls.event_mode = bool(stepping.hasEventMode)
            returns = stepping.mightReturnEarlyFromDoStep or stepping.canReturnEarlyAfterIntermediateUpdate
            self._early, self._shows = bool(returns), bool(stepping.providesIntermediateUpdate)

    def _instantiate(self) -> int | None:
        library = master_library()
        resources = self.fmu.folder / "resources"
        token = str(self.fmu.description.guid).encode()
        name = str(self.fmu.description.modelName).encode()
        environment = ctypes.addressof(self.log)
        if self.fmu.fmi == 2:
            c = ctypes.CDLL(None) if sys.platform != "win32" else ctypes.cdll.msvcrt
            self._callbacks.logger = ctypes.cast(library.master_log2, c_void_p)
            self._callbacks.allocate, self._callbacks.free = (ctypes.cast(f, c_void_p) for f in (c.calloc, c.free))
            self._callbacks.environment = environment
            make = self.function("Instantiate")
            make.restype = c_void_p
            make.argtypes = (c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int)
            where = (self.fmu.folder if self.fmu.adapted else resources).as_uri().encode()
            return make(name, int(self.co_simulation), token, where, ctypes.addressof(self._callbacks), 0, 1)
        logger = ctypes.cast(library.master_log3, c_void_p)
        where = (str(resources) + "/").encode() if resources.is_dir() else None
        boolean = ctypes.c_bool
        common = (c_char_p, c_char_p, c_char_p, boolean, boolean)
        if self.scheduled:
            make = self.function("InstantiateScheduledExecution")
            make.restype, make.argtypes = c_void_p, (*common, *[c_void_p] * 5)
            callback, lock = (ctypes.cast(f, c_void_p) for f in (library.master_told, library.master_no_lock))
            return make(name, token, where, False, True, environment, logger, callback, lock, lock)
        if not self.co_simulation:
            make = self.function("InstantiateModelExchange")
            make.restype, make.argtypes = c_void_p, (*common, c_void_p, c_void_p)
            return make(name, token, where, False, True, environment, logger)
        make = self.function("InstantiateCoSimulation")
        make.restype = c_void_p
        make.argtypes = (*common, boolean, boolean, c_void_p, c_size_t, c_void_p, c_void_p, c_void_p)
        events = bool(self.calls.event_mode)
        early = events or self._early
        references = np.array([v.valueReference for v in self.fmu.variables.values() if self.shows(v)], dtype=np.uint32)
        look = ctypes.cast(library.master_look, c_void_p) if self._shows else None
        switches = False, True, events, early
        return make(name, token, where, *switches, references.ctypes.data, references.size, environment, logger, look)

    def shows(self, variable: "ScalarVariable") -> bool:
        """Whether it is an input that may be set inside a step."""
        offered = self.co_simulation and self.fmu.fmi == 3 and self._shows
        return bool(offered and variable.causality == "input" and variable.name in self._intermediate)

    @cached_property
    def _intermediate(self) -> frozenset[str]:
        """Names of the variables that may be accessed inside a step; fmpy does not tell."""
        variables = self.fmu.elements("ModelVariables/*")
        return frozenset(e.get("name", "") for e in variables if e.get("intermediateUpdate") in ("true", "1"))

    def _configure(self, names: Collection[str]) -> None:
        """Sizes of arrays, again after every reset."""
        if not names:
            return
        for function in ("EnterConfigurationMode", "ExitConfigurationMode"):
            self.function(function)
        variables = [self.fmu.variables[name] for name in names]
        values = np.array([float(str(v.start)) for v in variables])
        types = np.array([TYPES3[str(v.type)] for v in variables], dtype=np.int32)
        references = np.array([v.valueReference for v in variables], dtype=np.uint32)
        calls, self._structure = self.calls, (values, types, references)
        calls.structure = Variables(len(values), types.ctypes.data, references.ctypes.data, None)
        calls.structure_values = values.ctypes.data
        if master_library().fmi_configure(byref(calls)) >= STATUS.DISCARD:
            settings = ", ".join(f"{v.name} = {v.start}" for v in variables)
            message = self.message()
            self.close()
            raise StickslipError(f"'{self.fmu.path}' refuses the sizes {settings}: {message or 'it says nothing'}")

    def _size(self) -> None:
        """Names and numbers of states and indicators; an array counts with its elements."""
        pairs = [(u.variable, u.variable.derivative) for u in self.fmu.description.derivatives if u.variable]
        self._derivatives = np.array([derivative.valueReference for derivative, _ in pairs], dtype=np.uint32)
        self._states = np.array([state.valueReference for _, state in pairs if state], dtype=np.uint32)
        named = [(d, state) for d, state in pairs if state]
        self.states = [name for _, v in named for name in element_names(str(v.name), v.shape or ())]
        self.derivatives = [name for v, _ in named for name in element_names(str(v.name), v.shape or ())]
        calls = self.calls
        if self.co_simulation or self.scheduled:
            return
        calls.n_states, calls.n_indicators = len(self.states), self.fmu.description.numberOfEventIndicators
        if self.fmu.fmi == 3:
            for name, field in (("ContinuousStates", "n_states"), ("EventIndicators", "n_indicators")):
                count = c_size_t()
                function = self.function(f"GetNumberOf{name}")
                function.restype, function.argtypes = c_int, (c_void_p, c_void_p)
                if function(calls.instance, byref(count)) < 2:
                    setattr(calls, field, count.value)
        if calls.n_states != len(self.states):
            self.close()
            raise StickslipError(
                f"'{self.fmu.path}': the FMU has {calls.n_states} continuous states, "
                f"its description lists {len(self.states)}."
            )
        calls.n_state_references = self._states.size
        calls.state_references, calls.derivative_references = self._states.ctypes.data, self._derivatives.ctypes.data
        if (pattern := dependencies.declared(self.fmu)) is not None:
            self._pattern = pattern
            calls.dependency_start, calls.dependency_rows = (array.ctypes.data for array in pattern)


def _release(free: Callable[[int], object], pointers: list[int], dll: ctypes.CDLL, *_used: object) -> None:
    """Free an instance; what it still uses then (log, callbacks) is named so that it lives so long."""
    for pointer in pointers:
        free(pointer)
    unload(dll)


def _no_interface(fmu: Fmu, kind: str) -> str:
    words = {
        "modelExchange": "Model Exchange",
        "coSimulation": "Co-Simulation",
        "scheduledExecution": "Scheduled Execution",
    }
    has = [text for name, text in words.items() if getattr(fmu.description, name, None)]
    listed = " and ".join(has) or "no interface at all"
    if kind != "modelExchange":
        return f"'{fmu.path}' offers {listed}, but no {words[kind]}. Leave method and step out, or choose 'auto'."
    return (
        f"'{fmu.path}' offers {listed}, but no Model Exchange, which methods of integration need. "
        "Choose the method 'co-simulation'."
    )
