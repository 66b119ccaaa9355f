"""What a declared contact is lowered to: one or several directions, each in factored form."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import sympy

from fmu_models.language.contact_kinds import AWAY, RELEASED, STICK, ContactKind
from fmu_models.language.quantities import ContactSymbol, InternalState, State


class Rates(NamedTuple):
    """Time derivatives of positions, and of speeds."""

    of_place: Callable[[sympy.Expr], sympy.Expr]
    of_speed: Callable[[sympy.Expr], sympy.Expr]


class Element(NamedTuple):
    """A spring behind a slider, of many on one way: its elongation, stiffness, and where it yields."""

    state: InternalState
    stiffness: Any
    bound: Any


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactDynamics:
    """One contact: friction, a stop, a switch, or one direction of a rigid contact.

    Attributes:
        name, description: as declared.
        kind: its row of the table of kinds.
        slip: y; m/s of every contact but a switch, of which it is the switching function.
        slip_rate: y' without contact forces; may use rates of driven states (``Coordinate.a``), which then stand for
            those without contact forces, and ``Input.rate``.
        slip_terms: the terms of which slip is the sum.
        capacity: largest lambda in stick; 0 of a stop, and of a rigid contact, where mu and normal force say it.
        capacity_minus: largest -lambda in stick; None where that is the same.
        force: lambda as long as the contact slips or touches, from the symbols below besides states and inputs; 0 of a
            rigid contact, whose forces all come from one system of equations.
        sticks: whether it can stick (a switch: slide).
        depth: of a contact with bounds, positive inside, else None; ``depth_terms`` those of which it is the sum. Of
            the normal direction of a rigid contact its negative gap.
        release: of a stop that lets go when its force vanishes, a quantity with the sign of its force, else None.
        remembers: the law reads the speed at which the contact was entered.
        rooted: the law has half-integer powers of the depth; of a switch, some law has those of sign times y.
        reset: states after the jump where y falls to zero, or where stick begins or ends, if they jump.
        reset_sides: bit 1 if they do so coming from y > 0, bit 2 from y < 0; bit 4 where stick begins or ends; bit 8 if
            the jumps may end in rest: then slip_rate is the second derivative of y, which stick holds at zero.
        carries: rates of states per lambda, beside those that the slip says.
        elements: of an array whose way moves at the slip of the contact before it, a switch: y is what is left to the
            next of them that yields. Engine/model/elements.h computes y, and what ``pile_symbol`` stands for, their
            force; the rates of their states are those of the way.
        partner: of a rigid contact with friction the index of its other direction, else None.
        restitution: of the normal direction of a rigid contact, by Poisson's rule if ``poisson``, else by Newton's.
        friction: mu, of the friction of a rigid contact.
        force_symbol, slip_symbol, sign_symbol, depth_symbol, memory_symbol: what outputs and laws call lambda, y, the
            sign of y, the depth and the speed of entry.
    """

    name: str
    description: str
    kind: ContactKind
    slip: sympy.Expr
    slip_rate: sympy.Expr
    slip_terms: tuple[sympy.Expr, ...]
    capacity: sympy.Expr = sympy.S.Zero
    force: sympy.Expr = sympy.S.Zero
    sticks: bool
    force_symbol: ContactSymbol
    slip_symbol: ContactSymbol
    sign_symbol: ContactSymbol
    depth_symbol: ContactSymbol | None = None
    memory_symbol: ContactSymbol | None = None
    depth: sympy.Expr | None = None
    depth_terms: tuple[sympy.Expr, ...] = ()
    release: sympy.Expr | None = None
    remembers: bool = False
    rooted: bool = False
    reset: Mapping[State, sympy.Expr] = field(default_factory=dict)
    reset_sides: int = 0
    carries: Mapping[State, sympy.Expr] = field(default_factory=dict)
    elements: tuple[Element, ...] = ()
    pile_symbol: ContactSymbol | None = None
    partner: int | None = None
    capacity_minus: sympy.Expr | None = None
    restitution: sympy.Expr = sympy.S.Zero
    poisson: bool = False
    friction: sympy.Expr = sympy.S.Zero

    @property
    def capacities(self) -> tuple[sympy.Expr, sympy.Expr]:
        """Largest lambda and largest -lambda in stick."""
        return self.capacity, self.capacity if self.capacity_minus is None else self.capacity_minus

    @property
    def states(self) -> tuple[int, ...]:
        """The states that it can be in, in the order of its kind's ``state_words``."""
        possible = {STICK: self.sticks, RELEASED: self.release is not None, AWAY: self.depth is not None}
        follows = self.kind.led or self.kind.side
        return tuple(state for state in self.kind.state_words if follows or possible.get(state, True))

    @property
    def clocks(self) -> tuple[str, ...]:
        """Those of its kind; of a switch only if it resets states."""
        return self.kind.clocks if self.reset or not self.kind.surface else ()

    @property
    def indicators(self) -> tuple[str, ...]:
        """What its event indicators watch: "depth" or "gap", then "slip", "release" or "function"."""
        bounds = () if self.depth is None else (self.kind.bound,)
        watches = self.kind.watched and (self.release is not None or not self.kind.normal)
        return (*bounds, self.kind.watched) if watches else bounds


def terms(expression: sympy.Expr) -> tuple[sympy.Expr, ...]:
    """The terms of which an expression is the sum."""
    return sympy.Add.make_args(multiplied_out(expression))


def multiplied_out(expression: sympy.Expr) -> sympy.Expr:
    """Products of sums as sums. Functions stay whole: a pulse exp(-(t - a)^2) in three factors is infinity times 0."""
    dummies = {function: sympy.Dummy() for function in expression.atoms(sympy.Function)}
    return sympy.expand(expression.xreplace(dummies)).xreplace({dummy: function for function, dummy in dummies.items()})
