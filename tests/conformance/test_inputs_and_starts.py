"""Inputs that move, parameters that are tuned, and start values on the switching boundary."""

from __future__ import annotations

import numpy as np
import pytest
from faces import face

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal


def slip_of(fmu: Fmu) -> str:
    """The first output that is a slip speed."""
    found = next((name for name in fmu.outputs if name.startswith("slip")), None)
    if found is None:
        pytest.skip("no output of the model is a slip speed")
    return found


def start_on_boundary(fmu: Fmu) -> dict[str, float]:
    """A velocity at which the first contact neither slips nor was told to stick."""
    velocity = fmu.states[len(fmu.states) // 2]
    at_rest = simulate(fmu, 1e-3, output_times=[0.0])[slip_of(fmu)][0]
    moving = simulate(fmu, 1e-3, output_times=[0.0], start={velocity: 1.0})[slip_of(fmu)][0]
    return {velocity: -at_rest / (moving - at_rest)}


def test_a_start_on_the_switching_boundary_is_chosen_once(fmu: Fmu) -> None:
    start = start_on_boundary(fmu)
    run = simulate(fmu, 5.0, start=start)
    assert abs(run[slip_of(fmu)][0]) < 1e-15
    assert 0 in [run[f"{name}_state"][0] for name in fmu.contacts]
    assert not any(event.time < 1e-6 for event in run.events)
    for velocity, value in start.items():
        # a rounding error beside the boundary starts the same motion
        near = simulate(fmu, 5.0, start={velocity: np.nextafter(value, 10.0)})
        assert near[fmu.states[0]] == pytest.approx(run[fmu.states[0]], abs=1e-9)


def test_co_simulation_follows_a_ramp_by_its_rate(fmu: Fmu, input_name: str) -> None:
    name = input_name
    with face(fmu) as one:
        begin = one.get([name])[0]
        end = 1.3 * begin
        native = simulate(
            fmu, 4.0, inputs={name: Signal([0.0, 4.0], [begin, end])}, output_times=np.arange(0, 4.5, 0.5)
        )
        one.set({f"{name}_rate": (end - begin) / 4.0})
        one.initialize()
        for i in range(8):
            one.set({name: begin + (end - begin) * i / 8})
            one.step(i * 0.5, 0.5)
            expected = [native[state][i + 1] for state in fmu.states]
            # other steps, other rounding; the motion is not sensitive to it over these 4 s
            assert one.get(fmu.states) == pytest.approx(expected, abs=1e-10)


def test_input_derivatives_of_fmi2_are_the_rates(fmu: Fmu, input_name: str) -> None:
    if fmu.fmi != 2:
        pytest.skip("FMI 3.0 has no fmi2SetRealInputDerivatives")
    name = input_name
    ends = []
    for by_function in (True, False):
        with face(fmu) as one:
            one.initialize()
            if by_function:
                # fmpy gives derivatives of all inputs, the rates among them
                references = one.references([name, f"{name}_rate"])
                one.api.setRealInputDerivatives(references, [1, 1], [0.05, 7.0])
            else:
                one.set({f"{name}_rate": 0.05})
            one.step(0.0, 2.0)
            ends.append(one.get([*fmu.states, name]).tolist())
    assert ends[0] == ends[1]
    with face(fmu) as one:
        assert ends[0][-1] == pytest.approx(one.get([name])[0] + 0.1, rel=1e-15)


def test_an_input_jump_is_the_same_in_both_interfaces(fmu: Fmu, input_name: str) -> None:
    name = input_name
    with face(fmu) as one, face(fmu, co_simulation=False) as exchange:
        before = one.get([name])[0]
        jump = Signal([0.0, 1.0, 1.0, 2.0], [before, before, -before, -before])
        native = simulate(fmu, 2.0, inputs={name: jump}, output_times=[0.5, 1.0, 1.5, 2.0])
        one.initialize()
        one.step(0.0, 1.0)
        one.set({name: -before})
        for i, time in enumerate((1.0, 1.5), start=2):
            one.step(time, 0.5)
            assert one.get(fmu.states) == pytest.approx([native[s][i] for s in fmu.states], abs=1e-10)
            assert one.contact_states() == [native[f"{c}_state"][i] for c in fmu.contacts]
        # Model Exchange: the contact states right before and after the jump, chosen by states alone: what has stuck may
        # keep a slip of rounding, which a new start takes for slip
        start = {state: native[state][0] for state in fmu.states}
        chosen = [
            simulate(fmu, 1.0, start_time=0.5, start=start, inputs={name: value}, output_times=[0.5])
            for value in (before, -before)
        ]
        exchange.set(start)
        exchange.initialize(start_time=0.5)
        exchange.api.enterContinuousTimeMode()
        assert exchange.contact_states() == [chosen[0][f"{c}_state"][0] for c in fmu.contacts]
        exchange.api.enterEventMode()
        exchange.set({name: -before})
        exchange.update()
        assert exchange.contact_states() == [chosen[1][f"{c}_state"][0] for c in fmu.contacts]


def test_a_parameter_tuned_between_steps_counts_from_there(fmu: Fmu) -> None:
    parameter = fmu.parameters[0]
    with face(fmu) as one:
        value = one.get([parameter])[0]
        one.initialize()
        one.step(0.0, 1.0)
        carried = [*fmu.states, *fmu.memories]
        there = one.get(carried)
        tuned = 1.5 * value if value else 0.01
        one.set({parameter: tuned})
        one.step(1.0, 1.0)
        start = dict(zip(carried, there.tolist(), strict=True))
        native = simulate(fmu, 2.0, start_time=1.0, start=start, parameters={parameter: tuned}, output_times=[1.0, 2.0])
        assert one.get(fmu.states) == pytest.approx([native[s][-1] for s in fmu.states], abs=1e-9)
