"""A mass that two belts push to where they meet, while it rubs on the ground: its crossings of the joint accumulate."""

from __future__ import annotations

from functools import cache
from math import sqrt

import pytest
import sympy
from colliding import opened

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate


@cache
def two_belts() -> Fmu:
    m, w = Parameter("m", 1.0, "kg", "mass"), Parameter("w", 5.0, "m/s", "speed of the belts")
    left, right, ground = (Parameter(name, 1.0, "N", "friction force") for name in ("L", "R", "H"))
    joint = Parameter("joint", 0.0, "m", "where the belts meet")
    q = Coordinate("q", "m", "position", velocity="v")
    return opened(
        Mechanism(
            name="two_belts",
            title="A mass between two belts",
            source="test",
            coordinates=[q],
            kinetic_energy=m * q.v**2 / 2,
            contacts=[
                Friction(name="left", slip=q.v - w, law=Coulomb(left, sympy.S.One), where=joint - q),
                Friction(name="right", slip=q.v + w, law=Coulomb(right, sympy.S.One), where=q - joint),
                Friction(name="ground", slip=q.v, law=Coulomb(ground, sympy.S.One)),
            ],
        )
    )


def limit(left: float, right: float, ground: float) -> float:
    """The sum of all turns from v = 1: out with belt + ground, back with belt - ground."""
    ratio = {belt: sqrt((belt - ground) / (belt + ground)) for belt in (left, right)}

    def turn(speed: float, belt: float) -> float:
        return speed / (belt + ground) + speed * ratio[belt] / (belt - ground)

    return (turn(1.0, right) + turn(ratio[right], left)) / (1 - ratio[left] * ratio[right])


@pytest.mark.parametrize(("left", "right", "ground"), [(1.0, 1.0, 0.3), (1.0, 1.2, 0.3), (2.0, 1.9, 0.6)])
@pytest.mark.parametrize("joint", [0.0, 1.5])
def test_a_mass_comes_to_rest_where_the_ground_holds_it(left: float, right: float, ground: float, joint: float) -> None:
    """The limit of the geometric sequence of its turns; off the origin turns below 1e-16 m and 1e-8 s are not seen."""
    parameters = {"L": left, "R": right, "H": ground, "joint": joint}
    run = simulate(two_belts(), 20.0, start={"q": joint, "v": 1.0}, parameters=parameters, output_times=[20.0])
    assert run.events[-1].time == pytest.approx(limit(left, right, ground), rel=1e-12, abs=1e-6 * joint)
    assert (run["q"][0], run["v"][0]) == (joint, 0.0)


def test_where_nothing_holds_it_the_run_says_where() -> None:
    """The belts differ by more than the ground holds: it would have to rest on a part of each."""
    parameters = {"L": 1.0, "R": 1.9, "H": 0.3}
    with pytest.raises(StickslipError, match=r"switches ever faster up to t = 6\.78096288\d+: .* cannot rest where"):
        simulate(two_belts(), 20.0, start={"v": 1.0}, parameters=parameters)
    assert limit(1.0, 1.9, 0.3) == pytest.approx(6.7809628865952574, rel=1e-14)
