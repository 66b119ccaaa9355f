"""What nothing forces, at a section: exponents of Lorenz' system as published, and starts that do not settle."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import sympy

from fmu_models import (
    Automaton,
    Coordinate,
    Coulomb,
    Crossing,
    Fmu,
    Friction,
    Mechanism,
    Parameter,
    State,
    StickslipError,
    Strobe,
    branch,
    load,
    lyapunov,
)
from fmu_models.codegen.package import built_of
from fmu_models.families.execution import Execution
from fmu_models.families.jobs import Jobs
from fmu_models.language.quantities import TIME
from fmu_models.lowering.lower import lower

GO = np.zeros(1, np.int32)
ON = {"x": 5.0, "y": 5.0, "z": 20.0}


@cache
def lorenz() -> Fmu:
    """Lorenz 1963: sigma 10, rho 28, beta 8/3. Exponents .9056, 0, -14.5723 (Viswanath, dissertation, Cornell 1998)."""
    s, r, b = (
        Parameter("s", 10.0, "1/s", "sigma"),
        Parameter("r", 28.0, "1", "rho"),
        Parameter("b", 8 / 3, "1/s", "beta"),
    )
    unit = Parameter("unit", 1.0, "1/s", "rate", positive=True)
    x, y, z = (State(name, "1", name, start=start, nominal=10.0) for name, start in ON.items())
    flows = {x: s * (y - x), y: unit * (x * (r - z) - y), z: unit * x * y - b * z}
    model = Automaton(name="lorenz", title="Lorenz", source="Lorenz 1963", states=[x, y, z], flows=flows)
    return Fmu.open(built_of(lower(model)))


def test_a_level_is_crossed_as_often_with_tangents_as_without():
    section = Crossing(lorenz(), "z", 27.0)
    starts = section.start(ON)[None]
    plain = section.run(Jobs(starts, rows=60), GO)
    assert (plain.points[0, :, 2] == 27.0).all()
    for flow in (False, True):
        followed = section.run(Jobs(starts, rows=60, tangents=2, flow=flow), GO)
        assert followed.times[0, :20] == pytest.approx(plain.times[0, :20], rel=1e-6)
        assert (followed.times[0] > 0.1).all()
        assert (followed.points[0, :, 2] == 27.0).all()


@pytest.mark.nightly_for("long strobe")
@pytest.mark.parametrize(
    ("section", "known"),
    [
        (lambda: Crossing(lorenz(), "z", 27.0), (0.9056, -14.5723)),
        (lambda: Strobe(lorenz(), period=5.0, autonomous=True), (0.9056, 0.0, -14.5723)),
    ],
    ids=["level", "long strobe"],
)
def test_exponents_of_lorenz(section, known):
    """The contracting one too, of which a step leaves less than rounding beside the growing one: exp(-77) in 5 s."""
    found = lyapunov(section(), ON, periods=6000, transient=50, execution=Execution(workers=1))
    assert found.lost == 0
    assert found.zero == (1 if len(known) == 3 else None)
    assert (np.abs(found.per_time - known) <= 4.0 * found.per_time_errors + 1e-4).all(), found
    assert found.per_time_errors.max() < 0.01
    # their sum is the divergence, -(sigma + 1 + beta), of the motion between equal points of a section but for its ends
    assert found.per_time.sum() == pytest.approx(-(11.0 + 8.0 / 3.0), rel=1e-3)


def test_chaos_that_ends_at_rest_is_told_with_both_values():
    """At rho = 22 chaos passes; what it leaves is a rest, whose eigenvalues are known, and its exponent is near that of
    rho = 28. A sum of all exponents would tell nothing: it is the same all along."""
    section = Strobe(lorenz(), period=0.5, autonomous=True, parameters={"r": 22.0})
    start = {"x": 1.0, "y": 1.0, "z": 20.0}
    found = lyapunov(section, start, periods=6400, transient=20, execution=Execution(workers=1))
    assert found.transient is not None and found.transient.motions >= 4
    assert found.transient.value == pytest.approx(0.8, abs=0.25)
    x = np.sqrt(8.0 / 3.0 * 21.0)
    slow = np.linalg.eigvals([[-10.0, 10.0, 0.0], [1.0, -1.0, -x], [x, x, -8.0 / 3.0]]).real.max()
    assert found.per_time[1] == pytest.approx(slow, abs=0.02) and abs(found.per_time[0]) < 0.02


def growing(rubs: bool) -> Strobe:
    m, c, k = Parameter("m", 1.0, "kg", "m"), Parameter("c", -0.1, "N s/m", "c"), Parameter("k", 1.0, "N/m", "k")
    w, force = Parameter("w", 1.3, "rad/s", "w"), Parameter("F", 1.0, "N", "F")
    x = Coordinate("x", "m", "x", velocity="v", start=1.0)
    slides = Friction(
        name="ground", slip=x.v, law=Coulomb(Parameter("N", 0.1, "N", "N"), Parameter("mu", 0.5, "1", "mu"))
    )
    model = Mechanism(
        name="growing", title="grows", source="here", coordinates=[x], kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2 - force * sympy.cos(w * TIME) * x, dissipation=c * x.v**2 / 2,
        contacts=[slides] if rubs else [],
    )  # fmt: skip
    return Strobe(load(model), forcing="w")


@pytest.mark.nightly_for("True")
@pytest.mark.parametrize("rubs", [False, True])
def test_a_start_that_goes_to_infinity_does_not_settle(rubs):
    """Damping -0.1: with friction, too, whose events go on all the way."""
    with pytest.raises(StickslipError, match="does not settle: the motion goes to infinity"):
        branch(growing(rubs), "F", (0.5, 1.5), settle=True)
