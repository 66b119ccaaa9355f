"""Mechanisms of textbooks, declared as a user would, and their FMUs."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import sympy
from quick_export import quick_export

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.language.stops import Stop

# units of what follows
LOAD = Parameter("N", 1.0, "N", "load")
MASS = Parameter("m", 1.0, "kg", "mass", positive=True)
LENGTH = Parameter("l", 1.0, "m", "length", positive=True)
GRAVITY = Parameter("g", 9.81, "m/s2", "acceleration of free fall")
STIFFNESS = Parameter("k", 1.0, "N/m", "stiffness", positive=True)
DAMPING = Parameter("c", 1.0, "N s/m", "damping", minimum=0.0)


def opened(mechanism: Mechanism | Automaton) -> Fmu:
    """Its FMU, built anew."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return Fmu.open(quick_export(mechanism, Path(folder) / f"{mechanism.name}.fmu"))


def mechanism(name: str, coordinates: list[Coordinate], T: sympy.Expr, U: sympy.Expr, contacts: list) -> Mechanism:
    """With title and source filled in."""
    return Mechanism(
        name=name,
        title=name,
        source="test",
        coordinates=coordinates,
        kinetic_energy=T,
        potential_energy=U,
        contacts=contacts,
    )


def rubbing(name: str, slip: sympy.Expr, capacity: float) -> Friction:
    """Friction of constant magnitude, N."""
    return Friction(name=name, slip=slip, law=Coulomb(LOAD, sympy.Float(capacity)))


def crank_without_rod() -> Mechanism:
    """A flywheel whose crank drives a slider without mass that rubs; no lever at its dead centres."""
    J = Parameter("J", 1.0, "kg m2", "moment of inertia", positive=True)
    r = Parameter("r", 0.3, "m", "crank", positive=True)
    F = Parameter("F", 0.0, "N", "friction of the slider", minimum=0.0)
    q = Coordinate("q", "rad", "angle", velocity="w")
    slider = Friction(name="slider", slip=r * sympy.sin(q) * q.v, law=Coulomb(F, sympy.S.One))
    return mechanism("crank", [q], J * q.v**2 / 2, sympy.S.Zero, [slider])


@cache
def slider_crank() -> Fmu:
    """J = 0.4 kg m2, crank 0.3 m, rod 0.8 m without mass, slider of 2 kg that rubs on its guide with F."""
    F = Parameter("F", 0.3, "N", "friction of the slider", minimum=0.0)
    q = Coordinate("q", "rad", "angle of the crank", velocity="w")
    r, rod = sympy.Rational(3, 10) * LENGTH, sympy.Rational(8, 10) * LENGTH
    place = r * sympy.cos(q) + sympy.sqrt(rod**2 - r**2 * sympy.sin(q) ** 2)
    speed = sympy.diff(place, q) * q.v
    guide = Friction(name="guide", slip=speed, law=Coulomb(F, sympy.S.One))
    T = MASS * (sympy.Rational(4, 10) * LENGTH**2 * q.v**2 / 2 + speed**2)
    return opened(mechanism("slider_crank", [q], T, sympy.S.Zero, [guide]))


@cache
def pendulum(links: int, capacities: tuple[float, ...]) -> Fmu:
    """Links of 1 m without mass, 1 kg at the end of each, absolute angles from below; joints rub with N m per rad."""
    q = [Coordinate(f"q{i}", "rad", f"angle of link {i}", velocity=f"w{i}") for i in range(links)]
    T = (
        MASS
        * LENGTH**2
        * sum(
            sympy.Rational(links - max(i, j), 2) * a.v * b.v * (sympy.cos(a - b) if i != j else 1)
            for i, a in enumerate(q)
            for j, b in enumerate(q)
        )
    )
    U = -MASS * GRAVITY * LENGTH * sum((links - i) * sympy.cos(a) for i, a in enumerate(q))
    joints = [
        rubbing(f"joint{i}", LENGTH * (a.v - (q[i - 1].v if i else 0)), capacities[i])
        for i, a in enumerate(q)
        if capacities[i]
    ]
    return opened(mechanism("pendulum", q, T, U, joints))


@cache
def cart_pole() -> Fmu:
    """A cart of 1 kg that rubs with 0.6 N and meets a stop at x = 0.4 m; a pole of 0.5 m with 0.3 kg at its end."""
    x = Coordinate("x", "m", "place of the cart", velocity="v")
    q = Coordinate("q", "rad", "angle of the pole from above", velocity="w")
    m, length = sympy.Rational(3, 10) * MASS, LENGTH / 2
    T = (MASS + m) * x.v**2 / 2 + m * length * sympy.cos(q) * x.v * q.v + m * length**2 * q.v**2 / 2
    stop = Stop(
        name="stop",
        gap=sympy.Rational(4, 10) * LENGTH - x,
        law=KelvinVoigt(2000 * STIFFNESS, 3 * DAMPING),
        release="gap",
    )
    return opened(
        mechanism("cart_pole", [x, q], T, m * GRAVITY * length * sympy.cos(q), [rubbing("rail", x.v, 0.6), stop])
    )


def masses(
    name: str, springs: list[tuple[int, int, int]], capacities: list[float], walls: list[tuple[int, int]]
) -> Fmu:
    """Masses of 1 kg that rub on the ground: springs (mass, mass, N/m) between them and (mass, N/m) to walls."""
    q = [Coordinate(f"q{i}", "m", f"place of mass {i}", velocity=f"v{i}") for i in range(len(capacities))]
    T = sympy.Add(*(MASS * x.v**2 / 2 for x in q))
    U = sympy.Add(
        *(STIFFNESS * sympy.Rational(k, 2) * (q[i] - q[j]) ** 2 for i, j, k in springs),
        *(STIFFNESS * sympy.Rational(k, 2) * q[i] ** 2 for i, k in walls),
    )
    return opened(mechanism(name, q, T, U, [rubbing(f"f{i}", x.v, capacities[i]) for i, x in enumerate(q)]))


@cache
def three_masses() -> Fmu:
    """Three in a row, the first at a wall."""
    return masses("three_masses", [(0, 1, 60), (1, 2, 40)], [1.0, 1.5, 0.7], [(0, 100)])


@cache
def grid(side: int) -> Fmu:
    """Blocks in a square, springs to all neighbours and to the walls around; they move across the square."""
    at = {(row, column): row * side + column for row in range(side) for column in range(side)}
    springs = [(at[r, c], at[n], 50) for r, c in at for n in ((r + 1, c), (r, c + 1)) if n in at]
    walls = [(at[r, c], 50) for r, c in at if r in (0, side - 1) or c in (0, side - 1)]
    return masses("grid", springs, [1.0 + 0.25 * (i % 5) for i in range(side**2)], walls)
