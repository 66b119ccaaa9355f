"""The equations of a system in given contact states, as expressions and as functions of plain numbers.

A mode has one state per contact: slip + or -, stick, open, closed (of a stop: touching), released; HALF stands for half
the force of a contact, the mean of the fields on both sides of its boundary. With the known forces K and those U that
keep y' = 0,

    z' = (v, a + W lambda, rates, 0)        y_U' = slip_rate_U + G_UK lambda_K + G_UU lambda_U = 0

The state z is that of the system with the speed of entry of every stop that remembers it behind. Expressions are
folded to numbers first and compiled by SymPy's ``lambdify`` with common subexpressions, so that a method in Python
pays no more than Python must.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import mpmath
import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.language.quantities import TIME
from fmu_models.lowering.hybrid_system import HybridSystem
from fmu_models.validation.methods.result import CLOSED, MINUS, OPEN, PLUS, RELEASED, STICK, NotTreated

HALF = 6
Mode = tuple[int, ...]
Number = float | np.longdouble | mpmath.mpf
State = NDArray[np.floating[Any]] | Sequence[Number]


class Equations:
    """The equations of a system without free parameters.

    Attributes:
        n: number of states; ``memories`` holds the contacts whose speed of entry is behind them in z.
        symbols: of z.
        pull: 1/s, at which a contact that sticks loses the slip it has: y' = -pull y instead of 0.
    """

    def __init__(self, system: HybridSystem, pull: float = 0.0) -> None:
        self.system = system.written_out()
        self.pull = pull
        self.contacts = system.contacts
        self.n = len(system.states)
        self.memories = tuple(i for i, contact in enumerate(system.contacts) if contact.remembers)
        self.symbols: tuple[Any, ...] = (*system.states, *(system.contacts[i].memory_symbol for i in self.memories))
        self._accelerations = dict(zip(system.rate_symbols, system.acceleration, strict=True))
        self._slips = {c.slip_symbol: c.slip for c in system.contacts}
        self._depths = {c.depth_symbol: c.depth for c in system.contacts if c.depth_symbol is not None}
        self._compiled: dict[Any, Callable[..., Any]] = {}

    def place(self, expression: sympy.Expr, signs: dict[Any, Any]) -> sympy.Expr:
        """An expression with contact symbols and accelerations without contact forces put in by what they are."""
        substituted = sympy.sympify(expression)
        for contact in self.contacts:
            # beyond the boundary, where stages of a Runge-Kutta step look, a root of the depth has no value
            if contact.rooted and contact.depth_symbol is not None and substituted.has(contact.depth_symbol):
                substituted = substituted.xreplace({contact.depth_symbol: sympy.Max(0, contact.depth)})
        substituted = substituted.xreplace(self._accelerations)
        return substituted.xreplace(self._slips | self._depths).xreplace(signs)

    def signs(self, mode: Mode) -> dict[Any, Any]:
        """Sign of slip per contact, 0 for the mean of both sides."""
        chosen = (s if s in (MINUS, PLUS) else 0 for s in mode)
        return {c.sign_symbol: sympy.Integer(s) for c, s in zip(self.contacts, chosen, strict=True)}

    @cache  # noqa: B019  (an Equations lives as long as its problem)
    def forces(self, mode: Mode) -> tuple[Any, ...]:
        """lambda of every contact in a mode. NotTreated: the forces of contacts that stick or are closed together are
        not determined."""
        signs = self.signs(mode)
        known_forces: list[Any] = [self._known_force(i, state, signs) for i, state in enumerate(mode)]
        unknown = [i for i, force in enumerate(known_forces) if force is None]
        if not unknown:
            return tuple(known_forces)
        G = self.system.G
        names = {i: sympy.Dummy(f"lambda{i}") for i in unknown}
        forces = [names[i] if known_forces[i] is None else known_forces[i] for i in range(len(known_forces))]
        for i, state in enumerate(mode):  # friction of a closed rigid contact hangs on the normal force
            contact = self.contacts[i]
            if contact.kind.led and state in (MINUS, PLUS) and contact.partner in names:
                forces[i] = -state * contact.friction * names[contact.partner]
        rates = []
        for i in unknown:
            rate = self.place(self.contacts[i].slip_rate, signs)
            if self.pull and mode[i] == STICK:
                rate += self.pull * self.contacts[i].slip
            rates.append(rate + sum((G[i, j] * force for j, force in enumerate(forces)), sympy.S.Zero))
        matrix, right = sympy.linear_eq_to_matrix(rates, [names[i] for i in unknown])
        if sympy.simplify(matrix.det()) == 0:
            raise NotTreated("contacts that stick together share a force that is not determined.")
        solved = dict(zip((names[i] for i in unknown), matrix.LUsolve(right), strict=True))
        return tuple(sympy.sympify(force).xreplace(solved) for force in forces)

    def _known_force(self, i: int, state: int, signs: dict[Any, Any]) -> sympy.Expr | None:
        """The force of a contact from its law, None if the constraint gives it."""
        contact = self.contacts[i]
        if state in (OPEN, RELEASED):
            return sympy.S.Zero
        if contact.kind.impulsive:
            return None
        if contact.kind.surface and not contact.sticks:
            return sympy.S.Zero
        if state == STICK:
            return None
        force = self.place(contact.force, signs)
        return force / 2 if state == HALF else force

    def rates(self, mode: Mode) -> tuple[Any, ...]:
        """z' in a mode, as expressions."""
        return self.rates_under(self.forces(mode), self.signs(mode))

    def rates_under(self, forces: Sequence[Any], signs: dict[Any, Any]) -> tuple[Any, ...]:
        """z' under the forces of all contacts, as expressions, with other signs of slip or what stands for them."""
        system = self.system
        velocities = [q.v for q in system.coordinates]
        driven = [
            self.place(a, signs) + sum((system.W[i, j] * forces[j] for j in range(len(forces))), sympy.S.Zero)
            for i, a in enumerate(system.acceleration)
        ]
        internal = [self.place(rate, signs) for rate in system.internal_rates]
        return (*velocities, *driven, *internal, *(sympy.S.Zero for _ in self.memories))

    def function(self, expressions: Sequence[Any], modules: str = "math") -> Callable[[Number, Any], list[Any]]:
        """Expressions as a function of the time and z (a sequence of numbers) that returns a list."""
        plain = {symbol: sympy.Symbol(f"z{i}") for i, symbol in enumerate(self.symbols)}
        t = sympy.Symbol("t")
        substituted = [sympy.sympify(e).xreplace({**plain, TIME: t}) for e in expressions]
        return sympy.lambdify([t, list(plain.values())], substituted, modules=modules, cse=True)

    def field(self, mode: Mode) -> Callable[[float, Any], list[float]]:
        """z' in a mode, compiled once."""
        if mode not in self._compiled:
            self._compiled[mode] = self.function(self.rates(mode))
        return self._compiled[mode]

    def start(self, states: ArrayLike) -> np.ndarray:
        """z from the states, with no speeds of entry."""
        return np.concatenate([np.asarray(states, dtype=float), np.zeros(len(self.memories))])


def boundary(contact: ContactDynamics) -> sympy.Expr | None:
    """The function whose sign is the side a contact is on: depth of a stop or rigid contact, else slip or switch."""
    return contact.depth if contact.kind.normal else contact.slip


def first_mode(equations: Equations, z: State) -> Mode:
    """Contact states at the start by their sides alone: closed stops where they push, nothing sticks."""
    mode = []
    values = equations.function([sympy.sympify(boundary(c)) for c in equations.contacts])(0.0, z)
    for contact, value in zip(equations.contacts, values, strict=True):
        if contact.kind.normal:
            mode.append(CLOSED if value > 0.0 and contact.kind.compliant else OPEN)
        elif contact.kind.led:
            mode.append(OPEN)
        else:
            mode.append(MINUS if value < 0.0 else PLUS)
    return tuple(mode)
