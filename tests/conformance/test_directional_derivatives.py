"""Directional derivatives against differences of what the FMU itself computes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from faces import Face, face
from fmpy.fmi1 import FMICallException

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate


def at_point(instance: Face, point: dict[str, float]) -> None:
    """Initialize Model Exchange at a point and go to continuous-time mode."""
    instance.api.reset()
    instance.set(point)
    instance.initialize()
    instance.update()
    instance.api.enterContinuousTimeMode()


def rated(fmu: Fmu) -> list[str]:
    return [*fmu.inputs, *(f"{name}_rate" for name in fmu.inputs)]


def unknowns(fmu: Fmu) -> list[str]:
    return [*(f"der({name})" for name in fmu.states), *fmu.outputs]


@pytest.fixture(scope="module", params=["slip", "stick"])
def point(fmu: Fmu, request: pytest.FixtureRequest) -> dict[str, float]:
    """States in the middle of the longest time between two events of a run, with a contact that sticks or without."""
    times = [0.0, *(event.time for event in simulate(fmu, 5.0).events), 5.0]
    middles = [(begin + end) / 2 for begin, end in pairwise(times)]
    there = simulate(fmu, 5.0, output_times=middles)
    sticks = np.any([np.zeros(len(middles)), *(there[f"{name}_state"] == 0 for name in fmu.contacts)], axis=0)
    wanted = np.where(sticks == (request.param == "stick"), np.diff(times), 0.0)
    if not wanted.any():
        pytest.skip(f"nothing is in {request.param} during the run")
    return {name: float(there[name][wanted.argmax()]) for name in [*fmu.states, *fmu.memories]}


def test_they_match_central_differences(fmu: Fmu, point: dict[str, float]) -> None:
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        names, states = unknowns(fmu), one.contact_states()
        here = np.array([point[name] for name in fmu.states])
        inputs = rated(fmu)
        for known in [*fmu.states, *inputs]:
            value = one.get([known])[0]
            h, sides = 1e-6, []
            for side in (-h, h):
                if known in inputs:
                    one.set({known: value + side})
                else:
                    x = here.copy()
                    x[fmu.states.index(known)] += side
                    one.set_states(x)
                sides.append(one.get(names))
            (one.set({known: value}) if known in inputs else one.set_states(here))
            difference = (sides[1] - sides[0]) / (2 * h)
            exact = one.directional(names, known, 1.0)
            assert one.contact_states() == states
            scale = max(1.0, np.abs(exact).max())
            # truncation h^2, rounding eps/h: both below 1e-9 of the values, which are at most some hundred
            assert np.abs(exact - difference).max() < 1e-6 * scale, known


def test_they_are_linear_in_the_seed(fmu: Fmu, point: dict[str, float]) -> None:
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        for known in [*fmu.states, *rated(fmu)]:
            whole = one.directional(unknowns(fmu), known, 1.0)
            # powers of two: exact where the computation is, and rates are differences of values near one
            assert one.directional(unknowns(fmu), known, -0.25) == pytest.approx(-0.25 * whole, rel=1e-13, abs=1e-13)
            assert not one.directional(unknowns(fmu), known, 0.0).any()


def test_the_rate_of_a_coordinate_is_its_velocity(fmu: Fmu, point: dict[str, float]) -> None:
    if "energy" not in fmu.outputs:
        pytest.skip("a system without a body has no velocities")
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        coordinate, velocity = fmu.states[0], fmu.states[len(fmu.states) // 2]
        assert one.directional([f"der({coordinate})"], velocity, 3.0).tolist() == [3.0]
        assert one.directional([f"der({coordinate})"], coordinate, 3.0).tolist() == [0.0]


def test_dependencies_of_the_model_structure_are_complete(fmu: Fmu, point: dict[str, float]) -> None:
    unknown = (*fmu.description.derivatives, *fmu.description.outputs)
    depends = {u.variable.name: [v.name for v in u.dependencies or ()] for u in unknown if u.variable}
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        for known in [*fmu.states, *rated(fmu)]:
            for name, slope in zip(unknowns(fmu), one.directional(unknowns(fmu), known, 1.0), strict=True):
                if slope != 0.0:
                    assert known in depends[name], (name, known)


def test_those_by_parameters_match_central_differences(fmu: Fmu, point: dict[str, float]) -> None:
    names = unknowns(fmu)
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        states, compared = one.contact_states(), 0
        exact = {known: one.directional(names, known, 1.0) for known in fmu.parameters}
        for known in fmu.parameters:
            value, sides = one.get([known])[0], []
            size = abs(value) or 1e-2
            h = 1e-4 * size
            for side in (-h, h):
                with face(fmu, co_simulation=False) as other:
                    try:
                        at_point(other, point | {known: value + side})
                    except FMICallException:  # out of its bounds, or the point is inside a wall then
                        break
                    if other.contact_states() != states:
                        break
                    sides.append(other.get(names))
            if len(sides) == 2:
                compared += 1
                difference = (sides[1] - sides[0]) / (2 * h)
                # of a change in parts of the parameter: truncation 1e-8, rounding of terms that cancel likewise
                allowed = 1e-6 * max(1.0, np.abs(exact[known]).max() * size)
                assert np.abs(exact[known] - difference).max() * size < allowed, known
        assert compared


def test_adjoint_ones_are_the_transpose(fmu: Fmu, point: dict[str, float]) -> None:
    if fmu.fmi == 2:
        pytest.skip("FMI 2 has none")
    knowns = [*fmu.states, *rated(fmu), *fmu.parameters]
    names = unknowns(fmu)
    with face(fmu, co_simulation=False) as one:
        at_point(one, point)
        jacobian = np.array([one.directional(names, known, 1.0) for known in knowns])
        seed = np.linspace(-1.0, 2.0, len(names))
        found = one.adjoint(names, knowns, seed)
        size = np.abs(jacobian) @ np.abs(seed)
        assert np.all(np.abs(found - jacobian @ seed) <= 1e-14 * size)
        with pytest.raises(FMICallException):
            one.adjoint(names, [names[0]], seed)
        assert "only what can be set" in one.messages[-1]


def test_initial_unknowns_depend_on_nothing_else(fmu: Fmu) -> None:
    declared = {u.variable.name: u.dependencies for u in fmu.description.initialUnknowns if u.variable}
    complete = {name: {v.name for v in of} for name, of in declared.items() if of is not None}
    names = [name for name in unknowns(fmu) if name in complete]
    knowns = [*fmu.parameters, *rated(fmu), *fmu.states]

    def at_start(values: dict[str, float]) -> np.ndarray | None:
        with face(fmu, co_simulation=False) as one:
            one.set(values)
            try:
                one.initialize()
            except FMICallException:  # no start there
                return None
            return one.get(names)

    with face(fmu, co_simulation=False) as one:
        values = dict(zip(knowns, one.get(knowns), strict=True))
    # off every start value that is special
    values |= {name: values[name] + 0.0123 for name in fmu.states}
    before = at_start(values)
    if before is None or not names:
        pytest.skip("no entry says what it depends on, or the model cannot start there")
    for known in knowns:
        after = at_start(values | {known: values[known] * 1.07 + 1e-3})
        moved = [] if after is None else [name for name, a, b in zip(names, before, after, strict=True) if a != b]
        assert [name for name in moved if known not in complete[name]] == [], known
