"""Small mechanisms with dry friction, stops and rigid contacts whose every mode is linear, declared here."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import sympy
from quick_export import quick_export

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contacts import Contact
from fmu_models.language.friction import Friction
from fmu_models.language.impacts import Impact, Newton
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.kelvin_voigt import KelvinVoigt
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Coordinate, Parameter
from fmu_models.language.stops import Stop

m = Parameter("m", 1.0, "kg", "mass", positive=True)
k = Parameter("k", 1.0, "N/m", "stiffness", positive=True)
length = Parameter("length", 1.0, "m", "play to either side", positive=True)
f0 = Parameter("f0", 1.0, "N", "amplitude of the force")
omega = Parameter("omega", 1.0, "rad/s", "angular frequency of the force", positive=True)
c = Parameter("c", 0.02, "N s/m", "viscous damping", minimum=0.0)
N = Parameter("N", 0.4, "N", "limit of dry friction", minimum=0.0)
e = Parameter("e", 0.6, "1", "coefficient of restitution", minimum=0.0, maximum=1.0)
mu = Parameter("mu", 0.3, "1", "coefficient of friction", minimum=0.0)
g = Parameter("g", 9.81, "m/s2", "gravity", minimum=0.0)
dry = Coulomb(N, sympy.S.One)
x = Coordinate("x", "m", "place", velocity="v")
z = Coordinate("z", "m", "place", velocity="w")


def hinge() -> Mechanism:
    """Driven arm with dry friction in its hinge between two stops of spring and dashpot, one of which does not pull."""
    stiff = KelvinVoigt(Parameter("ks", 40.0, "N/m", "stiffness"), Parameter("d", 0.5, "N s/m", "damping"))
    contacts = [
        Friction(name="pin", slip=x.v, law=dry),
        Stop(name="upper", gap=length - x, law=stiff, release="force"),
        Stop(name="lower", gap=length + x, law=stiff, release="gap"),
    ]
    return _made("hinge", [x], m * x.v**2 / 2, k * x**2 / 8, contacts)


def damper() -> Mechanism:
    """Impact damper whose driven mass rubs on the ground, and the free one on a strip of its way."""
    law = Newton(e)
    contacts = [
        Friction(name="ground", slip=x.v, law=Coulomb(2 * N, sympy.S.One)),
        Friction(name="strip", slip=z.v, law=Coulomb(N, mu / 10), where=z - length / 2),
        Impact(name="right", gap=x + length - z, restitution=law),
        Impact(name="left", gap=z - x + length, restitution=law),
    ]
    return _made("damper", [x, z], m * x.v**2 / 2 + m * z.v**2 / 20, k * x**2 / 2, contacts)


def table() -> Mechanism:
    """Block on a table that shakes along the way out and up, where it lifts off, rubs and sticks."""
    A = Parameter("A", 7.0, "m", "amplitude of the table, upward")
    B = Parameter("B", 6.0, "m", "its amplitude along")
    height = A * sympy.sin(omega * TIME)
    along = x.v - B * omega * sympy.cos(omega * TIME + 1)
    contacts = [Impact(name="table", gap=z - height, restitution=Newton(e), slip=along, mu=mu)]
    return _made("table", [x, z], m * (x.v**2 + z.v**2) / 2, m * g * z, contacts)


MADE: dict[str, Callable[[], Mechanism]] = {one.__name__: one for one in (hinge, damper, table)}


@functools.cache
def opened(name: str) -> Fmu:
    """One of these, ready to run."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return Fmu.open(quick_export(MADE[name](), Path(folder) / f"{name}.fmu"))


def _made(
    name: str, coordinates: list[Coordinate], kinetic: sympy.Expr, potential: sympy.Expr, contacts: Sequence[Contact]
) -> Mechanism:
    return Mechanism(
        name=name,
        title=name,
        source="test",
        coordinates=coordinates,
        kinetic_energy=kinetic,
        potential_energy=potential,
        dissipation=sum((c * q.v**2 / 2 for q in coordinates), start=sympy.S.Zero),
        applied={x: f0 * sympy.cos(omega * TIME)},
        contacts=contacts,
    )
