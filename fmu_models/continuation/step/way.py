"""What has been passed on a branch: motions, and specials between them."""

from __future__ import annotations

from dataclasses import dataclass, field

from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.special import smooth
from fmu_models.continuation.special.discontinuous import Touch, repeats
from fmu_models.continuation.special.kinds import BRANCH_POINT


@dataclass(frozen=True, eq=False)
class Found:
    """Something special on the way: its kind, the motion there, and, where the word changes, the point, the motions on
    both sides, and the point as it was found from the other one, if it was; of an FMU of others the contact alone."""

    kind: str
    node: Node
    touch: Touch | None = None
    before: Node | None = None
    after: Node | None = None
    other: Touch | None = None
    contact: str = ""


@dataclass(eq=False)
class Way:
    """What has been passed so far.

    Attributes:
        nodes: motions, in order; found: specials, each with the number of motions before it.
        end: kind of the end and a sentence on it.
    """

    nodes: list[Node] = field(default_factory=list)
    found: list[tuple[int, Found]] = field(default_factory=list)
    end: tuple[str, str] = ("unfinished", "it was stopped")

    def add(self, node: Node) -> None:
        """A motion, and what lies between it and the one before."""
        if self.nodes and self.nodes[-1].word == node.word and self.nodes[-1].problem is node.problem:
            for kind, special in smooth.between(self.nodes[-1], node):
                self.found.append((len(self.nodes), Found(kind, special)))
                if kind == BRANCH_POINT and repeats(special):
                    self.end = ("flip", "the motion is that of half its period: it has come to the flip of its parent")
                    self.nodes.append(special)
                    return
        self.nodes.append(node)
