"""An FMU state brings everything back, also through bytes and into another instance."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from faces import Face, face
from fmpy.fmi1 import FMICallException

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate


def advance(instance: Face, start: float, stop: float, steps: int = 20) -> np.ndarray:
    """States and outputs at the ends of equal steps from start to stop, one row each."""
    names = [*instance.fmu.states, *instance.fmu.outputs]
    length, rows = (stop - start) / steps, []
    for i in range(steps):
        instance.step(start + i * length, length)
        rows.append([*instance.get(names), *instance.contact_states()])
    return np.array(rows)


@pytest.fixture(scope="module")
def moment(fmu: Fmu) -> float:
    """A time in the middle of a stick; of a model that does not stick, between two events."""
    events = simulate(fmu, 5.0).events
    begin = next((event for event in events if event.after == 0), None) or next(iter(events), None)
    if begin is None:
        return 2.5
    later = (event.time for event in events if event.contact == begin.contact and event.time > begin.time)
    return (begin.time + next(later, 5.0)) / 2


def test_co_simulation_goes_on_the_same_after_a_state_is_restored(fmu: Fmu, moment: float) -> None:
    with face(fmu) as one, face(fmu) as other:
        one.initialize()
        advance(one, 0.0, moment)
        state = one.get_state()
        data = one.serialize(state)
        expected = advance(one, moment, moment + 2.0)
        one.set_state(state)
        assert np.array_equal(advance(one, moment, moment + 2.0), expected)
        one.free_state(state)
        # an instance that has not even been initialized
        copy = other.deserialize(data)
        other.set_state(copy)
        assert np.array_equal(advance(other, moment, moment + 2.0), expected)
        assert other.serialize(copy) == data


def test_model_exchange_state_is_restored(fmu: Fmu) -> None:
    with face(fmu, co_simulation=False) as one:
        one.initialize()
        one.update()
        one.api.enterContinuousTimeMode()
        state = one.get_state()
        before = [*one.derivatives(), *one.contact_states()]
        x = one.get(fmu.states)
        one.api.setTime(1.0)
        one.set_states(x + 0.1)
        assert [*one.derivatives(), *one.contact_states()] != before
        one.set_state(state)
        assert [*one.derivatives(), *one.contact_states()] == before
        assert one.get(["time"])[0] == 0.0


def test_reset_brings_back_the_start(fmu: Fmu) -> None:
    parameter = fmu.parameters[0]
    with face(fmu) as one:
        one.initialize()
        expected = advance(one, 0.0, 1.0)
        one.api.reset()
        value = one.get([parameter])[0]
        changed = 2.0 * value if value else 0.01
        one.set({parameter: changed})
        one.initialize()
        advance(one, 0.0, 1.0)
        # a motion may not depend on it: a body that rests, a contact that is never closed
        assert one.get([parameter])[0] == changed
        one.api.reset()
        assert one.get([parameter])[0] == value
        one.initialize()
        assert np.array_equal(advance(one, 0.0, 1.0), expected)


def test_bytes_that_are_no_state_are_refused(fmu: Fmu) -> None:
    with face(fmu) as one, face(fmu, co_simulation=False) as exchange:
        one.initialize()
        data = one.serialize(one.get_state())
        flipped = bytearray(data)
        flipped[len(data) // 2] ^= 1
        for bad, reason in [
            (bytes(flipped), "damaged"),
            (b"x" + data[1:], "not a state"),
            (data[:-1], "bytes given"),
            (b"", "bytes given"),
        ]:
            with pytest.raises(FMICallException):
                one.deserialize(bad)
            assert reason in one.messages[-1]
        with pytest.raises(FMICallException):
            exchange.set_state(exchange.deserialize(data))
        assert "Co-Simulation" in exchange.messages[-1]


def test_pointers_that_are_no_state_are_refused(fmu: Fmu) -> None:
    with face(fmu) as one:
        one.initialize()
        suffix = "FMUstate" if one.two else "FMUState"
        state = one.get_state()
        value = state.value
        one.free_state(state)
        for pointer in (value, 8, None):
            assert one.call(f"Set{suffix}", ctypes.c_void_p(pointer)) == 3
            size = ctypes.c_size_t()
            assert one.call(f"Serialized{suffix}Size", ctypes.c_void_p(pointer), ctypes.byref(size)) == 3
        assert one.call(f"Free{suffix}", ctypes.byref(ctypes.c_void_p(value))) == 3
        assert one.call(f"Free{suffix}", ctypes.byref(ctypes.c_void_p(None))) == 0
        assert one.call(f"Get{suffix}", ctypes.byref(ctypes.c_void_p(8))) == 3
