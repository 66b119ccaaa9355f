"""Terms of a linear inverse-dynamics model of one coordinate, how a recipe names them, and the machine they declare.

    effort = sum_i parameter_i column_i(q, q', q'')
    T = M v^2/2,  U = k q^2/2 - m_c g cos q,  D = F_v v^2/2,  applied: effort - offset,  dry friction in one contact

`KINDS` has the column of each term and how it is declared: linear in its parameter, so that the columns of the
machine's regressor are those of the terms.
Source of the form: Khalil, Dombre, Modeling, Identification and Control of Robots (2002), chapter 12.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, final

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.friction import Friction
from fmu_models.language.laws.arctan import Arctan
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.tanh import Tanh
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from identification.inference.problem import identifier
from identification.machines.joint_laws import comparable
from identification.measurement.recipe import EFFORT, POSITION, VELOCITY, Recipe, Speed, speed
from identification.measurement.signals import GRAVITY, check_speed

CARRIED = "carried_inertia"
Shape = Callable[[sympy.Expr, sympy.Expr], sympy.Expr]


class Part(Enum):
    """The part of a declaration that a term stands in, and what its shape is there, over its parameter p."""

    KINETIC = "energy by q and v"
    POTENTIAL = "energy by q"
    DISSIPATION = "half the power by v"
    APPLIED = "constant force that the effort meets"
    DRY = "friction by slip speed and its sign"
    SMOOTHED = "friction law of p and the speed over which it turns"


@dataclass(frozen=True)
class TermKind:
    """A kind of term. column: of the effort over its parameter p, as the reference of the manual says it; part, shape:
    how it is declared; unit for a body that slides and for one that turns (None: has no such term); needs: signals;
    positive: a value below zero has no meaning."""

    column: str
    part: Part
    shape: Callable[[Any, Any], Any]
    sliding_unit: str | None
    turning_unit: str
    meaning: str
    needs: str | None = "velocity"
    positive: bool = True

    @property
    def smoothed(self) -> bool:
        """Whether the term turns over a speed, in place of jumping."""
        return self.part is Part.SMOOTHED


@dataclass(frozen=True)
class Term:
    """A term by the name of its parameter. speed: over which a smoothed Coulomb term turns."""

    name: str
    kind: str
    speed: Speed | None = None

    @property
    def width(self) -> float:
        """The speed in SI units; 0 for a term that has none."""
        return self.speed.value if self.speed else 0.0

    def unit(self, turning: bool) -> str | None:
        """Unit of the parameter; None if there is no such term for this kind of motion."""
        return KINDS[self.kind].turning_unit if turning else KINDS[self.kind].sliding_unit


_FORCE, _VISCOUS = ("N", "N m"), ("N s/m", "N m s/rad")
# shapes by direction are polynomials in the sign, zero at rest
KINDS: Mapping[str, TermKind] = {
    "inertia": TermKind("q''", Part.KINETIC, lambda q, v: v**2 / 2, "kg", "kg m2", "inertia", needs="acceleration"),
    "viscous": TermKind("q'", Part.DISSIPATION, lambda q, v: v**2 / 2, *_VISCOUS, "viscous friction"),
    "viscous+": TermKind("max(q', 0)", Part.DRY, lambda v, s: v * (1 + s) / 2, *_VISCOUS, "viscous friction, forwards"),
    "viscous-": TermKind(
        "min(q', 0)", Part.DRY, lambda v, s: v * (1 - s) / 2, *_VISCOUS, "viscous friction, backwards"
    ),
    "quadratic": TermKind(
        "q' abs(q')", Part.DRY, lambda v, s: s * v**2, "N s2/m2", "N m s2/rad2", "quadratic friction"
    ),
    "coulomb": TermKind("sgn(q')", Part.DRY, lambda v, s: s, *_FORCE, "Coulomb friction"),
    "coulomb+": TermKind(
        "max(sgn(q'), 0)", Part.DRY, lambda v, s: s * (1 + s) / 2, *_FORCE, "Coulomb friction, forwards"
    ),
    "coulomb-": TermKind(
        "min(sgn(q'), 0)", Part.DRY, lambda v, s: s * (1 - s) / 2, *_FORCE, "Coulomb friction, backwards"
    ),
    "coulomb-arctan": TermKind(
        "atan(q'/speed)",
        Part.SMOOTHED,
        lambda p, width: Arctan(Coulomb(sympy.pi / 2, p), width),
        *_FORCE,
        "Coulomb friction times 2/pi, smoothed",
    ),
    "coulomb-tanh": TermKind(
        "tanh(q'/speed)",
        Part.SMOOTHED,
        lambda p, width: Tanh(Coulomb(sympy.S.One, p), width),
        *_FORCE,
        "Coulomb friction, smoothed",
    ),
    "offset": TermKind(
        "1", Part.APPLIED, lambda q, v: sympy.S.One, *_FORCE, "offset of the effort", needs=None, positive=False
    ),
    "gravity": TermKind(
        "g sin(q)",
        Part.POTENTIAL,
        lambda q, v: -GRAVITY * sympy.cos(q),
        None,
        "kg m",
        "mass times its distance",
        needs="position",
    ),
    "stiffness": TermKind("q", Part.POTENTIAL, lambda q, v: q**2 / 2, "N/m", "N m/rad", "stiffness", needs="position"),
}
TERM_KEYS = {"term": "its name", "speed": 'over which a smoothed term turns, m/s or rad/s, `"0.01 rad/s"`'}
FRICTION_KEYS = {
    "compare": "list of friction laws to be compared in place of the friction terms",
    "normal_force": "N, where it is known: the laws begin with friction coefficients times it, else times the root "
    "mean square effort",
}


@dataclass(frozen=True)
class Model:
    """What a recipe says that the effort is. terms: the sum; laws: of friction, to be compared in place of the friction
    terms; normal_force: N, None where it is not known."""

    terms: tuple[Term, ...]
    laws: tuple[str, ...] = ()
    normal_force: float | None = None

    def sign(self, v: np.ndarray) -> np.ndarray:
        """Of velocities (n,), as the Coulomb term of the model turns, with the limits -1 and 1."""
        for term in self.terms:
            if term.kind == "coulomb-arctan":
                return 2 / np.pi * np.arctan(v / term.width)
            if term.kind == "coulomb-tanh":
                return np.tanh(v / term.width)
        return np.sign(v)


def read_model(recipe: Recipe) -> Model:
    """The tables [terms] and [friction] of a recipe. StickslipError: there are no terms, or what is wrong in them, with
    its line."""
    terms = tuple(_term(recipe, name) for name in recipe.document.table("terms"))
    if not terms:
        raise StickslipError(f"Recipe {recipe.name} has no [terms]; it is one for 'stickslip slips'.")
    return Model(terms, *_friction(recipe))


def check_terms(recipe: Recipe, turning: bool, terms: tuple[Term, ...]) -> None:
    """Refuse terms that the log has no signal for, or that this kind of motion does not have. StickslipError: which,
    and what is missing."""
    for term in terms:
        needs = KINDS[term.kind].needs
        if needs and needs not in recipe.signals:
            raise StickslipError(
                f"{recipe.name}: term '{term.name}' ({term.kind}) needs the signal '{needs}'. Add [signals.{needs}]."
            )
        if term.unit(turning) is None:
            raise StickslipError(
                f"{recipe.name}: term '{term.name}' ({term.kind}) is one of a body that turns; this one slides."
            )
        if term.speed:
            check_speed(recipe, turning, term.name, term.speed)
    for name in (EFFORT, VELOCITY):
        if name not in recipe.signals:
            raise StickslipError(f"{recipe.name} has no signal '{name}'. Add [signals.{name}].")


def _term(recipe: Recipe, name: str) -> Term:
    document = recipe.document
    raw = document.table("terms")[name]
    keys: tuple[str, ...] = ("terms", name)
    over = None
    if isinstance(raw, dict):
        document.check_keys(TERM_KEYS, *keys)
        kind = document.text("term", *keys)
        if "speed" in raw:
            over = speed(document, raw["speed"], *keys, "speed")
    elif isinstance(raw, str):
        kind = raw
    else:
        raise document.fault(
            f"term '{name}' must be the name of a term, such as \"viscous\", or a table with it; found {raw!r}.", *keys
        )
    if kind not in KINDS:
        raise document.fault(f"'{kind}' is not a term.{nearest(kind, KINDS)}", *keys)
    if KINDS[kind].smoothed != (over is not None) or (over is not None and over.value <= 0):
        demand = "needs 'speed', the speed over which it turns, above 0" if KINDS[kind].smoothed else "has no 'speed'"
        raise document.fault(f"term '{name}' ({kind}) {demand}.", *keys)
    if not identifier(name).isascii():
        raise document.fault(
            f"'{name}' cannot name a parameter of a machine: use letters from a to z, digits and underscores.", *keys
        )
    return Term(name, kind, over)


def _friction(recipe: Recipe) -> tuple[tuple[str, ...], float | None]:
    document = recipe.document
    document.check_keys(FRICTION_KEYS, "friction")
    table = document.table("friction")
    laws = document.names("compare", "friction") or ()
    for law in laws:
        if law not in comparable():
            hint = nearest(law, comparable())
            raise document.fault(f"there is no friction law '{law}'.{hint}", "friction", "compare")
    if len(laws) == 1:
        raise document.fault("'compare' needs two laws or more.", "friction", "compare")
    if "normal_force" not in table:
        return laws, None
    normal_force = document.value(table["normal_force"], "N", "friction", "normal_force")
    if normal_force <= 0:
        raise document.fault("'normal_force' must be above 0 N.", "friction", "normal_force")
    return laws, normal_force


@final
@dataclass(frozen=True)
class SummedFriction(DryFriction):
    """lambda = -sum_i F_i shape_i(v, sgn v); summands: F_i and shape_i, a force over F_i by slip speed and its sign."""

    summands: tuple[tuple[Parameter, Shape], ...]

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
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
    has one all the same, ``CARRIED``: what moves has. StickslipError: a parameter's name is none, or one for two
    things."""
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
