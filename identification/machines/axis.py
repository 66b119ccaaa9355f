"""The machine of one coordinate that a recipe's terms declare.

    T = M v^2/2,  U = k q^2/2 - m_c g cos q,  D = F_v v^2/2,  applied: effort - offset,  dry friction in one contact

Each term is linear in its parameter, so the columns of the machine's regressor are those of the terms.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import sympy

from fmu_models.language.contacts import Friction
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from identification.inference.problem import identifier
from identification.machines.axis_terms import KINDS, Part, Term
from identification.measurement.recipe import EFFORT, POSITION, VELOCITY

CARRIED = "carried_inertia"
Shape = Callable[[sympy.Expr, sympy.Expr], sympy.Expr]


@final
@dataclass(frozen=True)
class SummedFriction(DryFriction):
    """lambda = -sum_i F_i shape_i(v, sgn v); summands: F_i and shape_i, a force over F_i by slip speed and its sign."""

    summands: tuple[tuple[Parameter, Shape], ...]

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return -sum((parameter * shape(slip, sign) for parameter, shape in self.summands), sympy.S.Zero)

    def towards(self, speed: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force, N, for a slip speed without sign, m/s, and its sign."""
        return -sign * self.force(sign * speed, sign)

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Friction force, N, for a positive slip speed, m/s."""
        return self.towards(speed, sympy.S.One)

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N, against negative slip."""
        return self.towards(sympy.S.Zero, sympy.S.NegativeOne)

    @property
    def capacity_minus(self) -> sympy.Expr:
        """Largest force in stick, N, against positive slip."""
        return self.magnitude(sympy.S.Zero)


def declared_axis(terms: tuple[Term, ...], turning: bool, *, title: str = "", source: str = "") -> Mechanism:
    """The machine of these terms; a body that turns has rad and N m in place of m and N. Without a term of inertia it
    has one all the same, ``CARRIED``: what moves has.

    Raises:
        StickslipError: a parameter's name is none, or one for two things.
    """
    q = Coordinate(POSITION, "rad" if turning else "m", "position of the axis", velocity=VELOCITY)
    effort = Input(EFFORT, 0.0, "N m" if turning else "N", "effort on the axis")
    if all(term.kind != "inertia" for term in terms):
        terms = (Term(CARRIED, "inertia"), *terms)
    of: dict[Part, list[tuple[Parameter, Term]]] = {part: [] for part in Part}
    for term in terms:
        of[KINDS[term.kind].part].append((_parameter(term, turning), term))

    def total(part: Part) -> sympy.Expr:
        return sum((p * KINDS[term.kind].shape(q, q.v) for p, term in of[part]), sympy.S.Zero)

    dry = tuple((p, KINDS[term.kind].shape) for p, term in of[Part.DRY])
    smooth = [
        Friction(name=f"smoothed{i}", slip=q.v, law=KINDS[term.kind].shape(p, sympy.Float(term.width)))
        for i, (p, term) in enumerate(of[Part.SMOOTHED])
    ]
    return Mechanism(
        name="axis",
        title=title or "Machine of one coordinate",
        source=source,
        coordinates=[q],
        kinetic_energy=total(Part.KINETIC),
        potential_energy=total(Part.POTENTIAL),
        dissipation=total(Part.DISSIPATION),
        applied={q: effort - total(Part.APPLIED)},
        contacts=[*([Friction(name="dry", slip=q.v, law=SummedFriction(dry))] if dry else []), *smooth],
    )


def _parameter(term: Term, turning: bool) -> Parameter:
    kind = KINDS[term.kind]
    return Parameter(
        identifier(term.name),
        1.0 if kind.part is Part.KINETIC else 0.0,  # what the logs are asked for: none is declared
        str(term.unit(turning)),
        kind.meaning,
        positive=kind.part is Part.KINETIC,
        minimum=0.0 if kind.positive else None,
    )
