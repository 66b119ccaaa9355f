"""A ball that bounces on a table which it moves: every impact at its time, whatever the steps.

ball     h'' = -g;   at h = z an impulse I = (1 + e) (w - v) m M/(m + M);  J the sum of the impulses so far
table    M x'' = -k x - c x', which each impulse pushes down: x' = q - J/M, M q' = -k x - c x'
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled import wires
from quick_export import quick_export
from scipy.optimize import root_scalar

from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton, Reset, Switch
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import Input, Parameter, State
from fmu_models.simulation.trajectory import Trajectory

BALL, TABLE, SPRING, DAMPING, RESTITUTION, GRAVITY = 0.1, 5.0, 400.0, 1.0, 0.7, 9.81
WITHIN = 1e-10


def _declared() -> tuple[Automaton, Automaton]:
    m, heavy = Parameter("m", BALL, "kg", "mass of the ball"), Parameter("M", TABLE, "kg", "mass of the table")
    k, c = Parameter("k", SPRING, "N/m", "spring"), Parameter("c", DAMPING, "N.s/m", "damping")
    e, g = Parameter("e", RESTITUTION, "1", "restitution"), Parameter("g", GRAVITY, "m/s2", "gravity")
    h, v, told = State("h", "m", "height"), State("v", "m/s", "speed"), State("J", "N.s", "impulses so far")
    z, w = Input("z", 0.0, "m", "place of the table"), Input("w", 0.0, "m/s", "speed of the table")
    touch = Switch(name="touch", function=h - z, unit="m", description="ball on the table")
    impulse = m * heavy / (m + heavy) * (1 + e) * (w - v)
    ball = Automaton(
        name="ball",
        title="A ball",
        source="test",
        states=[h, v, told],
        flows={h: v, v: -g, told: 0 * g * m},
        switches=[touch],
        resets=[Reset(touch, "+", {v: v + impulse / m, told: told + impulse})],
        outputs=[Output("impulses", told, "N.s", "impulses so far")],
    )
    x, q, taken = State("x", "m", "place"), State("q", "m/s", "speed"), Input("J", 0.0, "N.s", "impulses so far")
    speed = q - taken / heavy
    table = Automaton(
        name="table",
        title="A table",
        source="test",
        states=[x, q],
        flows={x: speed, q: (-k * x - c * speed) / heavy},
        outputs=[Output("place", x, "m", "place"), Output("speed", speed, "m/s", "speed")],
    )
    return ball, table


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def fmus(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Fmu]:
    folder: Path = tmp_path_factory.mktemp("table")
    opened = {}
    for declared in _declared():
        path = folder / f"{declared.name}.fmu"
        quick_export(declared, path, fmi_version=request.param)
        opened[declared.name] = Fmu.open(path)
    return opened


def _run(fmus: dict[str, Fmu], height: float, **settings: Any) -> Trajectory:
    units = {"ball": Unit(fmus["ball"], start={"h": height}), "table": Unit(fmus["table"])}
    joined = wires("ball.impulses -> table.J", "table.place -> ball.z", "table.speed -> ball.w")
    return couple(CoupledSystem("bounces", units, joined, solver="co-simulation", stop_time=1.0, **settings))


def _exact(height: float) -> tuple[list[float], list[float]]:
    """Times of the impacts within 1 s, and h, v, x, x' at its end: damped oscillation and free fall between them."""
    decay = 0.5 * DAMPING / TABLE
    omega = math.sqrt(SPRING / TABLE - decay**2)
    start, ball, table, impacts = 0.0, (height, 0.0), (0.0, 0.0), list[float]()

    def later(s: float) -> tuple[float, float, float, float]:
        (h, v), (x, b) = ball, (table[0], (table[1] + decay * table[0]) / omega)
        cosine, sine, left = math.cos(omega * s), math.sin(omega * s), math.exp(-decay * s)
        place = x * cosine + b * sine
        speed = left * (omega * (b * cosine - x * sine) - decay * place)
        return h + v * s - 0.5 * GRAVITY * s * s, v - GRAVITY * s, left * place, speed

    while True:
        times = np.linspace(1e-4, 1.0 - start, 2001)
        gaps = np.array([state[0] - state[2] for state in map(later, times)])
        falls = np.flatnonzero((gaps[:-1] > 0.0) & (gaps[1:] <= 0.0))
        if not falls.size:
            return impacts, list(later(1.0 - start))
        first = int(falls[0])
        bracket = (times[first], times[first + 1])
        s = float(root_scalar(lambda s: later(s)[0] - later(s)[2], bracket=bracket, method="brentq", xtol=1e-16).root)
        h, v, x, w = later(s)
        impulse = (1 + RESTITUTION) * (w - v) * BALL * TABLE / (BALL + TABLE)
        start, ball, table = start + s, (h, v + impulse / BALL), (x, w - impulse / TABLE)
        impacts.append(start)


@pytest.mark.parametrize(
    ("height", "step"),
    # the last without a step lies, at this tolerance, within rounding of an impact with one of its points
    [(0.26, 0.001), (0.26, 0.002), (0.26, 0.005), (0.26, 0.01), (0.26, 0.02), (0.19, None), (0.45, None), (0.25, None)],
)
def test_every_impact_is_at_its_time(fmus: dict[str, Fmu], height: float, step: float | None) -> None:
    run = _run(fmus, height, step=step, rollback=True, tolerance=1e-12)
    impacts, end = _exact(height)
    assert len(impacts) >= 2
    assert [event.name for event in run.events] == ["ball"] * len(impacts)
    assert [event.time for event in run.events] == pytest.approx(impacts, abs=WITHIN)
    assert [run[name][-1] for name in ("ball.h", "ball.v", "table.x", "table.speed")] == pytest.approx(end, abs=WITHIN)


def test_points_that_a_step_asks_for_are_kept_where_steps_are_repeated(fmus: dict[str, Fmu]) -> None:
    run = _run(fmus, 0.26, step=0.02, rollback=True, tolerance=1e-9)
    asked = 0.02 * np.arange(51)
    assert np.abs(run.time[np.searchsorted(run.time, asked - 1e-12)] - asked).max() < 1e-12
    assert "steps repeated where they miss" in run.method
    assert np.diff(run.time).max() <= 0.02 + 1e-12


def test_a_fixed_step_meets_every_impact_that_stops_the_others(fmus: dict[str, Fmu]) -> None:
    if fmus["ball"].fmi == 2:
        pytest.skip("FMI 2 does not return early")
    run = _run(fmus, 0.26, step=0.001)
    impacts, _ = _exact(0.26)
    assert "fixed step" in run.method
    assert [event.time for event in run.events] == pytest.approx(impacts, abs=1e-6)
