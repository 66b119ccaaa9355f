"""What lanes (lanes/c) need of a model: ``model_lanes.h``, rows of the flow from parameters, and sums without zeros.

A model is linear in every mode (lowering/piecewise_linear.py); z = (states, cos and sin of each harmonic), a last
column stands for 1. Which entries can be other than zero is told here once: the compiler sees sums and no loops. In a
mode in which forces hold a contact they may depend on all that the flow reads.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import sympy

from fmu_models.codegen.c_expression import c_expression
from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.language.contact_kinds import TRAITS
from fmu_models.lowering.hybrid_system import HybridSystem
from fmu_models.lowering.piecewise_linear import Lifted, obstacles, ramps

# states whose exact step, a full matrix at worst, is worth its tables
_MOST_STATES = 64
# modes of all contacts that there is room for; tables are made of those that a motion comes to
_MOST_MODES = 128
# modes without contact that have exact steps of a grid
_MOST_HOMES = 4
# what a guard watches: depth, gap or normal force; release, function, slip or the margin of stick on its plus side; on
# its other side
_NORMAL, _TANGENTIAL, _MARGIN = range(3)

Place = tuple[int, int]


def lane_obstacles(system: HybridSystem) -> tuple[str, ...]:
    """Why ensembles of a system are not followed in lanes, a sentence each; empty where they are."""
    if len(system.states) > _MOST_STATES:
        return (f"it has {len(system.states)} states: an exact step costs their square, the series what is not zero",)
    if any(contact.elements for contact in system.contacts):
        return ("it has an array of elements, which have more modes than lanes have tables for",)
    reasons = list(obstacles(system)) or list(ramps(system))
    for contact in system.contacts:
        if contact.reset or contact.rooted:
            reasons.append(f"contact '{contact.name}': its jumps are not followed in lanes")
        elif contact.reset_sides & 8:
            reasons.append(f"contact '{contact.name}': its rest is not followed in lanes")
    modes = 1
    for contact in system.contacts:
        modes *= _digits(contact)
    if modes > _MOST_MODES:
        reasons.append(f"its contacts have {modes} modes, more than the {_MOST_MODES} that lanes have tables for")
    if not system.states:
        reasons.append("it has no states")
    return tuple(dict.fromkeys(reasons))


def _digits(contact: ContactDynamics) -> int:
    """States of a contact, the friction of a rigid contact counted with it (lane_modes.c has their order)."""
    if contact.kind.rigid:
        return 1 if contact.kind.led else 2 if contact.partner is None else 4
    return len(contact.states)


def _away_digits(contact: ContactDynamics) -> int:
    """The states among `_digits` without a stop that touches or a force that holds."""
    return _digits(contact) - contact.sticks if contact.kind.dry else 1


def _slots(contact: ContactDynamics) -> tuple[int, ...]:
    """The guards of a contact."""
    bound = () if contact.depth is None else (_NORMAL,)
    watched = (_TANGENTIAL,) if len(contact.indicators) > len(bound) else ()
    return (*bound, *watched, *((_MARGIN,) if contact.sticks else ()))


def lane_tables(system: HybridSystem) -> str:
    """The header; empty for what lanes do not follow."""
    return "" if lane_obstacles(system) else _Tables(system).text()


class _Tables:
    """The rows of one system, and where they are not zero."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system
        self.lifted = Lifted.of(system)
        contacts = system.contacts
        self.n = len(system.states)
        nq = len(system.coordinates)
        slips = {c.slip_symbol: c.slip for c in contacts}
        rates = [*system.acceleration, *(sympy.sympify(rate).xreplace(slips) for rate in system.internal_rates)]
        self.flow = {nq + i: self._row(rate) for i, rate in enumerate(rates)}
        self.slip = [self._row(c.slip) for c in contacts]
        self.depth = [None if c.depth is None else self._row(c.depth) for c in contacts]
        self.force = [self._law(c, c.force) if c.kind.compliant else None for c in contacts]
        self.release = [None if c.release is None else self._law(c, c.release) for c in contacts]
        self.friction = [self._row(_inlined(c, c.force, c.slip)) if c.kind.dry else None for c in contacts]
        self.capacities = [
            tuple(self._row(_inlined(c, bound, sympy.S.Zero)) for bound in c.capacities) if c.kind.dry else None
            for c in contacts
        ]
        self.free = self._free_places()
        self.held = self._held_columns()
        self.places = sorted(self.free | self._touching_places() | self._held_places())
        self.step = sorted(self._closure())
        self.guards = [(c, slot) for c, contact in enumerate(contacts) for slot in _slots(contact)]

    def _row(self, expression: sympy.Basic) -> tuple[Any, ...]:
        row = self.lifted.row(expression)
        assert row is not None  # an obstacle otherwise
        return row

    def _law(self, contact: ContactDynamics, expression: sympy.Basic) -> tuple[Any, ...]:
        """Factors of depth and rate, and the rest."""
        depth, rate = contact.depth_symbol, contact.slip_symbol
        row = self.lifted.row(expression, *(() if depth is None else (depth,)), rate)
        assert row is not None
        n = self.n + len(self.lifted.phasors)
        return (*((sympy.S.Zero,) if depth is None else ()), *row[n + 1 :], row[n])

    def _free_places(self) -> set[Place]:
        """Entries of the flow without held or touching contacts that may differ from zero."""
        nq = len(self.system.coordinates)
        places = {(i, j) for i, row in self.flow.items() for j in _filled(row)}
        for (i, c), _ in self.system.W.todok().items():
            places |= {(nq + i, j) for j in _filled(self.friction[c] or ())}
        return places

    def _held_columns(self) -> list[int]:
        """Columns that a force which holds a contact may have: those of the rates of all that can be held."""
        nq, columns = len(self.system.coordinates), set()
        flowing = self.free | self._touching_places()
        for contact, slip in zip(self.system.contacts, self.slip, strict=True):
            for j in _filled(slip) if contact.sticks or contact.kind.impulsive else ():
                if j < nq:
                    columns.add(nq + j)
                elif j < self.n:
                    columns |= {column for row, column in flowing if row == j}
                else:
                    # the rate of a cosine is a sine
                    columns.add(self.n + ((j - self.n) ^ 1))
        return sorted(columns)

    def _held_places(self) -> set[Place]:
        nq = len(self.system.coordinates)
        holding = {c for c, contact in enumerate(self.system.contacts) if contact.sticks or contact.kind.impulsive}
        return {(nq + i, j) for (i, c), _ in self.system.W.todok().items() if c in holding for j in self.held}

    def _touching_places(self) -> set[Place]:
        nq, places = len(self.system.coordinates), set()
        for (i, c), _ in self.system.W.todok().items():
            if self.force[c] is not None:
                places |= {(nq + i, j) for j in self._columns(c)}
        return places

    def _columns(self, c: int) -> set[int]:
        """Columns of depth and rate of a contact."""
        rows = [row for row in (self.slip[c], self.depth[c]) if row is not None]
        return {j for row in rows for j, entry in enumerate(row[:-1]) if entry != 0}

    def _closure(self) -> set[Place]:
        """Entries of the exponential of the free flow that are not zero, among the states."""
        nq = len(self.system.coordinates)
        reach = np.eye(self.n, dtype=np.float32)
        reach[range(nq), range(nq, 2 * nq)] = 1.0
        for i, j in self.free:
            if j < self.n:
                reach[i, j] = 1.0
        while True:
            longer = np.minimum(reach @ reach, 1.0)
            if (longer == reach).all():
                return {(int(i), int(j)) for i, j in np.argwhere(reach)}
            reach = longer

    def text(self) -> str:
        """The header."""
        contacts = self.system.contacts
        guard_columns = [self._guard_columns(c, slot) for c, slot in self.guards]
        homes = self._home_guards()
        home_rows = [[j for j in self._guard_columns(*self.guards[g], holding=False) if j < self.n] for g in homes]
        bounds = [sorted({j for i, j in self.step if i in row}) for row in home_rows]
        modes = home_modes = 1
        for contact in contacts:
            modes *= _digits(contact)
            home_modes *= _away_digits(contact)
        degrees = self._degrees()
        sizes = {
            "HARMONICS": len(self.lifted.harmonics),
            "FLOW": len(self.places),
            "STEP": len(self.step),
            "GUARDS": len(self.guards),
            "GUARD_ENTRIES": sum(map(len, guard_columns)),
            "HOME_ENTRIES": sum(map(len, home_rows)),
            "BOUND_ENTRIES": sum(map(len, bounds)),
            "MODES": modes,
            "HOMES": min(home_modes, _MOST_HOMES),
            "HOME_GUARDS": len(homes),
            "VARIED": self._varied(),
            "IMPACTS": sum(contact.kind.impulsive for contact in contacts),
            "STOPS": sum(contact.kind.compliant for contact in contacts),
            "SWITCHES": sum(contact.kind.surface for contact in contacts),
            "LOW": max((degree for degree in degrees if degree is not None), default=0),
        }
        endless = {j for j, degree in enumerate(degrees) if degree is None}
        tables = {
            "endless": [int(j in endless) for j in range(len(degrees))],
            "flow_row": [i for i, _ in self.places],
            "flow_column": [j for _, j in self.places],
            "step_row": [i for i, _ in self.step],
            "step_column": [j for _, j in self.step],
            "guard_contact": [c for c, _ in self.guards],
            "guard_slot": [slot for _, slot in self.guards],
            "guard_first": _firsts(guard_columns),
            "guard_column": [j for row in guard_columns for j in row],
            "home_guard": homes,
            "home_first": _firsts(home_rows),
            "home_column": [j for row in home_rows for j in row],
            "bound_first": _firsts(bounds),
            "bound_column": [j for row in bounds for j in row],
            **{trait: [int(getattr(contact.kind, trait)) for contact in contacts] for trait in TRAITS},
            "digits": [_digits(contact) for contact in contacts],
            "sticks": [int(contact.sticks) for contact in contacts],
            "bounded": [int(contact.depth is not None) for contact in contacts],
            "poisson": [int(contact.poisson) for contact in contacts],
            # the next number is that of its partner, 0: it has none
            "partner": [0 if contact.partner is None else contact.partner + 1 for contact in contacts],
        }
        return "\n".join(
            [
                f"/* Generated from the declaration of {self.system.name} for lanes; do not edit. */",
                "#pragma once\n",
                "enum {",
                *(f"    LANES_{name} = {value}," for name, value in sizes.items()),
                "};\n",
                *(
                    f"static const unsigned char lanes_{name}[] = {{{', '.join(map(str, values)) or '0'}}};"
                    for name, values in tables.items()
                ),
                "",
                self._sums("FLOW", "A, y, d", self._flow_sums()),
                self._sums("FLOW_HIGH", "A, y, d", self._flow_sums(endless)),
                self._sums("VARIATION", "A, y, d", self._flow_sums(range(self.n))),
                self._sums("STEP_SUMS", "P, x, n", self._step_sums()),
                self._sums("GUARD_SUMS", "R, y, g", _row_sums("g", "R", "y", guard_columns)),
                self._sums("GUARD_SUMS_HIGH", "R, y, g", _row_sums("g", "R", "y", guard_columns, endless)),
                self._sums("HOME_SUMS", "R, x, g", _row_sums("g", "R", "x", home_rows)),
                self._sums("BOUND_SUMS", "B, x, b", _row_sums("b", "B", "x", bounds)),
                "",
                self._rows(),
            ]
        )

    def _guard_columns(self, c: int, slot: int, *, holding: bool = True) -> list[int]:
        """Columns of a guard in any mode, or in those in which no force holds its contact."""
        contact = self.system.contacts[c]
        if contact.kind.compliant:
            return sorted(self._columns(c)) if slot == _TANGENTIAL else sorted(_filled(self.depth[c] or ()))
        columns = set(_filled((self.depth[c] or ()) if slot == _NORMAL else self.slip[c]))
        if holding and (contact.kind.impulsive or (contact.sticks and slot != _NORMAL)):
            columns |= set(self.held) | {j for row in self.capacities[c] or () for j in _filled(row)}
        return sorted(columns)

    def _home_guards(self) -> list[int]:
        """Guards that watch something where no contact is held or touches."""
        dry = [contact.kind.dry for contact in self.system.contacts]
        return [g for g, (c, slot) in enumerate(self.guards) if slot == _NORMAL or (slot == _TANGENTIAL and dry[c])]

    def _degrees(self, forced: bool = True) -> list[int | None]:
        """Of the states and phasors as polynomials of the time in every mode; None: a series without an end. Not
        forced: of differences of states, one more than it is."""
        nq, nz = len(self.system.coordinates), self.n + len(self.lifted.phasors)
        reads = {i: {nq + i} for i in range(nq)}
        reads |= {i: {j for row, j in self.places if row == i and (forced or j < self.n)} for i in self.flow}
        degrees: list[int | None] = [None] * nz
        while True:
            updated = [
                1 + max((degrees[j] or 0 for j in reads[i]), default=0)
                if i < self.n and all(degrees[j] is not None for j in reads[i])
                else None
                for i in range(nz)
            ]
            if updated == degrees:
                return degrees
            degrees = updated

    def _varied(self) -> int:
        """Terms of the series of a difference beyond itself; 0: they have no end."""
        degrees = self._degrees(forced=False)[: self.n]
        return 0 if None in degrees else max(degree for degree in degrees if degree is not None) - 1

    def _flow_sums(self, only: Collection[int] | None = None) -> list[str]:
        """Rates of the states; of these alone, from these alone. What a series knows last is added last."""
        nq = len(self.system.coordinates)
        lines = [f"d[{i}] = y[{nq + i}];" for i in range(nq) if only is None or i in only]
        terms = [(j < self.n, e, i, j) for e, (i, j) in enumerate(self.places) if only is None or j in only]
        for i in self.flow:
            products = [f"A[{e}] * y[{j}]" for _, e, row, j in sorted(terms) if row == i]
            if only is None or i in only:
                lines.append(f"d[{i}] = {' + '.join(products) or '0.0 * y[0]'};")
        return lines or ["(void)d;"]

    def _step_sums(self) -> list[str]:
        sums = [[f"P[{e}] * x[{j}]" for e, (row, j) in enumerate(self.step) if row == i] for i in range(self.n)]
        return [f"n[{i}] += {' + '.join(products)};" for i, products in enumerate(sums)]

    @staticmethod
    def _sums(name: str, arguments: str, lines: Iterable[str]) -> str:
        body = " \\\n".join(f"        {line}" for line in lines)
        return f"#define LANES_{name}({arguments}) \\\n    do {{ \\\n{body} \\\n    }} while (0)"

    def _rows(self) -> str:
        """C that fills a LaneRows from parameters, inputs and signs."""
        system = self.system
        names: dict[Any, str] = {q: f"p[{i}]" for i, q in enumerate(system.parameters)}
        names |= {q: f"u[{i}]" for i, q in enumerate(system.inputs)}
        names |= {c.sign_symbol: f"sign[{i}]" for i, c in enumerate(system.contacts)}
        nq = len(system.coordinates)
        values: dict[str, Any] = {}
        for k, argument in enumerate(self.lifted.harmonics):
            time = next(iter(argument.free_symbols - names.keys()))
            values[f"wave[{k}]"] = sympy.diff(argument, time)
            values[f"phase[{k}]"] = argument.xreplace({time: sympy.S.Zero})
        values |= {f"flow[{i}][{nq + i}]": sympy.S.One for i in range(nq)}
        for i, row in self.flow.items():
            values |= _entries(f"flow[{i}]", row)
        for c in range(len(system.contacts)):
            values |= _entries(f"slip[{c}]", self.slip[c])
            values |= _entries(f"depth[{c}]", self.depth[c] or ())
            values |= _entries(f"force[{c}]", self.force[c] or ())
            values |= _entries(f"release[{c}]", self.release[c] or ())
            values |= _entries(f"friction[{c}]", self.friction[c] or ())
            for k, row in enumerate(self.capacities[c] or ()):
                values |= _entries(f"capacity[{c}][{k}]", row)
            values[f"restitution[{c}]"] = system.contacts[c].restitution
            values[f"mu[{c}]"] = system.contacts[c].friction
        # by place: they come in the order of a set, which is another one in each process
        values |= {f"W[{nq + i}][{c}]": system.W[i, c] for i, c in sorted(system.W.todok())}
        values |= {f"G[{i}][{c}]": system.G[i, c] for i, c in sorted(system.G.todok())}
        # inputs are held over a strobe: they have no rates
        held = {q.rate: sympy.S.Zero for q in system.inputs}
        lines = _assignments({name: sympy.sympify(value).xreplace(held) for name, value in values.items()}, names)
        head = "static void lanes_rows(const double *p, const double *u, const double *sign, LaneRows *r)"
        body = "\n".join(["    (void)p, (void)u, (void)sign;", "    memset(r, 0, sizeof *r);", *lines])
        n = "NC"
        width = self.n + len(self.lifted.phasors) + 1
        return (
            "/* rows over z and 1; laws as factors of depth and rate, and the rest */\n"
            "typedef struct {\n"
            "    double wave[MODEL_ROOM(LANES_HARMONICS)], phase[MODEL_ROOM(LANES_HARMONICS)];\n"
            f"    double flow[MODEL_NX][{width}], slip[{n}][{width}], depth[{n}][{width}];\n"
            f"    double friction[{n}][{width}], capacity[{n}][2][{width}];\n"
            f"    double force[{n}][3], release[{n}][3], restitution[{n}], mu[{n}];\n"
            f"    double W[MODEL_NX][{n}], G[{n}][{n}];\n"
            "} LaneRows;\n\n"
            f"{head}\n{{\n{body}\n}}\n"
        )


def _filled(row: Sequence[Any]) -> list[int]:
    """Columns of a row, but for its constant, that may be other than zero."""
    return [j for j, entry in enumerate(row[:-1]) if entry != 0]


def _inlined(contact: ContactDynamics, expression: sympy.Basic, slip: sympy.Expr) -> sympy.Basic:
    """A law of friction at a slip speed."""
    return sympy.sympify(expression).xreplace({contact.slip_symbol: slip})


def _assignments(values: Mapping[str, Any], names: Mapping[Any, str]) -> list[str]:
    """Assignments of all that is not zero, with common parts computed once."""
    nonzero = {name: value for name, value in values.items() if value != 0}
    shared, results = sympy.cse(list(nonzero.values()), symbols=sympy.numbered_symbols("part", cls=sympy.Dummy))
    symbols = {**names, **{symbol: f"part{i}" for i, (symbol, _) in enumerate(shared)}}
    lines = [f"    const double {symbols[symbol]} = {c_expression(value, symbols)};" for symbol, value in shared]
    return lines + [f"    r->{n} = {c_expression(value, symbols)};" for n, value in zip(nonzero, results, strict=True)]


def _entries(name: str, row: Sequence[Any]) -> dict[str, Any]:
    return {f"{name}[{j}]": entry for j, entry in enumerate(row)}


def _firsts(rows: Sequence[Sequence[int]]) -> list[int]:
    return [sum(len(row) for row in rows[:i]) for i in range(len(rows) + 1)]


def _row_sums(
    result: str, factors: str, vector: str, rows: Sequence[Sequence[int]], only: Collection[int] | None = None
) -> list[str]:
    lines, e = [], 0
    for i, row in enumerate(rows):
        products = [f"{factors}[{e + k}] * {vector}[{j}]" for k, j in enumerate(row) if only is None or j in only]
        e += len(row)
        lines.append(f"{result}[{i}] += {' + '.join(products)};" if products else f"(void){result};")
    return lines
