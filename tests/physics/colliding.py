"""Small mechanisms whose impacts have closed forms, declared here, and those closed forms."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path

import numpy as np
import sympy
from numpy.typing import NDArray
from quick_export import quick_export

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.impacts import Impact, Newton, Poisson
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter

LAWS = {"newton": Newton, "poisson": Poisson}

g = Parameter("g", 0.0, "m/s2", "gravity")
m = Parameter("m", 1.0, "kg", "mass", positive=True)
e = Parameter("e", 0.5, "1", "coefficient of restitution")
mu = Parameter("mu", 0.3, "1", "coefficient of friction")
e2 = Parameter("e2", 0.5, "1", "coefficient of restitution, second contact")
mu2 = Parameter("mu2", 0.3, "1", "coefficient of friction, second contact")


def opened(mechanism: Mechanism) -> Fmu:
    with tempfile.TemporaryDirectory() as folder:
        return Fmu.open(quick_export(mechanism, Path(folder) / f"{mechanism.name}.fmu"))


@functools.cache
def cradle(law: str) -> Fmu:
    """Three balls in a row, of which only the gaps matter."""
    x = [Coordinate(f"x{i}", "m", f"place of ball {i}", velocity=f"v{i}") for i in (1, 2, 3)]
    gaps = [
        Impact(name="first", gap=x[1] - x[0], restitution=LAWS[law](e)),
        Impact(name="second", gap=x[2] - x[1], restitution=LAWS[law](e2)),
    ]
    energy = sum((m * q.v**2 / 2 for q in x), start=sympy.S.Zero)
    name = f"cradle_{law}"
    return opened(Mechanism(name=name, title="t", source="s", coordinates=x, kinetic_energy=energy, contacts=gaps))


@functools.cache
def rod(law: str) -> Fmu:
    """A uniform rod over a floor; its end at -l (cos theta, sin theta) from the middle may touch that."""
    half = Parameter("l", 1.0, "m", "half its length", positive=True)
    x, y = (Coordinate(name, "m", "of the middle", velocity=f"v{name}") for name in "xy")
    theta = Coordinate("theta", "rad", "angle from the horizontal", velocity="w")
    end = Impact(
        name="end",
        gap=y - half * sympy.sin(theta),
        restitution=LAWS[law](e),
        slip=x.v + half * sympy.sin(theta) * theta.v,
        mu=mu,
    )
    energy = m * (x.v**2 + y.v**2) / 2 + m * half**2 * theta.v**2 / 6
    mechanism = Mechanism(
        name=f"rod_{law}",
        title="t",
        source="s",
        coordinates=[x, y, theta],
        kinetic_energy=energy,
        potential_energy=m * g * y,
        contacts=[end],
    )
    return opened(mechanism)


@functools.cache
def plate(law: str) -> Fmu:
    """A rigid plate with two corners at (-+b, -h) from its middle, for small angles."""
    b, h = (Parameter(name, value, "m", "corner", positive=True) for name, value in (("b", 1.0), ("h", 0.5)))
    J = Parameter("J", 0.4, "kg m2", "moment of inertia", positive=True)
    x, y = (Coordinate(name, "m", "of the middle", velocity=f"v{name}") for name in "xy")
    phi = Coordinate("phi", "rad", "angle", velocity="w")
    slip = x.v + h * phi.v
    corners = [
        Impact(name="left", gap=y - b * phi, restitution=LAWS[law](e), slip=slip, mu=mu),
        Impact(name="right", gap=y + b * phi, restitution=LAWS[law](e2), slip=slip, mu=mu2),
    ]
    energy = m * (x.v**2 + y.v**2) / 2 + J * phi.v**2 / 2
    name = f"plate_{law}"
    return opened(
        Mechanism(name=name, title="t", source="s", coordinates=[x, y, phi], kinetic_energy=energy, contacts=corners)
    )


@functools.cache
def pendulum(law: str) -> Fmu:
    """Two uniform rods of mass m and length l, hinged to each other and over a floor at the depth ``height``."""
    length = Parameter("l", 1.0, "m", "length of either rod", positive=True)
    height = Parameter("height", 2.0, "m", "of the hinge over the floor", positive=True)
    a, b = (Coordinate(f"q{i}", "rad", f"angle of rod {i} from the vertical", velocity=f"w{i}") for i in (1, 2))
    tip = Impact(
        name="tip",
        gap=height - length * (sympy.cos(a) + sympy.cos(b)),
        restitution=LAWS[law](e),
        slip=length * (sympy.cos(a) * a.v + sympy.cos(b) * b.v),
        mu=mu,
    )
    energy = m * length**2 * (a.v**2 * 2 / 3 + b.v**2 / 6 + a.v * b.v * sympy.cos(a - b) / 2)
    name = f"pendulum_{law}"
    return opened(
        Mechanism(name=name, title="t", source="s", coordinates=[a, b], kinetic_energy=energy, contacts=[tip])
    )


@functools.cache
def block() -> Fmu:
    """A block pushed along a table that shakes vertically, A sin(omega t)."""
    A = Parameter("A", 0.0, "m", "amplitude of the table")
    omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the table")
    F = Parameter("F", 0.0, "N", "push")
    x, y = (Coordinate(name, "m", "place", velocity=f"v{name}") for name in "xy")
    table = Impact(name="table", gap=y - A * sympy.sin(omega * TIME), restitution=Newton(e), slip=x.v, mu=mu)
    mechanism = Mechanism(
        name="block_on_table",
        title="t",
        source="s",
        coordinates=[x, y],
        kinetic_energy=m * (x.v**2 + y.v**2) / 2,
        potential_energy=m * g * y,
        applied={x: F},
        contacts=[table],
    )
    return opened(mechanism)


def one_contact(
    mass: NDArray, normal: NDArray, tangent: NDArray, speeds: NDArray, e: float, mu: float, law: str
) -> NDArray[np.float64]:
    """Velocities after an impact of one contact with friction: it sticks where it can and slips where it must.

    Newton: one equation, gap speed after = -e times before. Poisson: two phases of plastic and given impulse.
    """
    W = np.linalg.solve(mass, np.stack([normal, tangent], axis=1))
    G = np.stack([normal, tangent]) @ W

    def phase(before: NDArray, prescribed: float | None, target: float) -> NDArray:
        """Impulses (normal, tangential) with the gap speed ``target`` after it, or a prescribed normal impulse."""
        if prescribed is None:
            stick = np.linalg.solve(G, [target - before[0], -before[1]])
        else:
            stick = np.array([prescribed, -(before[1] + G[0, 1] * prescribed) / G[1, 1]])
        if stick[0] >= 0 and abs(stick[1]) <= mu * stick[0]:
            return stick
        for side in (1, -1):
            force = prescribed if prescribed is not None else (target - before[0]) / (G[0, 0] - side * mu * G[0, 1])
            slip = np.array([force, -side * mu * force])
            if force >= 0 and side * (before + G @ slip)[1] >= 0:
                return slip
        raise AssertionError("no solution")

    before = np.array([normal @ speeds, tangent @ speeds])
    if law == "newton":
        return speeds + W @ phase(before, None, -e * before[0])
    compression = phase(before, None, 0.0)
    middle = before + G @ compression
    expansion = phase(middle, e * compression[0], 0.0)
    if (middle + G @ expansion)[0] < 0:
        expansion = phase(middle, None, 0.0)
    return speeds + W @ (compression + expansion)
