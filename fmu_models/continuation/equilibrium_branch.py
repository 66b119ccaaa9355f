"""Branches of equilibria, and what is met on them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.continuation.born_cycle import cycles_from_boundary, cycles_from_hopf
from fmu_models.continuation.branch import Branch, follower_of
from fmu_models.continuation.curves.curve import Curve, CurvePoint
from fmu_models.continuation.curves.trace import curve_of
from fmu_models.continuation.ended import SolutionBranch, seen_on
from fmu_models.continuation.leaving import beside_branch_point
from fmu_models.continuation.problem.equilibrium import eigenvalues_of, equilibrium_problem
from fmu_models.continuation.problem.problem import Vector
from fmu_models.continuation.special import kinds
from fmu_models.continuation.special.boundary import Boundary
from fmu_models.continuation.special.point import SpecialPoint
from fmu_models.continuation.special.special import branch_kind
from fmu_models.continuation.special.sticking_set import StickingSet
from fmu_models.continuation.step.equilibrium import AtSurface
from fmu_models.continuation.step.way import Ends, Found, Ways, joined

EIGENVALUES = "eigenvalues"  # what a picture may show beside a state
# what a meeting of motions is where they are equilibria
MEETINGS = {
    **{"1:1 resonance": "Bogdanov-Takens", "fold-Neimark-Sacker": "fold-Hopf"},
    **{"pitchfork-Neimark-Sacker": "pitchfork-Hopf"},
}


@dataclass(frozen=True, eq=False, kw_only=True)
class SpecialEquilibrium(SpecialPoint):
    """An equilibrium at which something happens.

    Attributes:
        kind: "fold", "Hopf", "pitchfork", "branch point", or a name of the module where the branch meets a surface.
        eigenvalues: (n,) by falling real part, before the surface; 1/s.
        eigenvalues_after: (n,) beyond the surface; None at smooth points and where nothing goes on.
        crossings: shares q of J+ at which one of the set of eigenvalues is "zero", a pair on the "imaginary axis", or
            a pair "double" on the real line. J+ is the side on which the state of the contact is the larger number (1
            above 0 above -1).
        turns: two equilibria meet at the surface, and there is none beyond its value.
    """

    RECORD: ClassVar = (
        *("kind", "criticality", "normal_form", "value", "state", "eigenvalues", "eigenvalues_after", "frequency"),
        *("contact", "turns", "crossings=crossing_points"),
    )

    eigenvalues: Complex
    eigenvalues_after: Complex | None = None
    turns: bool = False
    boundary: Boundary | None = field(default=None, repr=False)

    @cached_property
    def frequency(self) -> float:
        """Of the pair on the imaginary axis, rad/s; nan where there is none."""
        if self.kind == kinds.HOPF:
            return float(np.abs(self.eigenvalues[np.abs(self.eigenvalues.real).argmin()].imag))
        return float(np.abs(self.path(self.crossings["imaginary axis"]).imag).max()) if self._pairs else np.nan

    @property
    def _pairs(self) -> bool:
        return "imaginary axis" in self.crossings

    @property
    def crossing_points(self) -> dict[str, list[dict[str, Any]]]:
        """``crossings`` with the eigenvalues at each share."""
        return {
            name: [{"q": q, "eigenvalues": self.path([q])[0]} for q in shares]
            for name, shares in self.crossings.items()
        }

    def path(self, q: Sequence[float] | Vector) -> Complex:
        """(m, n) eigenvalues of (1 - q) J- + q J+ at shares (m,). StickslipError: the point is not at a surface that an
        equilibrium is on both sides of."""
        if self.boundary is None:
            raise StickslipError(f"The {self.place} is at no switching surface.")
        return self.boundary.path(np.asarray(q, dtype=float))

    def switch(self, points: int = 2000) -> tuple[Branch | EquilibriumBranch, ...]:
        """The branches that leave here, over the range of this one: cycles from a Hopf point or a discontinuous one,
        equilibria from a pitchfork or branch point. StickslipError: none leaves at a point of this kind, or none was
        found."""
        branches: tuple[Branch | EquilibriumBranch, ...] = ()
        if self.kind == kinds.HOPF:
            branches = cycles_from_hopf(self.node, self.frequency, self.between, points)
        elif self.boundary is not None and self._pairs:
            branches = cycles_from_boundary(self.boundary, self.frequency, self.between, points)
        elif self.kind in (kinds.PITCHFORK, kinds.BRANCH_POINT):
            followed = (follower_of(node, self.between, points).follow() for node in beside_branch_point(self.node))
            branches = tuple(branch_of_ways((forward, None), self.between) for forward in followed)
        if not branches:
            raise StickslipError(
                f"No branch was found that leaves at the {self.place}: cycles leave at Hopf points and discontinuous "
                "ones, equilibria at pitchforks and branch points."
            )
        return branches

    def curve(self, second: str, between: tuple[float, float] | None = None, points: int = 500) -> Curve:
        """The point as a curve in two parameters, as ``Special.curve``; its multipliers are eigenvalues, and its
        periods those of a Hopf point. StickslipError: a point at a switching surface, no such parameter, a range that
        does not hold its present value, or one that the parameter takes apart."""
        if self.boundary is not None:
            raise StickslipError(f"A {self.kind} has no curve: folds, Hopf points, pitchforks and branch points have.")
        return _still(curve_of(self.kind, self.node, None, second, between, self.between, points))

    def _contents(self) -> dict[str, object]:
        spectra = {"eigenvalues": self.eigenvalues, "beyond": self.eigenvalues_after}
        return self._told({"criticality": self.criticality or None, **spectra})


@dataclass(frozen=True, eq=False, kw_only=True)
class EquilibriumBranch(SolutionBranch):
    """Of m equilibria, n states.

    Attributes:
        of: what a picture shows: a state, or "eigenvalues" for their path in the complex plane.
        eigenvalues: (m, n) by falling real part, 1/s; minus infinity across what sticks.
        intervals: (m, 2, n) where a contact sticks the equilibria beside one are as good: the first and the last one of
            each set, where the contact begins to slip, within 1e-10 of its capacity. The points are their middles, and
            one eigenvalue is zero, along the set. None where equilibria stand alone.
        cycles: those that leave at its special points, once they were followed.
    """

    COLUMNS: ClassVar = (
        *("{over}=values", "{states}=points", "{states}_from=intervals.0", "{states}_to=intervals.1", "stable"),
        "eigenvalue{}=eigenvalues",
    )
    RECORD: ClassVar = (
        *("model", "over", "states", "ends=named_ends", "points=rows", "special", "intervals", "cycles=cycle_ends"),
    )

    of: str
    eigenvalues: Complex
    special: tuple[SpecialEquilibrium, ...]
    intervals: Vector | None = None
    cycles: tuple[Branch, ...] = ()

    @property
    def spanned(self) -> Spanned | None:
        """The parameter and the state that is drawn; a path of eigenvalues has no place to begin from."""
        return None if self.of == EIGENVALUES else Spanned(self.over, self.of, (self.over,), self.states)

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
        """Those of its special points that have one, see ``SpecialEquilibrium.curve``. StickslipError: there is none,
        no such parameter, a range that does not hold its present value."""
        curves = tuple(special.curve(second, between, points) for special in self.special if special.boundary is None)
        if not curves:
            raise StickslipError(f"There is no special point of {self.model} to follow over '{second}'.")
        return curves

    def _heading(self) -> str:
        if self.intervals is not None:
            return f"Sets of equilibria of {self.model} over {self.over}: {len(self.values)} intervals"
        return f"Equilibria of {self.model} over {self.over}: {len(self.values)} points, {len(self.special)} special"


def branch_of_ways(directions: Ways, between: tuple[float, float], seconds: float = 0.0) -> EquilibriumBranch:
    """The branch of one way, or of two from the same begin."""
    nodes, findings, ends = joined(*directions)
    eigenvalues = np.array([eigenvalues_of(node) for node in nodes])
    return EquilibriumBranch(
        **seen_on(nodes),
        of=nodes[0].problem.states[0],
        eigenvalues=eigenvalues,
        stable=np.asarray((eigenvalues.real < 0.0).all(axis=1)),
        special=tuple(_special(finding, between, turned) for _, finding, turned in findings),
        places=tuple(count for count, *_ in findings),
        ends=ends,
        seconds=seconds,
    )


def branch_of_sets(sets: Sequence[StickingSet], ends: Ends, seconds: float) -> EquilibriumBranch:
    """The branch of intervals of equilibria, in the order of the parameter."""
    nodes = [sticking.middle for sticking in sets]
    eigenvalues = np.array([eigenvalues_of(node) for node in nodes])
    neutral = np.abs(eigenvalues) == np.abs(eigenvalues).min(axis=1, keepdims=True)
    eigenvalues[neutral] = 0.0
    return EquilibriumBranch(
        **seen_on(nodes),
        of=nodes[0].problem.states[0],
        eigenvalues=eigenvalues,
        stable=((eigenvalues.real < 0.0) | neutral).all(axis=1),
        special=(),
        places=(),
        ends=ends,
        intervals=np.array([sticking.ends[:, :-1] for sticking in sets]),
        seconds=seconds,
    )


def _special(finding: Found, between: tuple[float, float], turned: bool) -> SpecialEquilibrium:
    """The special point of a finding; turned round, where it was met from the other end of the branch."""
    node, problem = finding.node, equilibrium_problem(finding.node)
    boundary = finding.boundary if isinstance(finding, AtSurface) else None
    z = node.z if boundary is None else boundary.z
    values: dict[str, Any] = {"parameter": problem.over, "value": float(z[-1]), "node": node, "between": between}
    values["state"] = dict(zip(problem.states, z.tolist(), strict=False))
    if boundary is None:
        kind = kinds.HOPF if finding.kind == kinds.NEIMARK_SACKER else finding.kind
        kind = branch_kind(node) if kind == kinds.BRANCH_POINT else kind
        return SpecialEquilibrium(kind=kind, eigenvalues=eigenvalues_of(node), **values)
    before, after = problem.eigenvalues(boundary.jacobian), None
    if boundary.jacobian_after is not None:
        sides = before, problem.eigenvalues(boundary.jacobian_after)
        before, after = reversed(sides) if turned else sides
    return SpecialEquilibrium(
        kind=_kind(boundary),
        eigenvalues=before,
        eigenvalues_after=after,
        boundary=boundary,
        **{name: getattr(boundary, name) for name in ("crossings", "contact", "turns")},
        **values,
    )


def _kind(boundary: Boundary) -> str:
    """By what crosses the imaginary axis."""
    if boundary.after is None:
        return kinds.SURFACE_END
    zeros, pairs = (len(boundary.crossings.get(name, ())) for name in ("zero", "imaginary axis"))
    if zeros + pairs > 1:
        return kinds.MULTIPLE_CROSSING
    return kinds.DISCONTINUOUS_HOPF if pairs else kinds.DISCONTINUOUS_FOLD if zeros else kinds.BOUNDARY_EQUILIBRIUM


def _still(curve: Curve) -> Curve:
    """The same with eigenvalues for multipliers, and the periods of small cycles at Hopf points."""
    spectra = np.array([eigenvalues_of(node) for node in curve.nodes])
    periods = np.array([_period(eigenvalues) if curve.kind == kinds.HOPF else np.nan for eigenvalues in spectra])
    meetings = tuple(_still_meeting(meeting, curve) for meeting in curve.meetings)
    return replace(curve, multipliers=spectra, called="eigenvalues", periods=periods, meetings=meetings)


def _still_meeting(point: CurvePoint, curve: Curve) -> CurvePoint:
    with np.errstate(divide="ignore"):
        eigenvalues: Any = np.log(point.multipliers) / point.period
    period = _period(eigenvalues) if curve.kind == kinds.HOPF else np.nan
    return replace(point, kind=MEETINGS.get(point.kind, point.kind), multipliers=eigenvalues, period=period)


def _period(eigenvalues: Complex) -> float:
    """Of the pair that is nearest to the imaginary axis, s."""
    with np.errstate(divide="ignore"):
        return float(2.0 * np.pi / np.abs(eigenvalues[np.abs(eigenvalues.real).argmin()].imag))
