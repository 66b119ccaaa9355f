"""What has been passed on a branch or a curve: motions, and specials between them."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.special import smooth
from fmu_models.continuation.special.border_collision import Collision
from fmu_models.continuation.special.discontinuous import Touch
from fmu_models.continuation.special.kinds import BRANCH_POINT


@dataclass(frozen=True, eq=False)
class Found:
    """Something special on the way: its kind, the motion there, and, where the word changes, the point, the motions on
    both sides, and the point as it was found from the other one, if it was; of an FMU of others the contact alone; of a
    map its collision with a border."""

    kind: str
    node: Node
    touch: Touch | None = None
    before: Node | None = None
    after: Node | None = None
    other: Touch | None = None
    contact: str = ""
    collision: Collision | None = None


@dataclass(eq=False)
class Way:
    """What has been passed so far.

    Attributes:
        nodes: motions, in order; findings: specials, each with the number of motions before it.
        end: kind of the end and a sentence on it.
    """

    nodes: list[Node] = field(default_factory=list)
    findings: list[tuple[int, Found]] = field(default_factory=list)
    end: tuple[str, str] = ("unfinished", "it was stopped")

    @property
    def complete(self) -> bool:
        """Whether there is nothing to follow from its begin the other way."""
        return self.end[0] in ("closed", "interrupted")

    def meet(self, finding: Found) -> None:
        """A special behind the last motion."""
        self.findings.append((len(self.nodes), finding))

    def add(self, node: Node) -> None:
        """A motion, and what lies between it and the one before."""
        changed = bool(self.findings) and self.findings[-1][0] == len(self.nodes)
        smooth_piece = bool(self.nodes) and not changed and self.nodes[-1].word == node.word
        if smooth_piece and self.nodes[-1].problem is node.problem:
            for kind, special in smooth.between(self.nodes[-1], node):
                self.meet(Found(kind, special))
                if kind == BRANCH_POINT and special.repeats():
                    self.end = ("flip", "the motion is that of half its period: it has come to the flip of its parent")
                    self.nodes.append(special)
                    return
        self.nodes.append(node)


Ways = tuple[Way, Way | None]
Ends = tuple[tuple[str, str], tuple[str, str]]


def ways(start: Node, follow: Callable[[Node], Way]) -> Ways:
    """From a start forward and, unless that comes back to it or is interrupted, backward."""
    forward = follow(start)
    return forward, None if forward.complete else follow(start.turned())


def joined(forward: Way, backward: Way | None) -> tuple[list[Node], list[tuple[int, Found, bool]], Ends]:
    """One way, or two from the same begin, as a whole: motions, what was found (number of motions before it, whether it
    was met the other way round), both ends."""
    nodes = list(forward.nodes)
    findings = [(count, finding, False) for count, finding in forward.findings]
    first = forward.end if forward.complete else ("start", "where it leaves another branch")
    if backward is not None:
        first, k = backward.end, len(backward.nodes)
        nodes = [node.turned() for node in reversed(backward.nodes[1:])] + nodes
        turned = [
            (k - count, replace(finding, before=finding.after, after=finding.before), True)
            for count, finding in backward.findings
        ]
        findings = list(reversed(turned)) + [(count + k - 1, finding, False) for count, finding, _ in findings]
    return nodes, findings, (first, forward.end)
