"""Attractors of what nothing forces, of models as they are: against closed forms, published values and SciPy."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmu_models import (
    Automaton,
    Coordinate,
    Coulomb,
    Fmu,
    Friction,
    Mechanism,
    Parameter,
    Reset,
    State,
    StickslipError,
    Strobe,
    Switch,
    basins,
    load,
    lyapunov,
    orbit_diagram,
)
from fmu_models.analyses.basins import Basins
from fmu_models.analyses.unforced import Equilibrium, LimitCycle
from fmu_models.families.execution import Execution

ALONE = Execution(workers=1)
RATE = Parameter("rate", 1.0, "1/s", "rate", positive=True)


def states(**starts: float) -> list[State]:
    return [State(name, "1", name, start=start) for name, start in starts.items()]


def flow(name: str, flows: dict, switches: tuple = (), resets: tuple = ()) -> Fmu:
    """The FMU of a flow, whose rates are those per unit of time."""
    rates = {state: RATE * rate for state, rate in flows.items()}
    declared = Automaton(
        name=name, title=name, source="here", states=list(rates), flows=rates, switches=switches, resets=resets
    )
    return load(declared)


@cache
def lorenz() -> Fmu:
    rho = Parameter("rho", 28.0, "1", "rho")
    x, y, z = states(x=1.0, y=1.0, z=1.0)
    return flow("lorenz_as_it_is", {x: 10 * (y - x), y: x * (rho - z) - y, z: x * y - sympy.Rational(8, 3) * z})


@cache
def van_der_pol() -> Fmu:
    mu = Parameter("mu", 1.0, "1", "mu")
    x, y = states(x=0.5, y=0.0)
    return flow("van_der_pol", {x: y, y: mu * (1 - x**2) * y - x})


@cache
def brusselator() -> Fmu:
    b = Parameter("b", 3.0, "1", "b")
    x, y = states(x=1.0, y=1.0)
    return flow("brusselator", {x: 1 + x**2 * y - (b + 1) * x, y: b * x - x**2 * y})


@cache
def langford() -> Fmu:
    lam = Parameter("lam", 2.01, "1", "lambda")
    x, y, z = states(x=0.1, y=0.1, z=1.0)
    growth = lam - 3 + z + sympy.Rational(1, 5) * (1 - z**2)
    return flow("langford", {x: growth * x - y / 4, y: x / 4 + growth * y, z: lam * z - (x**2 + y**2 + z**2)})


@cache
def thermostat() -> Fmu:
    """T' = 2 q - T; the heater q goes off at T = 1.1, on at .9."""
    temperature, q = states(T=1.0, q=1.0)
    hot = Switch(name="hot", function=sympy.Rational(11, 10) - temperature)
    cold = Switch(name="cold", function=temperature - sympy.Rational(9, 10))
    resets = (Reset(hot, "+", {q: sympy.Integer(0)}), Reset(cold, "+", {q: sympy.Integer(1)}))
    return flow("thermostat", {temperature: 2 * q - temperature, q: sympy.Integer(0)}, (hot, cold), resets)


@cache
def relay() -> Fmu:
    """1/(1 + s)^3 under a relay."""
    x, y, z = states(x=0.5, y=0.2, z=0.1)
    switch = Switch(name="relay", function=z)
    return flow("relay", {x: -x - switch.sign, y: x - y, z: y - z}, (switch,))


def grid(fmu: Fmu, at: dict[str, float], **axes: Any) -> Basins:
    return basins(Strobe(fmu, parameters=at), execution=ALONE, **axes)


def cycle_of(found: Basins) -> LimitCycle:
    """The only attractor, a cycle to which every start comes."""
    (cycle,) = found.attractors
    assert isinstance(cycle, LimitCycle)
    assert (found.labels == 0).all()
    return cycle


def period_of(rates, start: list[float], level: float, span: float = 500.0) -> float:
    """Of the cycle that SciPy's integration comes to, by its upward crossings of a level of the first state."""

    def crosses(t, x):
        return x[0] - level

    crosses.direction = 1.0  # type: ignore[attr-defined] # as SciPy reads it
    run = solve_ivp(rates, (0, span), start, rtol=1e-10, atol=1e-12, events=crosses, method="LSODA")
    return run.t_events[0][-1] - run.t_events[0][-2]


def test_van_der_pol_has_one_cycle():
    """T = 6.6632868593 (Andersen and Geer, SIAM J. Appl. Math. 42, 1982); log of the multiplier: mean divergence."""
    found = basins(van_der_pol(), execution=ALONE, x=np.linspace(-2.2, 2, 5), y=np.linspace(-2, 2, 4))
    cycle = cycle_of(found)
    assert cycle.time == pytest.approx(6.6632868593, abs=1e-9)
    assert found.words == ["cycle of 6.66329 s"] and cycle.period == 1

    def rates(t, x):
        return [x[1], (1 - x[0] ** 2) * x[1] - x[0], 1 - x[0] ** 2]

    start = cycle.points[0]
    run = solve_ivp(rates, (0, cycle.time), [*start, 0.0], rtol=1e-12, atol=1e-13, method="DOP853")
    assert run.y[:2, -1] == pytest.approx(start, abs=1e-9)
    assert cycle.multipliers[0].real == pytest.approx(math.exp(run.y[2, -1]), rel=1e-7)


@pytest.mark.nightly_for("1000.0", "100.0", "30.0")
@pytest.mark.parametrize("mu", [0.1, 30.0, 100.0, 1000.0])
def test_periods_from_harmonic_to_relaxation(mu):
    """1 + mu^2/16 - 5 mu^4/3072; from 30 on against SciPy. At 1000 it creeps for 40 000 times of its fastest change."""
    known = 2 * math.pi * (1 + mu**2 / 16 - 5 * mu**4 / 3072)
    if mu > 1:
        known = period_of(lambda t, x: [x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]], [2.0, 0.0], 0.0, max(500.0, 5 * mu))
    cycle = cycle_of(grid(van_der_pol(), {"mu": mu}, x=[-2.0, 1.0], y=[0.3]))
    assert cycle.time == pytest.approx(known, rel=1e-6)


def test_the_brusselator_has_a_cycle_or_none():
    period = period_of(lambda t, x: [1 + x[0] ** 2 * x[1] - 4 * x[0], 3 * x[0] - x[0] ** 2 * x[1]], [1.0, 2.0], 1.0)
    axes: Any = {"x": np.linspace(0.1, 3, 4), "y": np.linspace(0.2, 4, 4)}
    assert cycle_of(basins(brusselator(), execution=ALONE, **axes)).time == pytest.approx(period, rel=1e-7)
    # Hopf point at b = 2: below it the equilibrium (1, b), with the eigenvalues of l^2 + (2 - b) l + 1
    calm = grid(brusselator(), {"b": 1.5}, **axes)
    assert calm.words == ["equilibrium"] and (calm.labels == 0).all()
    (rest,) = calm.attractors
    assert isinstance(rest, Equilibrium)
    assert rest.points[0] == pytest.approx([1.0, 1.5], abs=1e-12)
    step = Strobe(brusselator(), parameters={"b": 1.5}).period
    logarithm = np.log(rest.stability.eigenvalues) / step
    assert np.sort(logarithm.imag) == pytest.approx([-math.sqrt(1 - 1 / 16), math.sqrt(1 - 1 / 16)], abs=1e-9)
    assert logarithm.real == pytest.approx([-0.25, -0.25], abs=1e-9)


def test_lorenz_at_rest_in_mirror_cycles_and_in_chaos():
    """Equilibria +-sqrt(8/3 (rho - 1)); two cycles at 150; chaos at 28, .9056 (Viswanath 1998)."""
    axes: Any = {"x": np.linspace(-9, 10, 4), "y": np.linspace(-9, 10, 4)}
    rest = grid(lorenz(), {"rho": 10.0}, **axes)
    assert rest.words == ["equilibrium, mirror image of 2", "equilibrium, mirror image of 1"]
    assert rest.undecided == 0
    size = math.sqrt(24.0)
    assert [a.points[0] for a in rest.attractors] == [pytest.approx([s * size, s * size, 9.0]) for s in (-1, 1)]
    cycles = grid(lorenz(), {"rho": 150.0}, **axes)
    assert [w.partition(",")[2] for w in cycles.words] == [" mirror image of 2", " mirror image of 1"]
    assert cycles.undecided == 0 and set(cycles.labels.ravel().tolist()) == {0, 1}
    for cycle in cycles.attractors:
        assert isinstance(cycle, LimitCycle)
        # volumes shrink by the divergence, and one multiplier is 1
        assert np.log(np.abs(np.prod(cycle.multipliers))) == pytest.approx(-(11 + 8 / 3) * cycle.time, rel=1e-3)
        run = solve_ivp(
            lambda t, x: [10 * (x[1] - x[0]), x[0] * (150 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]],
            (0, cycle.time), cycle.points[0], rtol=1e-12, atol=1e-12, method="DOP853",
        )  # fmt: skip
        assert run.y[:, -1] == pytest.approx(cycle.points[0], abs=1e-6)
    wild = grid(lorenz(), {}, x=[-9.0, 1.0], y=[2.0])
    assert wild.words == ["chaos"] and (wild.labels == 0).all()


def test_exponents_of_a_model_as_it_is():
    found = lyapunov(lorenz(), periods=60_000, execution=ALONE)
    assert found.zero == 1
    assert (np.abs(found.per_time - [0.9056, 0.0, -14.5723]) <= 5 * found.per_time_errors + 1e-3).all(), found


def test_a_thermostat_switches_as_its_logarithms_say():
    """2 ln(1.1/.9) s; where it starts without a heater that its guard can turn on, it rests at 2 q."""
    found = basins(thermostat(), execution=ALONE, T=[0.95, 1.0, 1.05], q=[0.0, 1.0])
    cycle = cycle_of(found)
    assert cycle.time == pytest.approx(2 * math.log(1.1 / 0.9), rel=1e-12)
    assert np.abs(cycle.multipliers).max() < 1e-9
    cold = basins(thermostat(), execution=ALONE, T=[0.1, 0.2], q=[0.0])
    assert cold.words == ["equilibria side by side"]


def test_a_relay_has_the_period_of_its_switching_condition():
    """Half a period h solves z(h) = -z(0) = 0: sum over the Laguerre terms of 1/(1 + s)^3, with alternate sides."""

    def at_switching(h):
        a = np.array([[-1.0, 0, 0], [1, -1, 0], [0, 1, -1]])
        e = sympy.Matrix(a * h).exp()
        e = np.array(e.tolist(), float)
        # x(h) = e x + (e - 1) a^-1 b u = -x, u = -1
        forced = (e - np.eye(3)) @ np.linalg.solve(a, [1.0, 0, 0])
        return np.linalg.solve(np.eye(3) + e, forced)[2]

    half = brentq(at_switching, 1.0, 3.0, xtol=1e-13)
    found = basins(relay(), execution=ALONE, x=[-1.0, 0.4], y=[0.3, -0.6])
    assert cycle_of(found).time == pytest.approx(2 * half, rel=1e-10)


@pytest.mark.nightly_for("2.005")
@pytest.mark.parametrize("strength", [1.95, 2.005, 2.01])
def test_a_torus_is_a_cycle_of_what_turns(strength):
    """Langford 1979: (r, z) by themselves, and a turn in 8 pi: at rest a cycle, on a cycle of their own a torus."""
    found = grid(langford(), {"lam": strength}, x=[0.1, 0.5], y=[0.1])

    def rates(t, x):
        growth = strength - 3 + x[1] + 0.2 * (1 - x[1] ** 2)
        return [growth * x[0], strength * x[1] - x[0] ** 2 - x[1] ** 2]

    run = solve_ivp(rates, (0, 4000), [0.1, 1.0], rtol=1e-10, atol=1e-12, t_eval=np.linspace(3500, 4000, 2001))
    if np.ptp(run.y[0]) < 1e-6:
        assert cycle_of(found).time == pytest.approx(8 * math.pi, rel=1e-10)
    else:
        assert np.ptp(run.y[0]) > 0.1 and found.words == ["torus"]
    assert (found.labels == 0).all() and (strength < 2.0) == (np.ptp(run.y[0]) < 1e-6)


def test_diagrams_of_what_nothing_forces_show_maxima():
    """The block of data/scenes/block_on_belt_stick_slip.toml, by an integrator of order 8; van der Pol near 2."""
    belt = Strobe(load("block_on_belt"), parameters={"v_belt": 0.1})
    found = orbit_diagram(belt, "m", [1.0, 1.1], start={"x": 0.0, "v": 0.1}, execution=ALONE)
    assert found.points[0, 0, 0] == pytest.approx([0.069544271510672, 0.0], abs=1e-11)
    assert (found.periods == 1).all() and not found.failures
    weak = orbit_diagram(Strobe(van_der_pol()), "mu", [0.01, 0.1], execution=ALONE, transient=1000)
    assert weak.shown[0, :, 0] == pytest.approx([2.0, 2.0], abs=2e-3)
    with pytest.raises(StickslipError, match="rate of 'x' is no other state"):
        orbit_diagram(Strobe(lorenz()), "rho", [28.0])


def test_a_diagram_of_what_falls_shows_maxima_of_what_comes_back():
    """The woodpecker's angle is largest where its beak is at the pole, least as the event-driven code of
    test_woodpecker has it; its height drifts."""
    toy = Strobe(load("woodpecker"))
    found = orbit_diagram(toy, "eN1", [0.5, 0.51], of="phi_S", execution=ALONE)
    assert (found.periods == 1).all() and found.shown[0, :, 0] == pytest.approx([0.12, 0.12], abs=1e-12)
    least = orbit_diagram(toy, "eN1", [0.5], of="min(phi_S)", execution=ALONE)
    assert least.shown[0, 0, 0] == pytest.approx(-0.529471967111, abs=1e-11)
    with pytest.raises(StickslipError, match=r"'y' drifts.*Name a state that comes\s+back"):
        orbit_diagram(toy, "eN1", [0.5])


def test_a_woodpecker_falls_in_a_cycle():
    """Its height repeats itself never; the period of the event-driven code of test_woodpecker."""
    found = basins("woodpecker", execution=ALONE, w_S=np.linspace(-1.0, 1.0, 10))
    cycle = cycle_of(found)
    assert cycle.time == pytest.approx(0.145976065144, abs=1e-12)
    assert len(cycle.multipliers) == 4 and abs(cycle.multipliers[0]) < 1.0


def test_a_block_on_a_belt_sticks_and_slips():
    """It sticks, so that each difference is lost; belt speed times stick time is the way of the spring."""
    found = basins("block_on_belt", execution=ALONE, x=np.linspace(-0.2, 0.2, 4), v=np.linspace(-0.3, 0.3, 4))
    cycle = cycle_of(found)
    assert np.abs(cycle.multipliers).max() < 1e-9
    motion = cycle.section.trajectory(cycle.points[0], np.linspace(0.0, cycle.time, 20001))
    assert motion["x"][-1] == pytest.approx(motion["x"][0], abs=1e-10)
    # slipping alone: the published cycle tears off where k x + c v = N mu_s
    assert motion["x"].max() >= (9.81 * 0.65 - 0.5 * 0.1) / 100 - 1e-9


@pytest.mark.nightly
def test_rests_side_by_side_and_centres_are_no_cycles():
    q = Coordinate("q", "m", "q", velocity="v", start=1.0)
    ground = Friction(
        name="ground", slip=q.v, law=Coulomb(Parameter("N", 1.0, "N", "N"), Parameter("mu", 0.2, "1", "mu"))
    )
    m, k = Parameter("m", 1.0, "kg", "m"), Parameter("k", 1.0, "N/m", "k")
    box = Mechanism(
        name="dry_box", title="rubs", source="here", coordinates=[q], kinetic_energy=m * q.v**2 / 2,
        potential_energy=k * q**2 / 2, contacts=[ground],
    )  # fmt: skip
    found = basins(box, execution=ALONE, q=[-1.0, 0.33, 1.0], v=[0.1, 0.9])
    assert found.words == ["equilibria side by side"] and (found.labels == 0).all()
    assert np.abs(found.attractors[0].points[0, 0]) <= 0.2
    x, y = states(x=0.5, y=0.0)
    turning = basins(flow("centre", {x: y, y: -x}), execution=ALONE, x=[0.5, 1.0], y=[0.0])
    assert {attractor.word for attractor in turning.attractors} <= {"not decided"}


def test_a_strobe_is_as_fast_as_the_motion_and_as_fine_as_what_drifts():
    """A motion that is so many times slower or faster is looked at as much slower or faster."""
    usual, *others = (rate * Strobe(van_der_pol(), parameters={"rate": rate}).period for rate in (1.0, 1e-3, 20.0))
    assert others == pytest.approx([usual, usual], rel=1e-9)
    way = State("way", "1", "way", nominal=0.5)
    assert Strobe(flow("drifting", {way: sympy.Integer(2)})).period == pytest.approx(0.5 * 0.5 / 2.0)


def test_what_time_forces_wants_its_period():
    for name in ("bouncing_ball", "discontinuous_support", "fermi_accelerator"):
        with pytest.raises(StickslipError, match="needs a period"):
            basins(name, execution=ALONE, x=[0.1])


def test_what_creeps_into_an_equilibrium_is_no_cycle_of_rounding():
    """Steady sliding, damped weakly: the motion ends so near to it that rounding alone crosses levels."""
    sliding = Strobe(load("block_on_belt")).at(v_belt=0.562)
    found = basins(sliding, execution=ALONE, x=[0.037455421355022556], v=[0.0002676545551126123])
    assert {attractor.word for attractor in found.attractors} <= {"equilibrium"}
