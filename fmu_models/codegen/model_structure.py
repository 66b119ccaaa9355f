"""What depends on what among the variables of an FMU: the element ModelStructure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from fmu_models.codegen.variables import Variable, Variables
from fmu_models.language.inertia import blocks
from fmu_models.language.quantities import TIME, Acceleration, Input, Rate, State
from fmu_models.lowering.hybrid_system import acting

if TYPE_CHECKING:
    import sympy

    from fmu_models.language.contact_dynamics import ContactDynamics
    from fmu_models.lowering.hybrid_system import HybridSystem

# operations up to which it is asked how an expression depends on what is in it
_LARGEST_EXPRESSION = 100


@dataclass(frozen=True)
class ModelUnknown:
    """An entry of the model structure: a variable and the references it depends on, all of them if ``None``.

    ``kinds`` says of each how: by a constant factor, by one of parameters ("tunable"), or in another way ("dependent").
    """

    variable: Variable
    dependencies: tuple[int, ...] | None = None
    kinds: tuple[str, ...] | None = None

    @property
    def attributes(self) -> dict[str, str | None]:
        """Attributes of its element, beside the reference."""
        lists = {"dependencies": self.dependencies, "dependenciesKind": self.kinds}
        return {key: None if v is None else " ".join(map(str, v)) for key, v in lists.items()}


class ModelStructure:
    """The unknowns of one lowered system, and the variables that they are."""

    def __init__(self, system: HybridSystem) -> None:
        self.system = system.with_piles()
        self.variables = Variables(system)
        # the states of a map jump, and none of them is integrated
        velocities = [q.v for q in system.coordinates]
        self._rates = [] if system.rule else [*velocities, *system.rate_symbols, *system.internal_rates]

    @cached_property
    def output_unknowns(self) -> list[ModelUnknown]:
        """All outputs: states, which depend on themselves; what follows from them; and what changes at events alone,
        which depends on everything through these, as the states of a map do."""
        unknowns = [
            *(ModelUnknown(v, (v.reference,), ("constant",)) for v in self.variables.states if not self.system.rule),
            *self.derivative_unknowns,
            *(
                self._unknown(v, self._symbols([o.expression]), o.expression)
                for v, o in zip(self.variables.outputs, self.system.outputs, strict=True)
            ),
            *self.indicator_unknowns,
        ]
        known = {u.variable.reference: u for u in unknowns}
        return [known.get(v.reference, ModelUnknown(v)) for v in self._outputs]

    @cached_property
    def derivative_unknowns(self) -> list[ModelUnknown]:
        """Derivatives of the states."""
        return [
            self._unknown(v, self._symbols([rate]), rate)
            for v, rate in zip(self.variables.derivatives, self._rates, strict=True)
        ]

    def output_order(self, highest: int) -> int:
        """The order up to which derivatives in time of all outputs follow from inputs and their rates, at most
        ``highest``: one more than the fewest integrations between. At least 1: an output that takes the rate of an
        input at once, as a force in stick does, has it where it does not."""
        inputs = {self.variables.references[u]: 0 for u in self.system.inputs}
        apart = inputs | {self.variables.references[u.rate]: -1 for u in self.system.inputs}

        def nearest(unknown: ModelUnknown) -> int:
            return min((apart[r] for r in unknown.dependencies or () if r in apart), default=highest)

        # what is further than the highest order does not matter: nearest ones are right after so many rounds
        for _ in range(min(highest + 2, len(self.variables.states))):
            for rate in self.derivative_unknowns:
                apart[rate.variable.derivative or 0] = nearest(rate) + 1
        ports = [u for u in self.output_unknowns if u.variable.variability == "continuous"]
        return max(1, min(highest, 1 + min(map(nearest, ports), default=highest)))

    @cached_property
    def indicator_unknowns(self) -> list[ModelUnknown]:
        """Indicators of the contacts."""
        sources = []
        for c in self.system.contacts:
            behind = {
                "depth": [c.depth],
                "gap": [c.depth, c.force_symbol],
                "slip": [c.slip, *c.capacities, c.force_symbol],
                "release": [c.release],
                "function": [c.slip, c.force_symbol],
            }
            sources += [self._symbols([e for e in behind[indicator] if e is not None]) for indicator in c.indicators]
        return [self._unknown(v, s) for v, s in zip(self.variables.indicators, sources, strict=True)]

    @property
    def initial_unknowns(self) -> list[ModelUnknown]:
        """What initialization computes, in order of reference.

        It chooses the states of the contacts, by everything, and lets bodies bounce that move into a wall.
        """
        sources = [*self._rates, *(o.expression for o in self.system.outputs)]
        variables = (*self.variables.derivatives, *self.variables.outputs)
        unknowns = [
            self._unknown(v, behind, e, initial=True)
            if (behind := self._start_values([e])) is not None
            else ModelUnknown(v)
            for v, e in zip(variables, sources, strict=True)
        ]
        known = {u.variable.reference for u in unknowns}
        exposed = [v for v in self._outputs if v.initial == "calculated" and v.reference not in known]
        return sorted(unknowns + [ModelUnknown(v) for v in exposed], key=lambda u: u.variable.reference)

    def _start_values(self, expressions: Iterable[sympy.Expr]) -> set[sympy.Basic] | None:
        """What is given at the start behind expressions, parameters too; None if the state of a contact is."""
        contacts = self.system.contacts
        if any(c.reset or c.kind.rigid or c.kind.cone for c in contacts):
            return None
        behind: dict[Any, set[sympy.Basic]] = {c.slip_symbol: c.slip.free_symbols for c in contacts}
        behind |= {c.depth_symbol: c.depth.free_symbols for c in contacts if c.depth is not None}
        if not contacts:
            behind |= self._free_accelerations
        symbols: set[sympy.Basic] = set()
        for symbol in set().union(*(expression.free_symbols for expression in expressions)):
            symbols |= behind.get(symbol, {symbol})
        return symbols if symbols <= self.variables.references.keys() | self.variables.parameters.keys() else None

    def _unknown(
        self,
        variable: Variable,
        symbols: Iterable[sympy.Basic],
        expression: sympy.Expr | None = None,
        *,
        initial: bool = False,
    ) -> ModelUnknown:
        """An entry with what it depends on; its expression, if given, says how."""
        references = self.variables.references | (self.variables.parameters if initial else {})
        ordered = sorted(((references[s], s) for s in symbols if s in references), key=lambda pair: pair[0])
        kinds = ["dependent"] * len(ordered)
        direct = self.variables.references.keys() | self.variables.parameters.keys()
        if (
            expression is not None
            and expression.free_symbols <= direct
            and expression.count_ops() <= _LARGEST_EXPRESSION
        ):
            for i, (_, symbol) in enumerate(ordered):
                factors = expression.diff(symbol).free_symbols
                if not factors:
                    kinds[i] = "constant"
                elif not initial and factors <= self.variables.parameters.keys():
                    kinds[i] = "tunable"
        return ModelUnknown(variable, tuple(reference for reference, _ in ordered), tuple(kinds))

    @property
    def _outputs(self) -> list[Variable]:
        return [v for v in self.variables.listed if v.causality == "output"]

    @cached_property
    def _free_accelerations(self) -> dict[Acceleration, set[sympy.Basic]]:
        system = self.system
        symbols = [set(e.free_symbols) for e in system.acceleration]
        for block in blocks(len(symbols), system.inertia) if system.inertia else ():
            together = set().union(*(symbols[i] for i in block))
            together |= set().union(*(e.free_symbols for (i, _), e in system.inertia.items() if i in block))
            for i in block:
                symbols[i] = together
        return dict(zip(system.rate_symbols, symbols, strict=True))

    @cached_property
    def _forces(self) -> dict[Any, set[sympy.Basic]]:
        """Symbols on which the force of each contact depends, in slip or in stick."""
        contacts = self.system.contacts
        laws = {c.force_symbol: self._symbols([c.force], contact=c) for c in contacts}
        stuck = [self._symbols([c.slip_rate, *c.capacities], free=True) for c in contacts]
        inertia = self._inertia_symbols
        together = set().union(inertia, *laws.values(), *stuck)
        shared = {c.force_symbol for c in contacts if c.sticks or c.kind.impulsive or c.kind.side}
        return {force: together if force in shared else own for force, own in laws.items()}

    @cached_property
    def _accelerations(self) -> dict[Acceleration, set[sympy.Basic]]:
        """Symbols on which each acceleration depends, contact forces included."""
        symbols = {a: set(symbols) for a, symbols in self._free_accelerations.items()}
        for i, k in acting(self.system):
            a, contact = self.system.rate_symbols[i], self.system.contacts[k]
            entry: Any = self.system.W[i, k]
            lever = self._inertia_symbols if self.system.inertia else entry.free_symbols
            symbols[a] |= lever | self._forces[contact.force_symbol]
        return symbols

    @cached_property
    def _inertia_symbols(self) -> set[sympy.Basic]:
        """Symbols on which G depends; with a mass matrix, those of it and of all levers."""
        system = self.system
        entries = [*system.inertia.values(), *(system.W if system.inertia else system.G).values()]
        return set().union(*(entry.free_symbols for entry in entries))

    def _symbols(
        self, expressions: Iterable[sympy.Expr], *, contact: ContactDynamics | None = None, free: bool = False
    ) -> set[sympy.Basic]:
        """Known quantities behind expressions. free: accelerations in them stand for those without contact forces."""
        slips: dict[Any, set[sympy.Basic]] = {c.slip_symbol: c.slip.free_symbols for c in self.system.contacts}
        slips |= {c.depth_symbol: c.depth.free_symbols for c in self.system.contacts if c.depth is not None}
        slips |= {c.slip_symbol: {e.state for e in c.elements} for c in self.system.contacts if c.elements}
        symbols: set[sympy.Basic] = set()
        for symbol in set().union(*(expression.free_symbols for expression in expressions)):
            if symbol in slips:
                symbols |= slips[symbol]
            elif isinstance(symbol, Acceleration):
                symbols |= (self._free_accelerations if free else self._accelerations)[symbol]
            elif contact is None and not free and symbol in self._forces:
                symbols |= self._forces[symbol]
            elif symbol is TIME or isinstance(symbol, State | Input | Rate):
                symbols.add(symbol)
        return symbols
