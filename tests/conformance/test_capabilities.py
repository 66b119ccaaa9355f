"""Capabilities that exports claim, driven by fmpy alone and judged by differences of what it reads, or closed forms."""

from __future__ import annotations

import ctypes
from typing import Any

import fmpy
import numpy as np
import pytest
from faces import Face, face

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu

POINTS = ({"theta": 0.03, "omega": 0.2}, {"theta": -0.05, "omega": 0.31})  # slips, below the speeds of both discs
KNOWN = ["theta", "omega", "w0", "w1", "w0_rate", "w1_rate"]


class Slipping:
    """The rig in continuous time of Model Exchange, where values are written and read as an importer does."""

    def __init__(self, one: Face, point: dict[str, float]) -> None:
        self.one, self.names = one, [str(u.variable.name) for u in self._unknowns(one.fmu) if u.variable]
        one.set(point)
        one.initialize()
        one.update()
        one.api.enterContinuousTimeMode()
        self.point = point | {name: float(one.get([name])[0]) for name in KNOWN[2:]}
        self.slips = one.contact_states()
        assert 0 not in self.slips

    @staticmethod
    def _unknowns(fmu: Fmu) -> list[Any]:
        both = [*fmu.description.derivatives, *fmu.description.outputs]
        return [u for u in both if u.variable and u.variable.variability == "continuous"]

    def at(self, **changes: float) -> np.ndarray:
        """(n_unknowns,) what is read with some of the known values changed."""
        values = self.point | changes
        self.one.set_states(np.array([values[name] for name in self.one.fmu.states]))
        self.one.set({name: values[name] for name in KNOWN[2:]})
        found = self.one.get(self.names)
        assert self.one.contact_states() == self.slips
        return found

    def slopes(self) -> np.ndarray:
        """(n_unknowns, n_known) central differences of fourth order."""
        h = 1e-3  # truncation 1e-12 of what changes within 1, rounding 1e-13
        columns = []
        for name in KNOWN:
            one, two = (
                (self.at(**{name: self.point[name] + d}) - self.at(**{name: self.point[name] - d})) / (2 * d)
                for d in (h, 2 * h)
            )
            columns.append((4 * one - two) / 3)
        return np.transpose(columns)


@pytest.fixture(scope="module")
def rig() -> Fmu:
    return Fmu.open(built("disc_rig"))


def test_adjoint_derivatives_are_differences_weighed_by_the_seed(rig: Fmu) -> None:
    with face(rig, co_simulation=False) as one:
        slipping = Slipping(one, POINTS[0])
        slopes = slipping.slopes()
        slipping.at()
        seed = np.cos(1.0 + np.arange(len(slipping.names)))
        assert one.adjoint(slipping.names, KNOWN, seed) == pytest.approx(slopes.T @ seed, rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_nothing_else_and_in_no_other_way_moves_an_unknown(version: str) -> None:
    fmu = Fmu.open(built("disc_rig", fmi_version=version))
    found: list[np.ndarray] = []
    names: list[str] = []
    moved: list[np.ndarray] = []
    for point in POINTS:
        with face(fmu, co_simulation=False) as one:
            slipping = Slipping(one, point)
            found.append(slipping.slopes())
            names, here = slipping.names, slipping.at()
            moved = [slipping.at(**{name: slipping.point[name] + 0.01}) != here for name in KNOWN]
    structure = {u.variable.name: u for u in Slipping._unknowns(fmu)}
    # a state that is an output moves by itself alone
    assert [v.name for v in structure["theta"].dependencies] == ["theta"]
    linear = 0
    for i, name in enumerate(names):
        kinds = {
            v.name: kind for v, kind in zip(structure[name].dependencies, structure[name].dependenciesKind, strict=True)
        }
        for k, known in enumerate(KNOWN):
            if known not in kinds:
                assert not moved[k][i], (name, known)
            elif kinds[known] in ("constant", "tunable"):
                linear += 1
                assert found[0][i, k] == pytest.approx(found[1][i, k], rel=1e-9, abs=1e-10), (name, known)
    assert linear >= 6


def impacts(h: float, g: float, e: float, until: float) -> list[float]:
    """Times at which a ball that falls from h hits the ground, in closed form."""
    times, speed = [np.sqrt(2 * h / g)], np.sqrt(2 * g * h)
    while times[-1] < until:
        speed *= e
        times.append(times[-1] + 2 * speed / g)
    return times[:-1]


def test_steps_return_at_the_impacts_of_a_ball_and_can_be_looked_into() -> None:
    """By fmpy's own loop with event mode and early return; and inside a step, parabolas between the impacts."""
    path = built("bouncing_ball")
    fmu = Fmu.open(path)
    height, h, g, e, stop = "x", 1.0, 9.81, 0.75, 2.5
    still = {"A": 0.0, "x": h, "v": 0.0, "e": e}  # the table rests
    expected = impacts(h, g, e, stop)
    run: Any = fmpy.simulate_fmu(
        str(path), stop_time=stop, output_interval=0.5, fmi_type="CoSimulation", start_values=still, output=[height],
        early_return_allowed=True, use_event_mode=True,
    )  # fmt: skip
    hits = np.unique(run["time"][np.abs(run[height]) < 1e-9])
    assert len(expected) > 3 and hits == pytest.approx(expected, abs=1e-12)

    seen: list[tuple[float, float]] = []

    def look(_e: Any, time: float, _s: bool, gets: bool, _f: bool, _c: bool, _r: Any, _u: Any) -> None:
        assert gets
        seen.append((time, float(one.get([height])[0])))

    with face(
        fmu, intermediateUpdate=look, requiredIntermediateVariables=[fmu.variables[height].valueReference]
    ) as one:
        one.set(still)
        one.initialize()
        one.step(0.0, stop)
    assert len(seen) >= len(expected)
    for time, place in seen:
        n = int(np.searchsorted(expected, time - 1e-12))
        since, up = (time, 0.0) if n == 0 else (time - expected[n - 1], np.sqrt(2 * g * h) * e**n)
        assert place == pytest.approx((h if n == 0 else 0.0) + up * since - g * since**2 / 2, abs=1e-12)


def test_execution_by_a_scheduler_is_neither_claimed_nor_begun(rig: Fmu) -> None:
    assert rig.description.scheduledExecution is None
    with face(rig) as one:
        begin = one.api.dll["fmi3InstantiateScheduledExecution"]
        begin.restype = ctypes.c_void_p
        assert begin(b"rig", b"", b"", False, False, *[None] * 5) is None
