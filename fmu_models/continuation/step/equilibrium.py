"""A branch of equilibria followed in one direction, over the switching surfaces that it meets."""

from dataclasses import dataclass

import numpy as np

from fmu_models.continuation.problem.node import Node
from fmu_models.continuation.special.boundary import Boundary, ahead
from fmu_models.continuation.step.follow import Follower
from fmu_models.continuation.step.way import Found
from fmu_models.continuation.step.word_change import AHEAD, Ahead


@dataclass(frozen=True, eq=False)
class AtSurface(Found):
    """Where the branch meets a switching surface."""

    boundary: Boundary | None = None


class EquilibriumFollower(Follower):
    """Follows equilibria: where the word changes there is a switching surface."""

    def _change(self, node: Node, step: float, reasons: dict[str, str]) -> Ahead | None:
        boundary = ahead(node, step, AHEAD)
        if boundary is None or not self.between[0] <= boundary.z[-1] <= self.between[1]:
            return None
        return Ahead("surface", boundary)

    def _across(self, node: Node, ahead: Ahead) -> tuple[Node, float] | None:
        boundary: Boundary = ahead.touch
        if boundary.before is not node:
            self._add(boundary.before)
        self.way.meet(AtSurface("surface", boundary.before, boundary=boundary))
        if boundary.after is None:
            where = f"the switching surface of '{boundary.contact}' at {node.problem.over} = {boundary.z[-1]:.9g}"
            why = f"the equilibrium comes to {where}, and there is none beyond that stands alone"
            self.way.end = "surface", why
            return None
        self._add(boundary.after)
        return boundary.after, float(np.linalg.norm(boundary.after.u - boundary.u))
