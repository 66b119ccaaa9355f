"""Whatever an importer does wrong is refused with a reason, and nothing crashes."""

from __future__ import annotations

import ctypes
import math
from ctypes import byref, c_double, c_int, c_size_t, c_uint32, c_void_p

import pytest
from faces import Face, face
from fmpy.fmi1 import FMICallException

from fmu_models.fmu.fmu import Fmu

ERROR = 3

# functions of both versions that take an instance first, whatever follows
COMMON = ("Terminate", "Reset", "EnterInitializationMode", "ExitInitializationMode", "EnterEventMode", "SetTime")
COMMON += ("EnterContinuousTimeMode", "CompletedIntegratorStep", "SetContinuousStates", "GetContinuousStates")
COMMON += ("GetEventIndicators", "GetNominalsOfContinuousStates", "DoStep", "SetDebugLogging", "GetString", "SetString")
COMMON += ("GetBoolean", "SetBoolean")
TWO = (
    "GetReal",
    "SetReal",
    "GetInteger",
    "SetInteger",
    "GetFMUstate",
    "SetFMUstate",
    "FreeFMUstate",
    "SetupExperiment",
)
TWO += ("SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate", "GetDirectionalDerivative")
TWO += ("NewDiscreteStates", "GetDerivatives", "SetRealInputDerivatives", "GetRealOutputDerivatives", "CancelStep")
TWO += ("GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus")
THREE = tuple(f"{verb}{kind}{size}" for verb in ("Get", "Set") for kind in ("Int", "UInt") for size in (8, 16, 32, 64))
THREE += ("GetFloat32", "SetFloat32", "GetFloat64", "SetFloat64", "GetBinary", "SetBinary", "GetClock", "SetClock")
THREE += ("GetFMUState", "SetFMUState", "FreeFMUState", "SerializedFMUStateSize", "SerializeFMUState")
THREE += ("DeserializeFMUState", "GetDirectionalDerivative", "GetAdjointDerivative", "GetVariableDependencies")
THREE += ("GetNumberOfVariableDependencies", "EnterConfigurationMode", "ExitConfigurationMode", "GetIntervalDecimal")
THREE += ("GetIntervalFraction", "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal", "SetIntervalFraction")
THREE += ("SetShiftDecimal", "SetShiftFraction", "EvaluateDiscreteStates", "UpdateDiscreteStates")
THREE += ("GetContinuousStateDerivatives", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates")
THREE += ("EnterStepMode", "GetOutputDerivatives", "ActivateModelPartition")

# by phase and interface: what is not allowed there
FORBIDDEN = {
    "instantiated": ("ExitInitializationMode", "EnterEventMode", "EnterContinuousTimeMode", "Terminate"),
    "initialization": ("EnterInitializationMode", "EnterEventMode", "EnterContinuousTimeMode", "Terminate"),
    "step": ("EnterInitializationMode", "ExitInitializationMode", "EnterEventMode", "EnterContinuousTimeMode"),
    "continuous": ("EnterInitializationMode", "ExitInitializationMode", "EnterContinuousTimeMode"),
    "terminated": ("EnterInitializationMode", "ExitInitializationMode", "EnterEventMode", "Terminate"),
}


def zeros() -> list:
    """Arguments that are zero or NULL whatever their type: registers of both kinds are filled."""
    return [c_void_p(None)] * 8 + [c_double(0.0)] * 4


def bring_to(one: Face, phase: str) -> None:
    if phase == "instantiated":
        return
    if phase == "initialization":
        if one.two:
            one.api.setupExperiment()
        one.api.enterInitializationMode()
        return
    one.initialize()
    if phase == "continuous":
        one.api.enterContinuousTimeMode()
    if phase == "terminated":
        one.api.terminate()


def real(one: Face, verb: str, references: list[int], values: list[float]) -> int:
    """Get or set real variables by references, which may be wrong."""
    vr = (c_uint32 * len(references))(*references)
    data = (c_double * len(values))(*values)
    if one.two:
        return one.call(f"{verb}Real", vr, c_size_t(len(references)), data)
    return one.call(f"{verb}Float64", vr, c_size_t(len(references)), data, c_size_t(len(values)))


def test_no_instance(fmu: Fmu) -> None:
    with face(fmu) as one:
        for name in (*COMMON, *(TWO if one.two else THREE)):
            assert one.raw(name, c_void_p(None), *zeros()) == ERROR, name
        free = one.api.dll[f"fmi{2 if one.two else 3}FreeInstance"]
        free.restype = None
        free(c_void_p(None))


@pytest.mark.parametrize("phase", FORBIDDEN)
def test_wrong_phase(fmu: Fmu, phase: str) -> None:
    with face(fmu, co_simulation=phase in ("step", "terminated")) as one:
        bring_to(one, phase)
        arguments = zeros()
        for name in FORBIDDEN[phase]:
            said = len(one.messages)
            assert one.call(name, *arguments) == ERROR, name
            assert name in one.messages[said] and "not allowed" in one.messages[said]


def test_missing_arguments(fmu: Fmu) -> None:
    # sizes that are not zero with arrays that are NULL
    sized = {"GetReal", "SetReal", "GetFloat64", "SetFloat64", "GetInteger", "GetInt32"} & {*TWO, *THREE}
    with face(fmu) as one:
        one.initialize()
        for name in sized & {*(TWO if one.two else THREE)}:
            assert one.call(name, c_void_p(None), c_size_t(1), c_void_p(None), c_size_t(1)) == ERROR, name
            assert "NULL" in one.messages[-1]
        suffix = "FMUstate" if one.two else "FMUState"
        assert one.call(f"Get{suffix}", c_void_p(None)) == ERROR
        state = one.get_state()
        assert one.call(f"Serialize{suffix}", state, c_void_p(None), c_size_t(1 << 20)) == ERROR
        small = ctypes.create_string_buffer(8)
        assert one.call(f"Serialize{suffix}", state, small, c_size_t(8)) == ERROR
        assert "needed" in one.messages[-1]
    with face(fmu, co_simulation=False) as one:
        one.initialize()
        assert one.call("NewDiscreteStates" if one.two else "UpdateDiscreteStates", *zeros()) == ERROR
        one.api.enterContinuousTimeMode()
        n = c_size_t(len(fmu.states))
        rate = "GetDerivatives" if one.two else "GetContinuousStateDerivatives"
        for name in ("SetContinuousStates", "GetContinuousStates", "GetNominalsOfContinuousStates", rate):
            assert one.call(name, c_void_p(None), n) == ERROR, name
            values = (c_double * 64)()
            assert one.call(name, values, c_size_t(len(fmu.states) + 1)) == ERROR, name
        assert one.call("GetEventIndicators", (c_double * 64)(), c_size_t(64)) == ERROR
        assert one.call("CompletedIntegratorStep", c_int(1), c_void_p(None), c_void_p(None)) == ERROR


def test_wrong_references(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        time, nothing = one.reference("time"), [0, 1000, 2**31, 2**32 - 1]
        for reference in nothing:
            assert real(one, "Get", [time, reference], [0.0, 0.0]) == ERROR
            assert f"value reference {reference} is nothing" in one.messages[-1]
        contacts = one.references([f"{name}_state" for name in fmu.contacts])
        for reference in contacts:
            assert real(one, "Get", [time, reference], [0.0, 0.0]) == ERROR
            assert f"value reference {reference} is the state of a contact" in one.messages[-1]
        for reference in (*nothing, *contacts, *one.references([*fmu.outputs, *fmu.states])):
            assert real(one, "Set", [reference], [0.0]) == ERROR
        with pytest.raises(FMICallException):
            (one.api.getInteger if one.two else one.api.getInt32)([0])


def test_nothing_is_written_when_one_value_is_refused(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        first, second = fmu.parameters[0], fmu.parameters[-1]
        before = one.get([first])
        assert real(one, "Set", one.references([first, second]), [7.0, math.nan]) == ERROR
        assert "not finite" in one.messages[-1]
        assert one.get([first]) == before


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite(fmu: Fmu, value: float) -> None:
    with face(fmu) as one:
        inputs = [*fmu.inputs, *(f"{name}_rate" for name in fmu.inputs)]
        for name in (fmu.parameters[0], fmu.states[0], *inputs):
            assert real(one, "Set", [one.reference(name)], [value]) == ERROR
        one.initialize()
        with pytest.raises(FMICallException):
            one.step(0.0, value)
        with pytest.raises(FMICallException):
            one.step(value, 0.1)
        with pytest.raises(FMICallException):
            one.directional([f"der({fmu.states[0]})"], fmu.states[0], value)
    with face(fmu, co_simulation=False) as one:
        one.initialize()
        one.api.enterContinuousTimeMode()
        assert one.call("SetTime", c_double(value)) == ERROR
        x = (c_double * len(fmu.states))(*[value] * len(fmu.states))
        assert one.call("SetContinuousStates", x, c_size_t(len(fmu.states))) == ERROR


def test_steps_that_do_not_fit(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        one.step(0.0, 0.5)
        for time, length in [(0.5, 0.0), (0.5, -0.1), (0.0, 0.5), (0.6, 0.1)]:
            with pytest.raises(FMICallException):
                one.step(time, length)
        one.step(0.5, 0.5)
        assert one.get(["time"])[0] == 1.0


def test_parameters_out_of_range(fmu: Fmu) -> None:
    bounded = [name for name in fmu.parameters if fmu.variables[name].min is not None]
    if not bounded:
        pytest.skip("no parameter of the model has a least value")
    parameter = bounded[0]
    wrong = float(fmu.variables[parameter].min or 0.0) - 1.0
    with face(fmu) as one:
        right = one.get([parameter])[0]
        one.set({parameter: wrong})
        with pytest.raises(FMICallException):
            one.initialize()
        assert parameter in one.messages[-1]
        # still in initialization mode: the importer may mend the value
        one.set({parameter: right})
        one.api.exitInitializationMode()
        one.set({parameter: wrong})
        with pytest.raises(FMICallException):
            one.step(0.0, 0.1)
        one.set({parameter: right})
        one.step(0.0, 0.1)


def test_wrong_token(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.api.guid = "not this one"
        component = one.api.component
        with pytest.raises(Exception, match="instantiate"):
            one.api.instantiate(loggingOn=True)
        one.api.component = component


def test_what_is_not_provided_says_so(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        if one.two:
            value = c_int()
            assert one.call("CancelStep") == ERROR
            assert one.call("GetStatus", c_int(0), byref(value)) == ERROR
            assert one.call("GetRealStatus", c_int(2), byref(c_double())) == 0
            assert one.call("GetRealStatus", c_int(0), byref(c_double())) == ERROR
            assert (
                one.call("SetRealInputDerivatives", (c_uint32 * 1)(0), c_size_t(1), (c_int * 1)(1), zeros()[0]) == ERROR
            )
        else:
            assert one.call("EnterConfigurationMode") == ERROR
            assert one.call("GetNumberOfVariableDependencies", c_uint32(0), byref(c_size_t())) == ERROR
            assert one.call("GetFloat32", (c_uint32 * 1)(0), c_size_t(1), zeros()[0], c_size_t(1)) == ERROR
            assert one.call("GetFloat64", (c_uint32 * 1)(0), c_size_t(1), (c_double * 2)(), c_size_t(2)) == ERROR
        names = (ctypes.c_char_p * 1)(b"nonsense")
        assert one.call("SetDebugLogging", c_int(1), c_size_t(1), names) == ERROR
        assert "logStatusWarning" in one.messages[-1]
        names = (ctypes.c_char_p * 1)(b"logStatusError")
        assert one.call("SetDebugLogging", c_int(1), c_size_t(1), names) == 0


def test_a_failed_call_leaves_the_instance_usable(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        real(one, "Get", [2**32 - 1], [0.0])
        one.step(0.0, 0.1)
        one.api.terminate()
        with pytest.raises(FMICallException):
            one.step(0.1, 0.1)
        one.get(fmu.outputs)
        one.api.reset()
        one.initialize()
        one.step(0.0, 0.1)
