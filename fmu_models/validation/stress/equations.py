"""The equations of a declaration as NumPy functions: what the engine's C code must agree with, written independently.

At a sample (time, states, inputs, contact states, contact forces) of a run they give

    residual      rates that the engine reports minus those of the declaration under the forces that it reports
    forces        reported minus what the laws say for the contact states reported
    admissible    by how much a contact state contradicts its own condition: a gap that is negative, a stick beyond its
                  capacity, a slip with the wrong sign

each relative to the sum of the magnitudes of its terms, less what rounding of the states alone makes of it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.language.contact_kinds import STICK
from fmu_models.language.inertia import mass_matrix
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME
from fmu_models.lowering.hybrid_system import HybridSystem
from fmu_models.lowering.lagrange import generalised_forces
from fmu_models.lowering.lower import lower
from fmu_models.validation.stress.roles import Model

Columns = Mapping[str, NDArray[np.float64]]

# states are moved by this fraction to see how much their rounding matters, and so many roundings are forgiven
NUDGE = 2.0**-36
ROUNDINGS = 32 * 2.0**-53


@dataclass(frozen=True, eq=False)
class StressFindings:
    """Largest contradictions (relative; nan where nothing could be evaluated) and what they were found in."""

    error: float
    what: str


class StressEquations:
    """Everything that the judge evaluates of one model, compiled once."""

    def __init__(self, model: Model) -> None:
        self.system: HybridSystem = lower(model)
        system = self.system
        if any(contact.kind.cone for contact in system.contacts):
            raise StickslipError(
                f"{model.name} has friction with two directions, which no judge knows. Simulate it alone."
            )
        if system.signals:
            raise StickslipError(f"{model.name} has a periodic signal, which no judge knows. Stress it without.")
        self.driven = [state.name for state in system.driven]
        self.parameters = {p.name: p.value for p in system.parameters}
        self.inputs = {u.name: u.value for u in system.inputs}
        self.starts = {s.name: s.start for s in system.states}
        self.has_energy = any(output.name == "energy" for output in system.outputs)
        # a scaled model, whose time is scaled too, cannot be scaled again
        self.has_units = any(state.unit != "1" for state in (system.coordinates or system.driven))
        self._symbols: list[sympy.Symbol] = [
            TIME,
            *system.parameters,
            *system.inputs,
            *(u.rate for u in system.inputs),
            *system.states,
            *(s for c in system.contacts for s in _symbols(c)),
        ]
        # forces of a mechanism, rates of an automaton, without those of contacts
        sides = generalised_forces(model) if isinstance(model, Mechanism) else system.acceleration
        self._rates = [self._compiled(_terms(side)) for side in sides]
        self._mass = self._compiled(mass_matrix(model).flat()) if isinstance(model, Mechanism) else None
        self._W = None if self._mass else self._compiled(system.W.flat())
        energy = sum((o.expression for o in system.outputs if o.name == "energy"), sympy.S.Zero)
        self._energy = self._compiled(_terms(energy))
        self._slopes = [self._compiled([sympy.diff(c.slip, state) for state in system.driven]) for c in system.contacts]
        self._G = None if self._mass else self._compiled([system.G[i, i] for i in range(len(system.contacts))])
        self._contacts = [self._compile_contact(c) for c in system.contacts]

    def _compiled(self, expressions: list[Any]) -> Callable[..., list[Any]]:
        return sympy.lambdify(self._symbols, expressions, modules="numpy", cse=True)

    def _compile_contact(self, c: ContactDynamics) -> dict[str, Callable[..., list[Any]]]:
        return {
            "slip": self._compiled(list(c.slip_terms)),
            "depth": self._compiled(list(c.depth_terms)),
            "force": self._compiled([c.force, c.friction, c.restitution]),
            "capacities": self._compiled(list(c.capacities)),
        }

    def environment(self, columns: Columns, parameters: Mapping[str, float]) -> list[Any]:
        """Values of all symbols at the samples of ``columns`` (each (n,)), in the order of the compiled functions."""
        system = self.system
        values: list[Any] = [columns["time"]]
        values += [float(parameters.get(p.name, p.value)) for p in system.parameters]
        values += [columns.get(u.name, u.value) for u in system.inputs]
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
                sign = 1.0 if c.kind.impulsive else -1.0
                values[places[c.force_symbol]] = sign * columns[f"{c.name}_force"]
        return values

    def place(self, c: int, values: list[Any], quantity: str) -> tuple[Any, Any]:
        """Slip or depth of contact ``c``, and the sum of the magnitudes of its terms."""
        terms = self._contacts[c][quantity](*values)
        return sum(terms), sum(np.abs(term) for term in terms)

    def laws(self, c: int, values: list[Any]) -> tuple[Any, Any, Any]:
        """Force of contact ``c`` while it slips or touches, coefficients of friction and of restitution."""
        return tuple(self._contacts[c]["force"](*values))

    def capacities(self, c: int, values: list[Any]) -> tuple[Any, Any]:
        """Largest lambda and largest -lambda of contact ``c`` in stick."""
        return tuple(self._contacts[c]["capacities"](*values))

    def forces(self, columns: Columns, values: list[Any]) -> list[Any]:
        """lambda of every contact: what the run reports; of a switch what its sign says, nan while it slides."""
        forces = []
        for i, c in enumerate(self.system.contacts):
            if c.kind.surface:
                state = columns[f"{c.name}_state"]
                law = self.laws(i, values)[0] + 0.0 * state
                forces.append(np.where(state == STICK, np.nan if c.sticks else 0.0, law))
            else:
                sign = 1.0 if c.kind.impulsive else -1.0
                forces.append(sign * columns[f"{c.name}_force"])
        return forces

    def rates(self, columns: Columns, parameters: Mapping[str, float]) -> tuple[NDArray, NDArray]:
        """Rates of the driven states under the forces reported, and the magnitudes of their terms: (n_driven, n).

        Those of a mechanism come from its mass matrix and forces, not from the accelerations that the engine uses.
        """
        values = self.environment(columns, parameters)
        forces = self.forces(columns, values)
        shape = columns["time"].shape
        sides = [[np.broadcast_to(term, shape) for term in compiled(*values)] for compiled in self._rates]
        total = np.array([sum(terms, np.zeros(shape)) for terms in sides])
        size = np.array([sum((np.abs(term) for term in terms), np.zeros(shape)) for terms in sides])
        inverse = self._compliance(values, shape)
        if inverse is not None:
            total = np.einsum("kij,jk->ik", inverse, total)
            size = np.einsum("kij,jk->ik", np.abs(inverse), size)
        W = self._effects(values, inverse, shape)
        for j, force in enumerate(forces):
            total = total + W[:, j] * force
            size = size + np.abs(W[:, j] * force)
        return total, size

    def _compliance(self, values: list[Any], shape: tuple[int, ...]) -> NDArray | None:
        """Inverse mass matrices, (n, n_driven, n_driven); None of an automaton."""
        if self._mass is None:
            return None
        n = len(self.driven)
        mass = np.array([np.broadcast_to(m, shape) for m in self._mass(*values)]).reshape(n, n, *shape)
        return np.linalg.inv(np.moveaxis(mass, -1, 0))

    def _effects(self, values: list[Any], inverse: Any, shape: tuple[int, ...]) -> NDArray:
        """Rates of the driven states per contact force, (n_driven, n_contacts, n)."""
        size = (len(self.driven), len(self._slopes), *shape)
        if self._W is not None:
            return np.array([np.broadcast_to(w, shape) for w in self._W(*values)]).reshape(size)
        levers = [[np.broadcast_to(lever, shape) for lever in slopes(*values)] for slopes in self._slopes]
        return np.einsum("kij,cjk->ick", inverse, np.array(levers).reshape(len(levers), size[0], *shape))

    def gross(self, columns: Columns, parameters: Mapping[str, float]) -> list[tuple[float, float]]:
        """Per contact the slip speed and the force whose rounding is that of the run.

        In a rate of slip terms of this size cancel; uncancelled they make that speed in the time of the run, and it
        takes that force to hold them.
        """
        values = self.environment(columns, parameters)
        _, size = self.rates(columns, parameters)
        span = float(columns["time"][-1] - columns["time"][0])
        effects = self._own_effects(values, columns["time"].shape)
        sizes = []
        for i, slopes in enumerate(self._slopes):
            along = [np.abs(slope) for slope in slopes(*values)]
            rate = sum((a * size[k] for k, a in enumerate(along)), np.zeros(size.shape[1:]))
            rate = float(np.nanmax(rate)) if rate.size else 0.0
            G = np.nanmin(np.abs(effects[i])) if rate > 0 else 1.0
            sizes.append((rate * span, rate / float(G) if G > 0 else rate))
        return sizes

    def _own_effects(self, values: list[Any], shape: tuple[int, ...]) -> list[Any]:
        """Rate of y of every contact per force of its own."""
        if self._G is not None:
            return self._G(*values)
        W = self._effects(values, self._compliance(values, shape), shape)
        return [
            sum((lever * W[k, c] for k, lever in enumerate(slopes(*values))), np.zeros(shape))
            for c, slopes in enumerate(self._slopes)
        ]

    def energy_size(self, columns: Columns, parameters: Mapping[str, float]) -> float:
        """Largest sum of the magnitudes of the terms of the energy."""
        terms = self._energy(*self.environment(columns, parameters))
        return float(np.max(sum((np.abs(term) for term in terms), np.zeros(columns["time"].shape))))

    def nudged(self, columns: Columns) -> dict[str, NDArray]:
        """The samples with states moved by NUDGE, alternately up and down, and the time with them."""
        moved = dict(columns) | {"time": columns["time"] * (1.0 + NUDGE)}
        for k, state in enumerate(self.system.states):
            moved[state.name] = columns[state.name] * (1.0 + (-1) ** k * NUDGE)
        return moved

    def residual(self, columns: Columns, parameters: Mapping[str, float]) -> StressFindings:
        """Largest relative difference of the rates reported from those of the declaration."""
        with np.errstate(all="ignore"):
            rates, size = self.rates(columns, parameters)
            moved, _ = self.rates(self.nudged(columns), parameters)
            reported = np.array([columns[f"der({name})"] for name in self.driven])
            rounding = np.abs(moved - rates) / NUDGE * ROUNDINGS
            error = (np.abs(reported - rates) - rounding) / np.where(size > 0, size, 1.0)
        error[~np.isfinite(error)] = 0.0
        if not error.size:
            return StressFindings(0.0, "")
        row = int(error.max(axis=1).argmax())
        return StressFindings(max(0.0, float(error.max())), f"rate of {self.driven[row]}")


def _symbols(c: ContactDynamics) -> list[Any]:
    every = (c.force_symbol, c.slip_symbol, c.sign_symbol, c.depth_symbol, c.memory_symbol)
    return [symbol for symbol in every if symbol is not None]


def _terms(expression: sympy.Expr) -> list[Any]:
    """Terms of a sum, each with its own magnitude."""
    return list(sympy.Add.make_args(sympy.expand(expression)))
