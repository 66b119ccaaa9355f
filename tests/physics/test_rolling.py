"""Rolling resistance, friction of an angle, against closed forms: a wheel that rolls without slip on a plane.

(J + m r^2) omega' = M - mu_r N r sgn(omega),    N = m g
"""

from __future__ import annotations

import pytest

from fmu_models import Coordinate, Coulomb, Friction, Input, Mechanism, Output, Parameter, load, simulate
from fmu_models.language.contact_kinds import SLIP_PLUS, STICK

m = Parameter("m", 2.0, "kg", "mass of the wheel", positive=True)
J = Parameter("J", 0.03, "kg m2", "moment of inertia of the wheel", positive=True)
r = Parameter("r", 0.2, "m", "radius of the wheel", positive=True)
g = Parameter("g", 9.81, "m/s2", "gravity", minimum=0.0)
mu_r = Parameter("mu_r", 0.015, "1", "coefficient of rolling resistance", minimum=0.0)
M = Input("M", 0.0, "N m", "driving moment")
angle = Coordinate("phi", "rad", "angle of the wheel", velocity="w", v_start=3.0)
ROAD = Friction(name="road", slip=angle.v, law=Coulomb(m * g * r, mu_r), description="wheel on the road")
WHEEL = Mechanism(
    name="wheel",
    title="Wheel that rolls without slip",
    source="closed form",
    coordinates=[angle],
    kinetic_energy=(J + m * r**2) * angle.v**2 / 2,
    applied={angle: M},
    contacts=[ROAD],
    outputs=[Output("moment", ROAD.force, "N m", "moment of the road on the wheel")],
)
INERTIA = 0.03 + 2.0 * 0.2**2
CAPACITY = 0.015 * 2.0 * 9.81 * 0.2  # mu_r N r, N m


@pytest.fixture(scope="module")
def wheel():
    return load(WHEEL)


def test_the_wheel_stops_where_the_closed_form_says(wheel):
    run = simulate(wheel, 10.0)
    time = 3.0 * INERTIA / CAPACITY
    (stop,) = run.events
    assert (stop.before, stop.after) == (SLIP_PLUS, STICK)
    # one step of polynomials of second degree: rounding alone
    assert stop.time == pytest.approx(time, rel=1e-14)
    assert run["phi"][-1] == pytest.approx(3.0 * time / 2, rel=1e-14)
    assert run["moment"][0] == pytest.approx(-CAPACITY, rel=1e-15)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_it_holds_up_to_its_capacity_and_no_further(wheel, factor):
    run = simulate(wheel, 2.0, start={"w": 0.0}, inputs={"M": factor * CAPACITY})
    expected = max(factor - 1.0, 0.0) * CAPACITY / INERTIA * 2.0
    # the difference of two moments that agree to 1 %
    assert run["w"][-1] == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert run["moment"][-1] == pytest.approx(-min(factor, 1.0) * CAPACITY, rel=1e-14)
