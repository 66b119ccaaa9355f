"""Equations of motion of a declaration, derived by SymPy, as functions of numbers.

    M a = h + sum J^T lambda,    y' = J a + s        of a body, J = dy/dv
    x'  = f + sum W sigma,       y' = J x' + s       of an automaton, sigma in [-1, 1] the negative sign of a switch

Both are one form: rates r of the driven states with M r = h + sum W l, and y' = J r + s of every row (the direction of
a contact); W = J^T of a body. Driven are the velocities, or all states of an automaton.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import sympy
from oracle import laws
from oracle.declaration import Declaration, Values
from oracle.laws import DEPTH, ENTRY, RATE, S, Y

FRICTION, STOP, NORMAL, TANGENT, SWITCH, SLIDER = "friction", "stop", "normal", "tangent", "switch", "slider"
ELASTIC = 9  # the mode of a slider that does not yield


# a step that reaches beyond the zero of a slip speed sees a law where it is none
_BEYOND = {"exp": lambda x: math.exp(min(x, 50.0)), "log": lambda x: math.log(max(abs(x), 1e-300))}


@dataclass(frozen=True)
class Row:
    """One direction of a contact.

    Attributes:
        kind: of the direction.
        number: of the contact.
        law: of friction.
        release: of a stop: where it lets go.
        sides: of a switch: from which sides it jumps, "+", "-", "both" or nothing.
        partner: of a rigid contact with friction: the row of the other direction; -1: none.
        poisson: of a rigid contact: its rule.
        gap: whether it has a place beside its speed.
    """

    kind: str
    number: int
    law: laws.FrictionLaw | None = None
    release: str = ""
    sides: str = ""
    partner: int = -1
    poisson: bool = False
    gap: bool = False


class Terms(NamedTuple):
    """At one instant; see the module. ``place``: gap of a contact, or the function ``where`` of a region."""

    M: Any  # (n, n)
    h: Any  # (n,)
    J: Any  # (rows, n)
    W: Any  # (n, rows)
    s: Any  # (rows,)
    y: Any  # (rows,)
    place: Any  # (rows,)
    place_rate: Any  # (rows,), without what is driven by accelerations


class Equations:
    """Of one declaration; ``at`` fixes the numbers of a run."""

    def __init__(self, declaration: Declaration) -> None:
        self.declared = declaration
        names = [*declaration.states, *declaration.velocities, "t", *declaration.parameters, *declaration.inputs]
        self.symbols: dict[str, Any] = {name: sympy.Symbol(name, real=True) for name in names}
        self.symbols |= {f"d{u}": sympy.Symbol(f"d{u}", real=True) for u in declaration.inputs}
        self.signs = {}
        for contact in declaration.contacts:
            if contact["kind"] == SWITCH:
                self.signs[contact["name"]] = sympy.Symbol(f"sign_{contact['name']}", real=True)
        self._read_names = self.symbols | {str(sign): sign for sign in self.signs.values()}
        self.rows: list[Row] = []
        self.internal: list[Any] = []
        self.internal_starts: list[float] = []
        self._build()

    def read(self, text: Any) -> Any:
        """An expression of its text."""
        parsed: Any = sympy.sympify
        return parsed(str(text), locals=self._read_names)

    def _along(self, e: Any) -> Any:
        """Rate of a function of the state, that of velocities left out."""
        d, x = self.declared, self.symbols
        rate = sympy.diff(e, x["t"]) + sum(sympy.diff(e, x[u]) * x[f"d{u}"] for u in d.inputs)
        return rate + sum(sympy.diff(e, x[q]) * x[v] for q, v in zip(d.states, d.velocities, strict=False))

    def _build(self) -> None:
        d, x = self.declared, self.symbols
        self.body = not d.flows
        driven = [x[name] for name in (d.velocities or d.states)]
        n = len(driven)
        if self.body:
            T, U, D = (self.read(text) for text in (d.kinetic, d.potential, d.dissipation))
            momentum = [sympy.diff(T, v) for v in driven]
            flows: list[Any] = []
            M = sympy.Matrix(n, n, lambda i, j: sympy.diff(momentum[i], driven[j]))
            h = [
                self.read(d.applied.get(q, "0"))
                - sympy.diff(U, x[q])
                - sympy.diff(D, v)
                + sympy.diff(T, x[q])
                - self._along(p)
                for q, v, p in zip(d.states, driven, momentum, strict=True)
            ]
        else:
            M = sympy.eye(n)
            flows = [self.read(d.flows[name]) for name in d.states]
            h = [flow.subs(dict.fromkeys(self.signs.values(), 0)) for flow in flows]
        J, W, s, y, place, place_rate = [], [], [], [], [], []
        self.forces: list[Any] = []  # of slip or touch, by row
        self.capacities: list[tuple[Any, Any]] = []
        self.mu: list[Any] = []
        self.e: list[Any] = []
        self.releases: list[Any] = []
        self.jumps: dict[int, list[Any]] = {}

        def row(entry: Row, speed: Any, where: Any, **parts: Any) -> None:
            gradient = [sympy.diff(speed, v) for v in driven]
            self.rows.append(entry)
            J.append(gradient)
            W.append(parts.get("W", gradient))
            s.append(self._along(speed))
            y.append(speed)
            place.append(sympy.S.Zero if where is None else where)
            place_rate.append(sympy.S.Zero if where is None else self._along(where))
            self.forces.append(parts.get("force", sympy.S.Zero))
            self.capacities.append(parts.get("capacity", (sympy.S.Zero, sympy.S.Zero)))
            self.mu.append(parts.get("mu", sympy.S.Zero))
            self.e.append(parts.get("e", sympy.S.Zero))
            self.releases.append(parts.get("release", sympy.S.Zero))

        for number, contact in enumerate(d.contacts):
            kind, at = contact["kind"], len(self.rows)
            if kind == FRICTION:
                law = laws.friction(contact["law"], contact["name"], self.read)
                where = self.read(contact["where"]) if contact.get("where") else None
                entry = Row(FRICTION, number, law=law, gap=where is not None)
                row(entry, self.read(contact["slip"]), where, force=law.force, capacity=law.capacity)
                self.internal += law.states
                self.internal_starts += law.starts
            elif kind == STOP:
                gap = self.read(contact["gap"])
                force, release = laws.stop(contact["law"], self.read)
                speed = self._along(gap)
                row(Row(STOP, number, release=contact["release"], gap=True), speed, gap, force=force, release=release)
            elif kind == "sliders":
                way = self.read(contact["way"])
                for i, (k, bound) in enumerate(zip(contact["k"], contact["D"], strict=True)):
                    z = sympy.Symbol(f"z{i}_{contact['name']}", real=True)
                    h = [e - self.read(k) * z * sympy.diff(way, x[q]) for e, q in zip(h, d.states, strict=True)]
                    row(Row(SLIDER, number), self._along(way), None, capacity=(self.read(bound),) * 2)
                    self.internal.append(z)
                    self.internal_starts.append(0.0)
            elif kind == "impact":
                gap = self.read(contact["gap"])
                rubs = contact.get("slip") is not None
                normal = Row(
                    NORMAL, number, partner=at + 1 if rubs else -1, poisson=contact["rule"] == "poisson", gap=True
                )
                mu = self.read(contact["mu"]) if rubs else sympy.S.Zero
                row(normal, self._along(gap), gap, e=self.read(contact["e"]), mu=mu)
                if rubs:
                    row(Row(TANGENT, number, partner=at), self.read(contact["slip"]), None, mu=mu)
            else:
                function = self.read(contact["function"])
                sign = self.signs[contact["name"]]
                effect = [-sympy.diff(flow, sign) for flow in flows]
                row(
                    Row(SWITCH, number, sides=contact.get("side", "")),
                    function,
                    None,
                    W=effect,
                    capacity=(1, 1),
                    force=-S,
                )
                if contact.get("side"):
                    self.jumps[at] = [self.read(contact["to"].get(name, name)) for name in d.states]
        order = [*(x[q] for q in d.states), *(x[v] for v in d.velocities), *self.internal, x["t"]]
        order += [*(x[u] for u in d.inputs), *(x[f"d{u}"] for u in d.inputs), *(x[p] for p in d.parameters)]

        def numeric(expressions: Any, *more: Any) -> Callable[..., Any]:
            return sympy.lambdify([*order, *more], list(expressions), modules=[_BEYOND, "math"], cse=True)

        flat = [*M, *h, *(e for r in J for e in r), *(e for r in W for e in r), *s, *y, *place, *place_rate]
        self._terms = numeric(flat)
        self._of_row = [
            numeric([force, *capacity, mu, e, release], Y, S, DEPTH, RATE, ENTRY)
            for force, capacity, mu, e, release in zip(
                self.forces, self.capacities, self.mu, self.e, self.releases, strict=True
            )
        ]
        owners = [r for r, row in enumerate(self.rows) if row.kind == SLIDER or (row.law and row.law.states)]
        self.owners = owners
        rates: dict[int, Any] = {r: getattr(self.rows[r].law, "rates", [Y]) for r in owners}
        self._rates_of = {r: numeric(expressions, Y, S) for r, expressions in rates.items()}
        self._jump_of = {r: numeric(jump) for r, jump in self.jumps.items()}
        self.n, self.n_rows, self.n_states = n, len(self.rows), len(d.states) + len(d.velocities)

    def at(self, values: Values) -> Numbers:
        """The equations with the numbers of a run."""
        return Numbers(self, values)


class Numbers:
    """Equations with parameters and inputs; ``state``: coordinates, velocities, internal states."""

    def __init__(self, equations: Equations, values: Values) -> None:
        self.of, self.values = equations, values
        self._parameters = [float(values.parameters[p]) for p in equations.declared.parameters]
        self._inputs = [
            (np.array(values.inputs[u][0], float), np.array(values.inputs[u][1], float))
            for u in equations.declared.inputs
        ]
        self.side = 0.0  # an instant within the present piece of the inputs

    def knots(self) -> list[float]:
        """Where inputs bend or jump."""
        return sorted({float(t) for times, _ in self._inputs for t in times})

    def _point(self, t: float, state: Any) -> list[float]:
        values, slopes = [], []
        for times, heights in self._inputs:
            k = min(max(int(np.searchsorted(times, self.side, side="right")) - 1, 0), len(times) - 2)
            slope = (heights[k + 1] - heights[k]) / (times[k + 1] - times[k])
            values.append(float(heights[k] + slope * (t - times[k])))
            slopes.append(float(slope))
        return [*map(float, state), float(t), *values, *slopes, *self._parameters]

    def start(self) -> Any:
        """The start state."""
        names = [*self.of.declared.states, *self.of.declared.velocities]
        return np.array([*(self.values.start[name] for name in names), *self.of.internal_starts], float)

    def terms(self, t: float, state: Any) -> Terms:
        """See ``Terms``."""
        n, rows = self.of.n, self.of.n_rows
        flat = np.array(self.of._terms(*self._point(t, state)), float)
        shapes = [(n, n), (n,), (rows, n), (rows, n), (rows,), (rows,), (rows,), (rows,)]
        parts, at = [], 0
        for shape in shapes:
            size = int(np.prod(shape))
            parts.append(flat[at : at + size].reshape(shape))
            at += size
        M, h, J, W, s, y, place, place_rate = parts
        return Terms(M, h, J, W.T, s, y, place, place_rate)

    def of_row(
        self, r: int, t: float, state: Any, speed: float, sign: float, gap: float = 0.0, entry: float = 1.0
    ) -> Any:
        """Force along the row, capacities, mu, e, release of row r."""
        depth = max(-gap, 0.0)
        return self.of._of_row[r](*self._point(t, state), speed, sign, depth, -speed, entry)

    def internal(self, t: float, state: Any, speeds: Mapping[int, float], signs: Mapping[int, float]) -> list[float]:
        """Rates of the internal states."""
        point = self._point(t, state)
        return [x for r in self.of.owners for x in self.of._rates_of[r](*point, speeds[r], signs[r])]

    def jump(self, r: int, t: float, state: Any) -> Any:
        """States after the jump of a switch."""
        return np.array(self.of._jump_of[r](*self._point(t, state)), float)
