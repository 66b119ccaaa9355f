"""Impacts under a foreign integrator: CVode of fmpy through chatter, rest, release and jamming, fine and coarse."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
import sympy
from closed_form import root
from fmpy import simulate_fmu
from mechanisms import GRAVITY, LENGTH, MASS, STIFFNESS, mechanism

from fmu_models import load
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.contact_kinds import CLOSED
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.quantities import TIME, Coordinate
from fmu_models.language.stops import Stop
from fmu_models.simulation.run import simulate

# of CVode, with the interval of the outputs, s; at 1e-4 an interval spans many bounces
FINE, COARSE = (1e-8, 1 / 512), (1e-4, 0.25)


def exchange(fmu: Fmu, settings: tuple[float, float], stop: float, **parameters: float) -> np.ndarray:
    """Rows at the output times, before and after every event."""
    return simulate_fmu(
        str(fmu.path),
        fmi_type="ModelExchange",
        stop_time=stop,
        relative_tolerance=settings[0],
        output_interval=settings[1],
        start_values=parameters,
        output=[*fmu.states, *fmu.outputs, *(f"{name}_state" for name in fmu.contacts)],
    )


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def ball(request: pytest.FixtureRequest) -> Fmu:
    return Fmu.open(built("bouncing_ball", fmi_version=request.param))


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def woodpecker(request: pytest.FixtureRequest) -> Fmu:
    return Fmu.open(built("woodpecker", fmi_version=request.param))


@pytest.mark.parametrize("settings", [FINE, COARSE], ids=["fine", "coarse"])
@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_a_ball_comes_to_rest_on_a_floor(ball: Fmu, e: float, settings: tuple[float, float]) -> None:
    """However low the bounces become, none is missed and the rest is reached when the closed form says."""
    run = exchange(ball, settings, 3.0, A=0.0, e=e)
    native = simulate(ball, 3.0, parameters={"A": 0.0, "e": e})
    rest = native.events[-1].time
    last = run["time"][np.nonzero(run["table_state"] != 3)[0][-1]]
    # bounces lower than what CVode resolves are completed in closed form
    assert last == pytest.approx(rest, abs=1e-4 if settings == FINE else 5e-2)
    # a low flight after a coarse step may pass the floor by CVode's own error
    assert run["gap"].min() > (-1e-9 if settings == FINE else -1e-5)
    assert abs(run["x"][-1]) < 1e-9 and abs(run["v"][-1]) < 1e-9
    # no more than a bounce at a time
    assert run.size < 2 * len(native.events) + 3.0 / settings[1] + 20


@pytest.mark.parametrize("settings", [FINE, COARSE], ids=["fine", "coarse"])
@pytest.mark.parametrize("parameters", [{"A": 5e-3, "e": 0.2}, {"A": 6e-3, "e": 0.0}], ids=["chatter", "plastic"])
def test_a_ball_sticks_to_a_table_and_leaves_it(
    ball: Fmu, parameters: dict[str, float], settings: tuple[float, float]
) -> None:
    run = exchange(ball, settings, 3.0, **parameters)
    native = simulate(ball, 3.0, parameters=parameters, output_times=np.arange(0, 3.0 + 1e-9, settings[1]))
    assert run["gap"].min() > -1e-5
    assert {2, 3} <= set(run["table_state"][run["time"] > 2.0].astype(int))
    # a release is where the acceleration of the table says, whatever came before: CVode's error in it is forgotten
    released = [event.time for event in native.events if (event.before, event.after) == (3, 2)]
    state = run["table_state"].astype(int)
    opened = run["time"][1:][(state[:-1] == 3) & (state[1:] == 2)]
    assert opened == pytest.approx(released, abs=1e-6 if settings == FINE else 1e-3)
    at = np.searchsorted(run["time"], native.time - 1e-9)
    assert np.abs(run["x"][at] - native["x"]).max() < (1e-7 if settings == FINE else 1e-4)


def test_the_woodpecker_goes_on_through_jamming(woodpecker: Fmu) -> None:
    stop = 0.6
    run = exchange(woodpecker, FINE, stop)
    native = simulate(woodpecker, stop, output_times=np.arange(0, stop, FINE[1]))
    at = np.searchsorted(run["time"], native.time - 1e-9)
    for name in ("y", "phi_M", "phi_S"):
        # four periods of a motion whose multipliers are small
        assert np.abs(run[name][at] - native[name]).max() < 1e-4 * np.ptp(native[name]), name
    jammed = (run["lower_state"] == 3) & (run["lower_friction_state"] == 0)
    assert jammed.any() and not jammed.all()


@pytest.mark.parametrize("settings", [FINE, COARSE], ids=["fine", "coarse"])
def test_bounces_too_low_for_an_importer_rub_as_much_as_they_would(settings: tuple[float, float]) -> None:
    """A block thrown along a rough floor that it falls on: from the end of its bounces on the impulses of the floor are
    m g t in all, and it has lost mu g t of its speed."""
    x, y = (Coordinate(name, "m", "place", velocity=f"v{name}") for name in "xy")
    floor = Impact(name="floor", gap=y, restitution=Newton(0.5), slip=x.v, mu=0.3)
    thrown = mechanism("thrown", [x, y], MASS * (x.v**2 + y.v**2) / 2, MASS * GRAVITY * y, [floor])
    run = exchange(load(thrown), settings, 1.0, y=0.05, vx=10.0)
    rest = 3 * np.sqrt(2 * 0.05 / 9.81)  # (1 + e)/(1 - e) times the fall
    after = run["time"] > rest + 0.1
    lost = 10.0 - run["vx"] - 0.3 * 9.81 * run["time"]
    assert np.abs(lost[after]).max() < (1e-8 if settings == FINE else 1e-6)


def test_a_hop_lower_than_an_importer_resolves_ends_at_the_wall() -> None:
    """It hits a wall, is pushed off by some millionths and drawn back: at rest from where the closed form meets the
    wall again, not once it has passed as far as an importer's errors might put it."""
    x = Coordinate("x", "m", "place", velocity="v")
    wall = Impact(name="wall", gap=x - LENGTH, restitution=Newton(0.0))
    a, b, w = 2e-6, 5e-3, 100.0
    push = MASS * (a * w**2 * sympy.cos(w * TIME) - b)
    run = exchange(
        load(mechanism("hopping", [x], MASS * x.v**2 / 2, -push * x, [wall])), (1e-9, 1e-3), 0.06, x=1.01, v=-10.0
    )
    hits = root(lambda t: 0.01 - 10.0 * t + a * (1 - np.cos(w * t)) - b * t**2 / 2, 0.0, 0.01)

    def hop(t: float) -> float:
        since = t - hits
        return a * (np.cos(w * hits) - np.cos(w * t) - w * np.sin(w * hits) * since) - b * since**2 / 2

    rests = run["time"][run["wall_state"] == CLOSED]
    assert rests[0] == pytest.approx(root(hop, 0.02, 0.06), abs=1e-5)


@pytest.mark.parametrize("release", ["gap", "force"])
def test_a_start_at_the_bound_of_a_stop_enters_it(release: Literal["gap", "force"]) -> None:
    """Half a period of the stop's spring turns the speed around, under CVode as under the suite's own master."""
    x = Coordinate("x", "m", "place", velocity="v")
    stop = Stop(name="stop", gap=LENGTH - x, law=KelvinVoigt(k=STIFFNESS, c=sympy.S.Zero), release=release)
    fmu = load(mechanism("mass", [x], MASS * x.v**2 / 2, sympy.S.Zero, [stop]))
    given = {"k": 1e6, "x": 1.0, "v": 0.5}
    run = exchange(fmu, FINE, 0.5, **given)
    own = simulate_any(fmu, 0.5, tolerance=1e-10, parameters={"k": 1e6}, start={"x": 1.0, "v": 0.5})
    for found in (run, own):
        assert found["v"][-1] == pytest.approx(-0.5, abs=1e-5)
        assert found["x"][-1] == pytest.approx(1.0 - 0.5 * (0.5 - np.pi * 1e-3), abs=1e-5)


@pytest.mark.parametrize("release", ["gap", "force"])
def test_a_start_at_rest_at_the_bound_of_a_stop_enters_it(release: Literal["gap", "force"]) -> None:
    """A constant force pushes a mass into a spring that it just touches, x = F/k (1 - cos w t): all that its gap is
    made of is zero there."""
    x = Coordinate("x", "m", "place", velocity="v")
    stop = Stop(name="stop", gap=-x, law=KelvinVoigt(k=STIFFNESS, c=sympy.S.Zero), release=release)
    fmu = load(mechanism("pushed", [x], MASS * x.v**2 / 2, -2e-4 * STIFFNESS * LENGTH * x, [stop]))
    given = {"k": 1e6, "x": 0.0, "v": 0.0}
    run = exchange(fmu, FINE, 0.005, **given)
    own = simulate_any(fmu, 0.005, tolerance=1e-10, parameters={"k": 1e6}, start={"x": 0.0, "v": 0.0})
    for found in (run, own):
        assert found["x"][-1] == pytest.approx(2e-4 * (1 - np.cos(5.0)), abs=1e-9)
