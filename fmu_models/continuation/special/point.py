"""What all special points of a branch have, of motions and of equilibria."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from fmu_models.base.shown import Shown
from fmu_models.continuation.normal_forms.cubic import UNKNOWN, Coefficient, coefficient, criticality
from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.special.kinds import HOPF, kind_of


@dataclass(frozen=True, eq=False, kw_only=True)
class SpecialPoint(Shown):
    """A motion or an equilibrium at which something happens.

    Attributes:
        kind: One of ``kinds.KINDS``.
        parameter, value: Name and value of the parameter.
        state: By name.
        crossings: Shares q at which the set of multipliers or eigenvalues passes something, by what it passes.
        contact: Whose event comes or goes, or whose surface it is.
        between: Range of the parameter on the branch.
    """

    kind: str
    parameter: str
    value: float
    state: Mapping[str, float]
    crossings: Mapping[str, Sequence[float]] = field(default_factory=dict)
    contact: str = ""
    node: Node = field(repr=False)
    between: tuple[float, float] = (-float("inf"), float("inf"))

    @cached_property
    def _cubic(self) -> Coefficient:
        has_form = kind_of(self.kind).supercritical and (self.kind == HOPF) == self.node.problem.still
        return coefficient(self.kind, self.node) if has_form else UNKNOWN

    @property
    def normal_form(self) -> float:
        """The cubic coefficient of a flip, pitchfork or Neimark-Sacker point of a forced motion, the first Lyapunov
        coefficient of a Hopf point of equilibria, see normal_forms/cubic.py; nan elsewhere."""
        return self._cubic.value

    @property
    def criticality(self) -> str:
        """ "supercritical" or "subcritical", by the normal form; "degenerate or undecided" where that is not above its
        error, "" where it is not known."""
        return criticality(self.kind, self._cubic)

    def _told(self, details: Mapping[str, object]) -> dict[str, object]:
        """What is shown of it."""
        ends = {"contact": self.contact or None, "crossings": dict(self.crossings) or None}
        return {"kind": self.kind, self.parameter: self.value, **details, **ends}

    @property
    def place(self) -> str:
        """It in words, with its value."""
        return f"{self.kind} at {self.parameter} = {self.value:.9g}"
