"""What all that is followed over a parameter has: two ends, each with a reason; and what all branches have."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fmu_models.base.arrays import Flags
from fmu_models.base.shown import Pictured
from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.problem.problem import Vector, Word
from fmu_models.continuation.special.point import SpecialPoint
from fmu_models.continuation.step.way import Ends

ROUNDING = 1e-12  # of the range of the parameter: by so much an end misses that of the range


@dataclass(frozen=True, eq=False, kw_only=True)
class Ended(Pictured):
    """A branch or a curve: m points of n states.

    Attributes:
        model, over: Names of the model and of the parameter.
        states: Names.
        values: (m,) of the parameter.
        points: (m, n) states; of motions at phase 0 of the forcing, where nothing forces them somewhere on them.
        ends: Kind and a sentence, of both ends.
        units: Of states and of parameters.
    """

    model: str
    over: str
    states: tuple[str, ...]
    values: Vector
    points: Vector
    ends: Ends
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def named_ends(self) -> list[dict[str, str]]:
        """``ends`` with names."""
        return [{"kind": kind, "why": why} for kind, why in self.ends]

    @property
    def interrupted(self) -> bool:
        """Whether the keyboard ended it early."""
        return any(kind == "interrupted" for kind, _ in self.ends)


@dataclass(frozen=True, eq=False, kw_only=True)
class SolutionBranch(Ended):
    """Solutions over one parameter.

    Attributes:
        stable: (m,).
        words: Of each point: events of a motion; (contact, state, state) of all contacts of an equilibrium.
        special: What was met, in order.
        places: (len(special),) number of points before each.
        seconds: CPU time.
        how: Where points come from and how near they are, where that is not a matter of course.
    """

    stable: Flags
    words: tuple[Word, ...]
    special: tuple[SpecialPoint, ...]
    places: tuple[int, ...]
    seconds: float = 0.0
    how: str = ""

    def segments_at(self, value: float) -> list[int]:
        """Between which neighbours it has a value of the parameter, by the number of the first; each point once."""
        away = self.values - value
        away[np.abs(away) <= ROUNDING * np.ptp(self.values)] = 0.0
        crossed = (away[:-1] <= 0.0) != (away[1:] <= 0.0)
        crossed[-1:] |= away[-1] == 0.0 != away[0]
        return np.flatnonzero(crossed).tolist()

    def _contents(self) -> Mapping[str, Any]:
        specials = [f"{special.kind} {special.value:.9g}" for special in self.special]
        return {self.over: self.values, "special": specials, "ends": [kind for kind, _ in self.ends]}


def seen_on(nodes: Sequence[Node]) -> dict[str, Any]:
    """What the nodes of a branch tell of it, as its fields."""
    problem = nodes[0].problem
    return {
        **{"model": problem.name, "over": problem.over, "states": problem.states, "units": problem.units},
        "values": np.array([node.value for node in nodes]),
        "points": np.array([node.state_at(0.0) for node in nodes]),
        "words": tuple(node.word for node in nodes),
        "how": problem.how(nodes[0].z, nodes[0].seen),
    }
