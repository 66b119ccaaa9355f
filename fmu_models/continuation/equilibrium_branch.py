"""Branches of equilibria, and what is met on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.continuation.born_cycle import cycles_from_boundary, cycles_from_hopf
from fmu_models.continuation.branch import Branch, joined
from fmu_models.continuation.curves.curve import Curve
from fmu_models.continuation.curves.equilibrium import still
from fmu_models.continuation.curves.trace import curve_of
from fmu_models.continuation.ended import Ended
from fmu_models.continuation.leaving import beside_branch_point
from fmu_models.continuation.normal_forms.cubic import UNKNOWN, Coefficient, coefficient, criticality
from fmu_models.continuation.problem.equilibrium import EquilibriumProblem, eigenvalues_of
from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.problem.problem import Vector, Word
from fmu_models.continuation.special.boundary import Boundary
from fmu_models.continuation.special.special import branch_kind
from fmu_models.continuation.special.sticking_set import StickingSet
from fmu_models.continuation.step.equilibrium import AtSurface, EquilibriumFollower
from fmu_models.continuation.step.way import Found, Way

Complex = NDArray[np.complex128]
# what a picture may show beside a state
EIGENVALUES = "eigenvalues"


@dataclass(frozen=True, eq=False)
class SpecialEquilibrium(Shown):
    """An equilibrium at which something happens.

    Attributes:
        kind: "fold", "Hopf", "pitchfork", "branch point", or a name of the module where the branch meets a surface.
        parameter, value: name and value of the parameter.
        state: by name.
        eigenvalues: (n,) by falling real part, before the surface; 1/s.
        eigenvalues_after: (n,) beyond the surface; None at smooth points and where nothing goes on.
        crossings: shares q of J+ at which one of the set of eigenvalues is "zero", a pair on the "imaginary axis", or
            a pair "double" on the real line. J+ is the side on which the state of the contact is the larger number (1
            above 0 above -1).
        contact: whose surface it is.
        turns: two equilibria meet at the surface, and there is none beyond its value.
    """

    RECORD: ClassVar = (
        *("kind", "criticality", "normal_form", "value", "state", "eigenvalues", "eigenvalues_after", "frequency"),
        *("contact", "turns", "crossings=crossing_points"),
    )

    kind: str
    parameter: str
    value: float
    state: Mapping[str, float]
    eigenvalues: Complex
    eigenvalues_after: Complex | None = None
    crossings: Mapping[str, Sequence[float]] = field(default_factory=dict)
    contact: str = ""
    turns: bool = False
    node: Any = field(default=None, repr=False)
    boundary: Any = field(default=None, repr=False)
    between: tuple[float, float] = (-np.inf, np.inf)

    @cached_property
    def frequency(self) -> float:
        """Of the pair on the imaginary axis, rad/s; nan where there is none."""
        if self.kind == "Hopf":
            return float(np.abs(self.eigenvalues[np.abs(self.eigenvalues.real).argmin()].imag))
        return float(np.abs(self.path(self.crossings["imaginary axis"]).imag).max()) if self._pairs else np.nan

    @property
    def _pairs(self) -> bool:
        return "imaginary axis" in self.crossings

    @cached_property
    def _cubic(self) -> Coefficient:
        return coefficient("Hopf", self.node) if self.kind == "Hopf" else UNKNOWN

    @property
    def normal_form(self) -> float:
        """First Lyapunov coefficient of a Hopf point, eigenvector of length one in the units of the states; nan at
        other kinds."""
        return self._cubic.value

    @property
    def criticality(self) -> str:
        """ "supercritical" or "subcritical", by the normal form; "degenerate or undecided" where that is not above its
        error, "" where it is not known."""
        return criticality(self.kind, self._cubic)

    @property
    def crossing_points(self) -> dict[str, list[dict[str, Any]]]:
        """``crossings`` with the eigenvalues at each share."""
        return {
            name: [{"q": q, "eigenvalues": self.path([q])[0]} for q in shares]
            for name, shares in self.crossings.items()
        }

    def path(self, q: Sequence[float] | Vector) -> Complex:
        """(m, n) eigenvalues of (1 - q) J- + q J+ at shares (m,).

        Raises:
            StickslipError: the point is not at a surface that an equilibrium is on both sides of.
        """
        if self.boundary is None:
            raise StickslipError(f"The {self.kind} at {self.parameter} = {self.value:.9g} is at no switching surface.")
        return self.boundary.path(np.asarray(q, dtype=float))

    def switch(self, points: int = 2000) -> tuple[Branch | EquilibriumBranch, ...]:
        """The branches that leave here, over the range of this one: cycles from a Hopf point or a discontinuous one,
        equilibria from a pitchfork or branch point.

        Raises:
            StickslipError: none leaves at a point of this kind, or none was found.
        """
        branches: tuple[Branch | EquilibriumBranch, ...] = ()
        if self.kind == "Hopf":
            branches = cycles_from_hopf(self.node, self.frequency, self.between, points)
        elif self.boundary is not None and self._pairs:
            branches = cycles_from_boundary(self.boundary, self.frequency, self.between, points)
        elif self.kind in ("pitchfork", "branch point"):
            begins = beside_branch_point(self.node)
            branches = tuple(
                branch_of_ways(EquilibriumFollower(node, self.between, points).follow(), None, self.between)
                for node in begins
            )
        if not branches:
            raise StickslipError(
                f"No branch was found that leaves at the {self.kind} at {self.parameter} = {self.value:.9g}: cycles "
                "leave at Hopf points and discontinuous ones, equilibria at pitchforks and branch points."
            )
        return branches

    def curve(self, second: str, between: tuple[float, float] | None = None, points: int = 500) -> Curve:
        """The point as a curve in two parameters, as ``Special.curve``; its multipliers are eigenvalues, and its
        periods those of a Hopf point.

        Raises:
            StickslipError: a point at a switching surface, no such parameter, a range that does not hold its present
                value, or one that the parameter takes apart.
        """
        if self.boundary is not None:
            raise StickslipError(f"A {self.kind} has no curve: folds, Hopf points, pitchforks and branch points have.")
        return still(curve_of(self.kind, self.node, None, second, between, self.between, points))

    def _contents(self) -> dict[str, object]:
        contents: dict[str, object] = {
            "kind": self.kind,
            self.parameter: self.value,
            "criticality": self.criticality or None,
        }
        contents |= {"eigenvalues": self.eigenvalues, "beyond": self.eigenvalues_after}
        return contents | {"contact": self.contact or None, "crossings": dict(self.crossings) or None}


@dataclass(frozen=True, eq=False)
class EquilibriumBranch(Ended):
    """Of m equilibria, n states.

    Attributes:
        model, over: names of the model and of the parameter.
        of: what a picture shows: a state, or "eigenvalues" for their path in the complex plane.
        states: names.
        values: (m,) of the parameter.
        points: (m, n) states.
        eigenvalues: (m, n) by falling real part, 1/s; minus infinity across what sticks.
        stable: (m,).
        words: (contact, state, state) of all contacts at each.
        special: what was met, in order.
        places: (len(special),) number of points before each.
        ends: kind and a sentence, of both ends.
        intervals: (m, 2, n) where a contact sticks the equilibria beside one are as good: the first and the last one of
            each set, where the contact begins to slip, within 1e-10 of its capacity. The points are their middles, and
            one eigenvalue is zero, along the set. None where equilibria stand alone.
        cycles: those that leave at its special points, once they were followed.
        units: of states and of the parameter.
        seconds: CPU time.
        how: where rates come from and how near derivatives are, where that is not a matter of course.
    """

    COLUMNS: ClassVar = (
        "{over}=values",
        "{states}=points",
        "{states}_from=intervals.0",
        "{states}_to=intervals.1",
        "stable",
        "eigenvalue{}=eigenvalues",
    )
    RECORD: ClassVar = (
        "model",
        "over",
        "states",
        "ends=named_ends",
        "points=rows",
        "special",
        "intervals",
        "cycles=cycle_ends",
    )

    model: str
    over: str
    of: str
    states: tuple[str, ...]
    values: Vector
    points: Vector
    eigenvalues: Complex
    stable: NDArray[np.bool_]
    words: tuple[Word, ...]
    special: tuple[SpecialEquilibrium, ...]
    places: tuple[int, ...]
    ends: tuple[tuple[str, str], tuple[str, str]]
    intervals: Vector | None = None
    cycles: tuple[Branch, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    how: str = ""

    @property
    def rows(self) -> list[dict[str, Any]]:
        """Value, state, eigenvalues and stability of each point."""
        names = ("value", "state", "eigenvalues", "stable")
        columns = zip(self.values, self.points, self.eigenvalues, self.stable, strict=True)
        return [dict(zip(names, row, strict=True)) for row in columns]

    @property
    def cycle_ends(self) -> list[dict[str, Any]]:
        """The branches of cycles, each with its first and last one."""
        rows: list[dict[str, Any]] = []
        for cycles in self.cycles:
            columns = {"value": cycles.values, "period": cycles.periods, "multipliers": cycles.multipliers}
            first, last = ({name: values[i] for name, values in columns.items()} for i in (0, -1))
            rows.append({**cycles.record(), "first": first, "last": last})
        return rows

    @property
    def interrupted(self) -> bool:
        """Whether the keyboard ended it, or a branch of its cycles, early."""
        return super().interrupted or any(cycles.interrupted for cycles in self.cycles)

    def with_cycles(self, points: int = 2000) -> EquilibriumBranch:
        """The same with the branches of cycles, of so many points at most, that leave at Hopf points and where a pair
        of eigenvalues jumps over the imaginary axis."""
        followed: list[Branch] = []
        for special in self.special:
            if np.isfinite(special.frequency):
                with suppress(StickslipError):  # a pair that jumps need not beget a cycle
                    followed.extend(special.switch(points))  # type: ignore[arg-type]
        return replace(self, cycles=tuple(followed))

    def curves(self, second: str, between: tuple[float, float], points: int = 500) -> tuple[Curve, ...]:
        """Those of its special points that have one, see ``SpecialEquilibrium.curve``.

        Raises:
            StickslipError: there is none, no such parameter, a range that does not hold its present value.
        """
        curves = tuple(special.curve(second, between, points) for special in self.special if special.boundary is None)
        if not curves:
            raise StickslipError(f"There is no special point of {self.model} to follow over '{second}'.")
        return curves

    def _heading(self) -> str:
        if self.intervals is not None:
            return f"Sets of equilibria of {self.model} over {self.over}: {len(self.values)} intervals"
        return f"Equilibria of {self.model} over {self.over}: {len(self.values)} points, {len(self.special)} special"

    def _contents(self) -> Mapping[str, Any]:
        specials = [f"{special.kind} {special.value:.9g}" for special in self.special]
        return {self.over: self.values, "special": specials, "ends": [kind for kind, _ in self.ends]}


def branch_of_ways(
    forward: Way, backward: Way | None, between: tuple[float, float], seconds: float = 0.0
) -> EquilibriumBranch:
    """The branch of one way, or of two from the same begin."""
    nodes, findings, ends = joined(forward, backward)
    eigenvalues = np.array([eigenvalues_of(node) for node in nodes])
    return _branch(
        nodes,
        eigenvalues,
        np.asarray((eigenvalues.real < 0.0).all(axis=1)),
        special=tuple(_special(finding, between, turned) for _, finding, turned in findings),
        places=tuple(count for count, *_ in findings),
        ends=ends,
        seconds=seconds,
    )


def branch_of_sets(
    sets: Sequence[StickingSet], ends: tuple[tuple[str, str], tuple[str, str]], seconds: float
) -> EquilibriumBranch:
    """The branch of intervals of equilibria, in the order of the parameter."""
    nodes = [sticking.middle for sticking in sets]
    eigenvalues = np.array([eigenvalues_of(node) for node in nodes])
    neutral = np.abs(eigenvalues) == np.abs(eigenvalues).min(axis=1, keepdims=True)
    eigenvalues[neutral] = 0.0
    stable = ((eigenvalues.real < 0.0) | neutral).all(axis=1)
    intervals = np.array([sticking.ends[:, :-1] for sticking in sets])
    return _branch(nodes, eigenvalues, stable, special=(), places=(), ends=ends, intervals=intervals, seconds=seconds)


def _branch(nodes: Sequence[Node], eigenvalues: Complex, stable: NDArray[np.bool_], **others: Any) -> EquilibriumBranch:
    """A branch through these points. others: what they do not tell, as its fields."""
    problem = nodes[0].problem
    return EquilibriumBranch(
        model=problem.name,
        over=problem.over,
        of=problem.states[0],
        states=problem.states,
        values=np.array([node.value for node in nodes]),
        points=np.array([node.z[:-1] for node in nodes]),
        eigenvalues=eigenvalues,
        stable=stable,
        words=tuple(node.word for node in nodes),
        units=problem.units,
        how=problem.how(nodes[0].z, nodes[0].seen),
        **others,
    )


def _special(finding: Found, between: tuple[float, float], turned: bool) -> SpecialEquilibrium:
    """What was found, told; turned round, where it was met from the other end of the branch."""
    node, problem = finding.node, finding.node.problem
    assert isinstance(problem, EquilibriumProblem)
    if not isinstance(finding, AtSurface) or finding.boundary is None:
        kind = {"Neimark-Sacker": "Hopf", "branch point": ""}.get(finding.kind, finding.kind) or branch_kind(node)
        state = dict(zip(problem.states, node.z.tolist(), strict=False))
        common: dict[str, Any] = {"node": node, "between": between}
        return SpecialEquilibrium(kind, problem.over, node.value, state, eigenvalues_of(node), **common)
    boundary = finding.boundary
    sides = [problem.eigenvalues(boundary.jacobian), None]
    if boundary.jacobian_after is not None:
        sides[1] = problem.eigenvalues(boundary.jacobian_after)
    before, after = sides[::-1] if turned and sides[1] is not None else sides
    assert before is not None
    return SpecialEquilibrium(
        _kind(boundary),
        problem.over,
        float(boundary.z[-1]),
        dict(zip(problem.states, boundary.z.tolist(), strict=False)),
        before,
        after,
        boundary.crossings,
        boundary.contact,
        boundary.turns,
        node,
        boundary,
        between,
    )


def _kind(boundary: Boundary) -> str:
    """By what crosses the imaginary axis."""
    if boundary.after is None:
        return "end at a surface"
    zeros, pairs = (len(boundary.crossings.get(name, ())) for name in ("zero", "imaginary axis"))
    if zeros + pairs > 1:
        return "multiple crossing"
    return "discontinuous Hopf" if pairs else "discontinuous fold" if zeros else "boundary equilibrium"
