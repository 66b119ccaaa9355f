"""The equations of a declaration as NumPy functions: what the engine's C code must agree with, written independently.

At a sample (time, states, inputs, contact states, contact forces) of a run they give

    residual      rates that the engine reports minus those of the declaration under the forces that it reports
    forces        reported minus what the laws say for the contact states reported
    admissible    by how much a contact state contradicts its own condition: a gap that is negative, a stick beyond its
                  capacity, a slip with the wrong sign

each relative to the sum of the magnitudes of its terms, less what rounding of the states alone makes of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from fmu_models.language.quantities import TIME
from fmu_models.lowering.hybrid_system import ContactDynamics, HybridSystem
from fmu_models.lowering.lower import lower
from fmu_models.stress.roles import Model

Columns = Mapping[str, NDArray[np.float64]]

SLIP_MINUS, STICK, SLIP_PLUS, AWAY, TOUCHING, RELEASED, CHATTERING = -1, 0, 1, 2, 3, 4, 5

# states are moved by this fraction to see how much their rounding matters, and so many roundings are forgiven
NUDGE = 2.0**-36
ROUNDINGS = 32 * 2.0**-53


@dataclass(frozen=True, eq=False)
class Findings:
    """Largest contradictions (relative; nan where nothing could be evaluated) and what they were found in."""

    error: float
    what: str


class Equations:
    """Everything that the judge evaluates of one model, compiled once."""

    def __init__(self, model: Model) -> None:
        self.system: HybridSystem = lower(model)
        system = self.system
        self.driven = [state.name for state in system.driven]
        self.parameters = {p.name: p.value for p in system.parameters}
        self.inputs = {u.name: u.value for u in system.inputs}
        self.starts = {s.name: s.start for s in system.states}
        self.has_energy = any(output.name == "energy" for output in system.outputs)
        self._symbols: list[sympy.Symbol] = [
            TIME,
            *system.parameters,
            *system.inputs,
            *(u.rate for u in system.inputs),
            *system.states,
            *(s for c in system.contacts for s in _symbols(c)),
        ]
        self._rates = [self._compiled(_terms(a)) for a in system.acceleration]
        self._W = self._compiled(list(system.W))
        self._internal = self._compiled([sympy.sympify(rate) for rate in system.internal_rates])
        self._contacts = [self._compile_contact(c) for c in system.contacts]

    def _compiled(self, expressions: list[Any]) -> Callable[..., list[Any]]:
        return sympy.lambdify(self._symbols, expressions, modules="numpy", cse=True)

    def _compile_contact(self, c: ContactDynamics) -> dict[str, Callable[..., list[Any]]]:
        return {
            "slip": self._compiled(list(c.slip_terms)),
            "depth": self._compiled(list(c.depth_terms)),
            "force": self._compiled([c.force, c.capacity, c.friction, c.restitution]),
        }

    def environment(self, columns: Columns, parameters: Mapping[str, float]) -> list[Any]:
        """Values of all symbols at the samples of ``columns`` (each (n,)), in the order of the compiled functions."""
        system = self.system
        values: list[Any] = [columns["time"]]
        values += [float(parameters.get(p.name, p.value)) for p in system.parameters]
        values += [columns[u.name] if u.name in columns else u.value for u in system.inputs]
        values += [0.0 for _ in system.inputs]
        values += [columns[s.name] for s in system.states]
        start = len(values)
        values += [0.0] * (len(self._symbols) - start)
        for compiled, c in zip(self._contacts, system.contacts, strict=True):
            state = columns[f"{c.name}_state"]
            places = {symbol: i for i, symbol in enumerate(self._symbols[start:], start)}
            values[places[c.sign_symbol]] = np.where(np.abs(state) == 1, state, 0.0)
            values[places[c.slip_symbol]] = sum(compiled["slip"](*values))
            if c.depth_symbol is not None:
                values[places[c.depth_symbol]] = np.maximum(sum(compiled["depth"](*values)), 0.0)
            if c.memory_symbol is not None:
                values[places[c.memory_symbol]] = columns.get(f"{c.name}_memory", np.zeros_like(state))
            if f"{c.name}_force" in columns:
                sign = 1.0 if c.kind == "impact" else -1.0
                values[places[c.force_symbol]] = sign * columns[f"{c.name}_force"]
        return values

    def place(self, c: int, values: list[Any], which: str) -> tuple[Any, Any]:
        """Slip or depth of contact ``c``, and the sum of the magnitudes of its terms."""
        terms = self._contacts[c][which](*values)
        return sum(terms), sum(np.abs(term) for term in terms)

    def laws(self, c: int, values: list[Any]) -> tuple[Any, Any, Any, Any]:
        """Force of contact ``c`` while it slips or touches, capacity, coefficients of friction and of restitution."""
        force, capacity, friction, restitution = self._contacts[c]["force"](*values)
        return force, capacity, friction, restitution

    def forces(self, columns: Columns, values: list[Any]) -> list[Any]:
        """lambda of every contact: what the run reports; of a switch what its sign says, nan while it slides."""
        found = []
        for i, c in enumerate(self.system.contacts):
            if c.kind == "switch":
                state = columns[f"{c.name}_state"]
                law = self.laws(i, values)[0] + 0.0 * state
                found.append(np.where(state == STICK, np.nan if c.sticks else 0.0, law))
            else:
                sign = 1.0 if c.kind == "impact" else -1.0
                found.append(sign * columns[f"{c.name}_force"])
        return found

    def rates(self, columns: Columns, parameters: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Rates of the driven states under the forces reported, and the magnitudes of their terms: (n_driven, n)."""
        values = self.environment(columns, parameters)
        forces = self.forces(columns, values)
        shape = columns["time"].shape
        W = np.array([np.broadcast_to(w, shape) for w in self._W(*values)]).reshape(len(self.driven), -1, *shape)
        total, size = [], []
        for i, compiled in enumerate(self._rates):
            by_contacts = [W[i, j] * force for j, force in enumerate(forces)]
            terms = [np.broadcast_to(term, shape) for term in (*compiled(*values), *by_contacts)]
            total.append(sum(terms, np.zeros(shape)))
            size.append(sum((np.abs(term) for term in terms), np.zeros(shape)))
        return np.array(total), np.array(size)

    def nudged(self, columns: Columns) -> dict[str, NDArray]:
        """The samples with states moved by NUDGE, alternately up and down."""
        moved = dict(columns)
        for k, state in enumerate(self.system.states):
            moved[state.name] = columns[state.name] * (1.0 + (-1) ** k * NUDGE)
        return moved

    def residual(self, columns: Columns, parameters: Mapping[str, float]) -> Findings:
        """Largest relative difference of the rates reported from those of the declaration."""
        with np.errstate(all="ignore"):
            rates, size = self.rates(columns, parameters)
            moved, _ = self.rates(self.nudged(columns), parameters)
            reported = np.array([columns[f"der({name})"] for name in self.driven])
            rounding = np.abs(moved - rates) / NUDGE * ROUNDINGS
            error = (np.abs(reported - rates) - rounding) / np.where(size > 0, size, 1.0)
        error[~np.isfinite(error)] = 0.0
        if not error.size:
            return Findings(0.0, "")
        row = int(error.max(axis=1).argmax())
        return Findings(max(0.0, float(error.max())), f"rate of {self.driven[row]}")


def _symbols(c: ContactDynamics) -> list[Any]:
    every = (c.force_symbol, c.slip_symbol, c.sign_symbol, c.depth_symbol, c.memory_symbol)
    return [symbol for symbol in every if symbol is not None]


def _terms(expression: sympy.Expr) -> list[Any]:
    """Terms of a sum, each with its own magnitude; a quotient stays whole."""
    return list(sympy.Add.make_args(sympy.expand(expression) if len(expression.free_symbols) < 12 else expression))
