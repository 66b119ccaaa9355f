"""Derivatives of whole runs against closed forms on piecewise linear models."""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
import pytest
import sympy
from close_columns import close
from colliding import opened
from hypothesis import given, settings
from hypothesis import strategies as st
from lazy_fmu import LazyFmu
from numpy.typing import ArrayLike
from steady_cycle import disc_rig

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb as CoulombLaw
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.sensitivity import SensitiveRun, Sensitivity
from fmu_models.simulation.signal import Signal

pytestmark = pytest.mark.digits

RIG = {"J": 0.0548, "k": 2.62, "c": 0.055, "R": 0.125, "r": 0.06, "N0": 4.905}
RIG_ON_ONE = LazyFmu("disc_rig", contacts=("disc0",))
TINY = 1e-40


def derivatives(closed: Callable[..., list[Any]], values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """A closed form (q,) and its derivatives (q, m) by its arguments: its imaginary part at value + i TINY."""
    value = np.real(closed(**values))
    columns = [np.imag(closed(**{**values, name: values[name] + TINY * 1j})) / TINY for name in values]
    return value, np.stack(columns, axis=1)


def root(f: Callable[[Any], Any], slope: Callable[[Any], Any], near: float) -> Any:
    """The zero of a function near a number, with its imaginary part: Newton's method in complex numbers."""
    t: Any = near
    for _ in range(30):
        t = t - f(t) / slope(t)
    return t


def damped(t, x, v, J, k, c, rest):
    """State after t of J x'' + c x' + k (x - rest) = 0 from (x, v)."""
    decay, w = c / (2 * J), cmath.sqrt(k / J - (c / (2 * J)) ** 2)
    a, b = x - rest, (v + decay * (x - rest)) / w
    swing = a * cmath.cos(w * t) + b * cmath.sin(w * t)
    turn = w * (b * cmath.cos(w * t) - a * cmath.sin(w * t))
    fade = cmath.exp(-decay * t)
    return rest + fade * swing, fade * (turn - decay * swing)


def test_free_decay_has_its_closed_form():
    by = {"theta": 0.15, "omega": -0.4, "J": 0.0548, "k": 2.62, "c": 0.055}
    times = np.arange(3001) / 1000

    def closed(theta, omega, **rig):
        return [value for t in times for value in damped(t, theta, omega, **rig, rest=0.0)]

    with SensitiveRun(disc_rig(()), by=list(by)) as kept:
        found = kept.run(times, start={"theta": 0.15, "omega": -0.4})
    value, derivative = derivatives(closed, by)
    assert found.names == ("theta", "omega") and found.derivative.shape == (3001, 2, 5)
    assert close(found.values, value.reshape(-1, 2), 1e-10)
    assert close(found.derivative.reshape(-1, 5), derivative, 1e-10)
    assert found.events == () and found.event_derivative.shape == (0, 5)


class Coulomb:
    """mu_s = mu_k, p = 0 and a drive w0 + a t: the body slips from (theta, omega), lands, lets go for good."""

    a = -0.1
    values: ClassVar = {"theta": -0.1, "omega": 0.0, **RIG, "mu_s0": 0.65, "w0": 0.83}
    times = np.concatenate([np.arange(0.0, 2.0, 0.01), [2.0]])

    def switches(self, theta, omega, J, k, c, R, r, N0, mu_s0, w0):
        """Times of landing and release, and the angle at landing."""
        rest = R * N0 * mu_s0 / k

        def miss(t):
            return damped(t, theta, omega, J, k, c, rest)[1] - r * (w0 + self.a * t) / R

        def miss_rate(t):
            x, v = damped(t, theta, omega, J, k, c, rest)
            return (-c * v - k * (x - rest)) / J - r * self.a / R

        land = root(miss, miss_rate, 0.04)
        angle = damped(land, theta, omega, J, k, c, rest)[0]

        def margin(t):
            v = r * (w0 + self.a * t) / R
            x = angle + r * (w0 * (t - land) + self.a * (t**2 - land**2) / 2) / R
            return R * N0 * mu_s0 - J * r * self.a / R - c * v - k * x

        def margin_rate(t):
            return -c * r * self.a / R - k * r * (w0 + self.a * t) / R

        return land, root(margin, margin_rate, 0.6), angle

    def states(self, times, **values):
        """theta and omega at each time, one after the other."""
        v = dict(values)
        land, release, angle = self.switches(**v)
        J, k, c, R, r = v["J"], v["k"], v["c"], v["R"], v["r"]
        rest = R * v["N0"] * v["mu_s0"] / k

        def stuck(t):
            drive = r * (v["w0"] * (t - land) + self.a * (t**2 - land**2) / 2) / R
            return angle + drive, r * (v["w0"] + self.a * t) / R

        found = []
        for t in times:
            if t < land.real:
                found += damped(t, v["theta"], v["omega"], J, k, c, rest)
            elif t < release.real:
                found += stuck(t)
            else:
                found += damped(t - release, *stuck(release), J, k, c, rest)
        return found

    def run(self, times: ArrayLike = times) -> Sensitivity:
        by = list(self.values)
        with SensitiveRun(RIG_ON_ONE, by=by) as kept:
            return kept.run(
                times,
                start={"theta": -0.1, "omega": 0.0},
                parameters={"mu_k0": 0.65, "p0": 0.0},
                inputs={"w0": Signal([0.0, 3.0], [0.83, 0.83 + 3 * self.a])},
            )


def test_slip_stick_slip_has_its_closed_form():
    """All is closed form under Coulomb friction: every state at every time, and the times of landing and release."""
    model = Coulomb()
    found = model.run()
    value, derivative = derivatives(lambda **v: model.states(model.times, **v), model.values)
    assert [event.after for event in found.events] == [0, 1]
    assert close(found.values, value.reshape(-1, 2), 1e-11)
    assert close(found.derivative.reshape(-1, 10), derivative, 1e-10)
    at, by = derivatives(lambda **v: list(model.switches(**v)[:2]), model.values)
    assert [event.time for event in found.events] == pytest.approx(at, abs=1e-12)
    assert close(found.event_derivative.T, by.T, 1e-10)


def test_at_the_time_of_an_event_the_derivative_is_the_one_after_it():
    """At landing omega follows the disc from then on, whatever theta was."""
    model = Coulomb()
    land, release = (event.time for event in model.run().events)
    # landing a little later or earlier would be before it; values are those after
    found = model.run([land, release])
    for row, time in enumerate((land, release)):
        expected = derivatives(lambda t=time, **v: model.states([t + 1e-14], **v), model.values)[1]
        assert found.derivative[row] == pytest.approx(expected, rel=1e-10, abs=1e-10)
    assert found.of("omega")[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_a_start_in_stick_is_held_by_the_disc():
    """A neighbour off the speed of the disc is brought to it at once: omega follows the drive, not its own start."""
    by = ["theta", "omega", "w0", "r", "R", "mu_s0"]
    v = 0.06 * 0.2 / 0.125
    with SensitiveRun(RIG_ON_ONE, by=by, recorded=["theta", "omega", "F0"]) as kept:
        found = kept.run([0.0, 0.3], start={"theta": 0.0, "omega": v}, inputs={"w0": 0.2})
    omega = [0.0, 0.0, 0.06 / 0.125, 0.2 / 0.125, -v / 0.125, 0.0]
    assert found.of("omega") == pytest.approx(np.array([omega, omega]), abs=1e-12)
    assert found.of("theta")[1] == pytest.approx([1.0, *(0.3 * np.array(omega[1:]))], abs=1e-12)
    # in stick the force is what balances the spring: (k theta + c omega)/R
    force = (2.62 * found.of("theta") + 0.055 * found.of("omega")) / 0.125
    force[:, by.index("R")] -= (2.62 * found["theta"] + 0.055 * found["omega"]) / 0.125**2
    assert found.of("F0") == pytest.approx(force, abs=1e-10)


def test_stick_by_a_lever_that_turns_has_its_closed_form():
    """(1 + r sin q) q' = b holds: q - r cos q = q0 - r cos q0 + b t, whatever pulls at it."""
    r, b, q0 = 0.5, 1.0, 0.25
    q = Coordinate("q", "1", "place", velocity="v")
    share, speed = Parameter("r", r, "1", "lever"), Parameter("b", b, "1", "speed of the belt")
    slip = (1 + share * sympy.sin(q)) * q.v - speed
    belt = Friction(name="belt", slip=slip, law=CoulombLaw(Parameter("N", 50.0, "1", "load"), sympy.S.One))
    swing = Mechanism(
        name="lever",
        title="t",
        source="s",
        coordinates=[q],
        kinetic_energy=q.v**2 / 2,
        potential_energy=3 * q**2 / 2,
        contacts=[belt],
    )
    times = np.linspace(0.1, 2.0, 20)
    with SensitiveRun(opened(swing), by=["q", "b"]) as kept:
        found = kept.run(times, start={"q": q0, "v": b / (1 + r * np.sin(q0))})
    assert found.events == ()
    place = found["q"]
    assert place - r * np.cos(place) == pytest.approx(q0 - r * np.cos(q0) + b * times, abs=1e-13)
    lever, turn = 1 + r * np.sin(place), r * np.cos(place)
    by_start, by_speed = (1 + r * np.sin(q0)) / lever, times / lever
    assert found.of("q") == pytest.approx(np.stack([by_start, by_speed], axis=1), abs=1e-12)
    rates = np.stack([-b * turn * by_start, lever - b * turn * by_speed], axis=1) / lever[:, None] ** 2
    assert found.of("v") == pytest.approx(rates, abs=1e-12)


def test_bounces_have_their_closed_form():
    """x'' = -g over a table at rest: two impacts, restitution e."""
    values = {"x": 0.3, "v": -0.5, "g": 9.81, "e": 0.7}
    times = np.array([0.05, 0.2, 0.4, 0.55, 0.62, 0.7])

    def impacts(x, v, g, e):
        speed = cmath.sqrt(v * v + 2 * g * x)
        first = (v + speed) / g
        return first, first + 2 * e * speed / g, speed

    def closed(x, v, g, e):
        first, second, speed = impacts(x, v, g, e)
        found = []
        for t in times:
            since, up = (t, v) if t < first.real else (t - first, e * speed)
            if t > second.real:
                since, up = t - second, e * e * speed
            found += [(x if t < first.real else 0.0) + up * since - g * since**2 / 2, up - g * since]
        return found

    with SensitiveRun(Fmu.open(built("bouncing_ball")), by=list(values)) as kept:
        found = kept.run(times, parameters={"A": 0.0, "g": 9.81, "e": 0.7}, start={"x": 0.3, "v": -0.5})
        # an impact at the very start: v after it is -e v
        struck = kept.run([0.0, 0.1], parameters={"A": 0.0, "e": 0.7}, start={"x": 0.0, "v": -1.0})
    value, derivative = derivatives(closed, values)
    assert found.values == pytest.approx(value.reshape(-1, 2), abs=1e-12)
    assert close(found.derivative.reshape(-1, 4), derivative, 1e-10)
    at, by = derivatives(lambda **v: list(impacts(**v)[:2]), values)
    assert [event.time for event in found.events] == pytest.approx(at, abs=1e-12)
    assert close(found.event_derivative, by, 1e-10)
    assert struck.derivative[0, 1] == pytest.approx([0.0, -0.7, 0.0, 1.0], abs=1e-12)
    assert struck.derivative[1, 0] == pytest.approx([1.0, -0.07, -0.005, 0.1], abs=1e-12)


def test_the_end_of_a_chatter_has_a_time_without_derivative():
    """Bounces n = 0, 1, ... of a ball dropped from x are at sqrt(2 x/g) (1 + 2 (e + ... + e^n)); then it rests."""
    with SensitiveRun(Fmu.open(built("bouncing_ball")), by=["x", "e"]) as kept:
        found = kept.run([1.0], parameters={"A": 0.0, "e": 0.5}, start={"x": 0.1, "v": 0.0})
    fall = np.sqrt(0.2 / 9.81)
    for n, by in enumerate(found.event_derivative[:10]):
        powers = np.arange(1, n + 1)
        expected = [fall * (1 + 2 * (0.5**powers).sum()) / 0.2, 2 * fall * (powers * 0.5 ** (powers - 1)).sum()]
        assert by == pytest.approx(expected, rel=1e-10)
    assert found.events[-1].after == 3 and found.events[-1].time == pytest.approx(3 * fall, rel=1e-7)
    assert np.isnan(found.event_derivative[-1]).all() and np.isfinite(found.event_derivative[:-1]).all()
    assert found.values[0] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert found.derivative[0] == pytest.approx(np.zeros((2, 2)), abs=1e-7)


@pytest.mark.parametrize("dip", [0.0, 1e-15, 1e-14])
def test_a_motion_that_grazes_has_no_derivative(dip):
    """x = sin(t) touches a support at 1 - dip with the speed sqrt(2 dip): two roots that rounding makes one."""
    run = {"start": {"x": 0.0, "v": 1.0}, "parameters": {"f0": 0.0, "c": 0.0, "g": 1.0 - dip}}
    with SensitiveRun(Fmu.open(built("discontinuous_support")), by=["v"]) as kept:
        with pytest.raises(StickslipError, match=r"no derivative at t = 1\.570796\d+: .* contact 'support'"):
            kept.run([2.5], **run)
        before = kept.run([1.5], **run)
        deeper = kept.run([2.5], start=run["start"], parameters={"f0": 0.0, "c": 0.0, "g": 1.0 - 1e-8})
    assert before.derivative[0, :, 0] == pytest.approx([np.sin(1.5), np.cos(1.5)], abs=1e-14)
    # sin(t) v = 1 - dip: dt/dv = -tan(t), where cos(t) = sqrt(2 dip)
    assert deeper.event_derivative[0, 0] == pytest.approx(-1 / np.sqrt(2e-8), rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(theta=st.floats(-0.2, 0.3), omega=st.floats(-0.5, 0.5), w0=st.floats(0.1, 1.0), cut=st.floats(0.05, 0.95))
def test_two_runs_one_after_the_other_have_the_product_of_their_derivatives(theta, omega, w0, cut):
    """d x(1)/d x(0) = d x(1)/d x(t) d x(t)/d x(0), with events on either side."""
    with SensitiveRun(RIG_ON_ONE, by=["theta", "omega"]) as kept:
        whole = kept.run([cut, 1.0], start={"theta": theta, "omega": omega}, inputs={"w0": w0})
        middle = dict(zip(whole.names, whole.values[0].tolist(), strict=True))
        rest = kept.run([1.0], start_time=cut, start=middle, inputs={"w0": w0})
    product = rest.derivative[0] @ whole.derivative[0]
    assert rest.values[0] == pytest.approx(whole.values[1], abs=1e-9)
    assert product == pytest.approx(whole.derivative[1], abs=1e-6 * max(1.0, np.abs(product).max()))
