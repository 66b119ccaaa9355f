"""A body with its contacts, declared by its energies.

    d/dt dT/dv - dT/dq = -dU/dq - dD/dv + Q + sum_c (d slip_c/dv)^T lambda_c

T kinetic energy, U potential energy, D dissipation (Rayleigh: c v^2/2 for a dashpot), Q applied generalised forces; a
stop with depth d acts with -(d d'/dv)^T F, a rigid contact with gap g with (d g'/dv)^T lambda.
The equations of motion are derived from this (lowering), never typed.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy

from fmu_models.base.errors import named
from fmu_models.language.checks import check_mechanism
from fmu_models.language.contacts import Contact, Law, Requirement
from fmu_models.language.declaration import Body
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.friction import Friction
from fmu_models.language.inertia import inertia_requirements
from fmu_models.language.matrices import Matrix, Names, identifier, matrices_of, names_of, narrow_order, quadratic
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.language.signals import with_signals
from fmu_models.language.stops import StopLaw
from fmu_models.language.units import check_units


@dataclass(frozen=True, eq=False, kw_only=True)
class Mechanism(Body):
    """A declared oscillator; see the module for its equation.

    Attributes:
        name: identifier, also of the FMU.
        title: one line for people.
        source: where the model comes from.
        coordinates: generalised coordinates.
        kinetic_energy: T, J, quadratic in the velocities.
        potential_energy: U, J.
        dissipation: D, W, half the power lost.
        applied: generalised force on a coordinate.
        contacts: friction, stops and rigid contacts.
        outputs: quantities to be shown.
        requirements: what the parameters must satisfy beside their own bounds.

    Raises:
        StickslipError: the declaration contradicts itself; the message says where.
    """

    def __post_init__(self) -> None:
        for name in ("coordinates", "contacts", "outputs", "requirements"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        for name in ("kinetic_energy", "potential_energy", "dissipation"):
            object.__setattr__(self, name, sympy.sympify(getattr(self, name)))
        object.__setattr__(self, "applied", {q: sympy.sympify(e) for q, e in self.applied.items()})
        check_mechanism(self)
        check_units(self)

    @classmethod
    def from_matrices(
        cls,
        M: Matrix,
        C: Matrix | None,
        K: Matrix,
        *,
        name: str,
        names: Names | None = None,
        contacts: Callable[[Mapping[str, Coordinate]], Sequence[Contact]] = lambda q: (),
        applied: Callable[[Mapping[str, Coordinate]], Mapping[Coordinate, sympy.Expr]] = lambda q: {},
        title: str = "Structure given by its matrices",
        source: str = "matrices",
    ) -> Mechanism:
        """A linear structure, M u'' + C u' + K u = f, with contacts and forces at its degrees of freedom.

        ``fmu_models.reduced`` makes few coordinates of many. The parameters ``mass_factor``, ``damping_factor`` and
        ``stiffness_factor`` multiply the matrices.

        Args:
            M, C, K: (n, n) symmetric, kg, N s/m and N/m: arrays, sparse, or files (.mtx, .npy, file.mat:name); C may be
                None.
            name, title, source: as of every declaration.
            names: of the degrees of freedom: in their order, by row from 0 on, or a file whose lines end in node and
                direction (``17, uz`` names ``17:uz``); ``u1``, ``u2``, ... if None. Coordinates are called so too,
                ``n17_uz`` of a node, and velocities ``v_<name>``; they stand in an order in which M is narrow.
            contacts: from the coordinates by the names of their degrees of freedom.
            applied: forces, likewise.

        Raises:
            StickslipError: matrices that do not fit, or a declaration that contradicts itself.
        """
        mass, dampers, stiffness = matrices_of(M, C, K)
        kg, per_speed, per_way = (
            Parameter(f"{quantity}_factor", 1.0, unit, f"factor of the {quantity} matrix", positive=quantity == "mass")
            for quantity, unit in (("mass", "kg"), ("damping", "N s/m"), ("stiffness", "N/m"))
        )
        q = {
            own: Coordinate(identifier(own), "m", f"displacement {own}", velocity=f"v_{identifier(own)}")
            for own in names_of(mass.shape[0], names)
        }
        coordinates, speeds = list(q.values()), [x.v for x in q.values()]
        return cls(
            name=name,
            title=title,
            source=source,
            coordinates=[coordinates[row] for row in narrow_order(mass)],
            kinetic_energy=kg * quadratic(mass, speeds),
            potential_energy=per_way * quadratic(stiffness, coordinates),
            dissipation=per_speed * quadratic(dampers, speeds),
            applied=applied(q),
            contacts=contacts(q),
        )

    def _contents(self) -> dict[str, object]:
        energies = {name: getattr(self, name) for name in ("kinetic_energy", "potential_energy", "dissipation")}
        names = {name: [q.name for q in getattr(self, name)] for name in ("parameters", "all_inputs", "outputs")}
        return {"coordinates": [q.name for q in self.coordinates], **energies, "contacts": self.contacts, **names}

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """The friction contacts."""
        return tuple(contact for contact in self.contacts if isinstance(contact, Friction))

    @property
    def all_requirements(self) -> tuple[Requirement, ...]:
        """The requirements of the mechanism, of its laws and, with rigid contacts, of its mass matrix."""
        inertia = inertia_requirements(self) if self.impacts else ()
        return (*super().all_requirements, *(r for contact in self.contacts for r in contact.requirements), *inertia)

    @functools.cached_property
    def body_symbols(self) -> set[sympy.Basic]:
        """Quantities that the body uses without its contacts and outputs."""
        energies = (self.kinetic_energy, self.potential_energy, self.dissipation, *self.applied.values())
        return _symbols(energies) | {s for q in self.coordinates for s in (q, q.v, q.a)}

    @property
    def symbols(self) -> set[sympy.Basic]:
        return self._all_symbols

    @functools.cached_property
    def _all_symbols(self) -> set[sympy.Basic]:
        outputs = _symbols(output.expression for output in self.outputs)
        return with_signals(self.body_symbols.union(outputs, *(contact.symbols for contact in self.contacts)))

    def restricted_to(self, contacts: Iterable[str]) -> Mechanism:
        """The mechanism with these contacts only, without the quantities and outputs that served the others alone.
        StickslipError: no contact has that name."""
        chosen = [self._contact(name) for name in contacts]
        chosen = [contact for contact in self.contacts if contact in chosen]
        if len(chosen) == len(self.contacts):
            return self
        dropped = [contact for contact in self.contacts if contact not in chosen]
        gone = set().union(*(contact.symbols.union(contact.shown) for contact in dropped))
        gone -= self.body_symbols.union(*(contact.symbols for contact in chosen))
        return dataclasses.replace(
            self,
            name="_".join([self.name, *([contact.name for contact in chosen] or ["free"])]),
            contacts=chosen,
            outputs=[output for output in self.outputs if not gone & output.expression.free_symbols],
            requirements=[r for r in self.requirements if not gone & r.expression.free_symbols],
        )

    def law_of(self, name: str) -> Law | StopLaw:
        """The law of a contact. StickslipError: no contact has that name, or it is rigid and has no law."""
        return self._contact(name).exchangeable_law(self.name)

    def with_law(self, **laws: Law | StopLaw) -> Mechanism:
        """The mechanism with other laws for the contacts named: ``with_law(disc0=LuGre(...))``. StickslipError: no
        contact has that name, or it is rigid and has no law."""
        for name in laws:
            self.law_of(name)
        contacts = [
            contact.with_law(laws[contact.name]) if contact.name in laws else contact for contact in self.contacts
        ]
        renewed = {
            old: new
            for before, after in zip(self.contacts, contacts, strict=True)
            for old, new in zip(before.shown, after.shown, strict=True)
        }
        kinds = dict.fromkeys(type(law).__name__.lower() for law in laws.values())
        return dataclasses.replace(
            self,
            name="_".join([self.name, *kinds]),
            contacts=contacts,
            outputs=[dataclasses.replace(o, expression=o.expression.xreplace(renewed)) for o in self.outputs],
        )

    def _contact(self, name: str) -> Contact:
        return named(self.contacts, name, f"{self.name} has no contact '{name}'.")


def _symbols(expressions: Iterable[sympy.Expr]) -> set[sympy.Basic]:
    return set().union(*map(Derivatives().symbols, expressions))
