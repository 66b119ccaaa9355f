"""A branch of cycles of a map followed in one direction, over the borders of its rule."""

import numpy as np

from fmu_models.continuation.problem.node import Lost, Node
from fmu_models.continuation.special.border_collision import Collision, collision
from fmu_models.continuation.special.kinds import BORDER_COLLISION
from fmu_models.continuation.step.follow import Follower
from fmu_models.continuation.step.way import Found
from fmu_models.continuation.step.word_change import AHEAD, Ahead


class MapFollower(Follower):
    """Follows cycles: where the word changes a point of one comes to a border."""

    def _change(self, node: Node, step: float, reasons: dict[str, str]) -> Ahead | None:
        rates = [(node.along(miss.gradient), miss) for miss in node.seen.misses]
        near = [(-miss.value / rate, miss) for rate, miss in rates if rate < 0.0 and -miss.value / rate < AHEAD * step]
        for _, miss in sorted(near, key=lambda coming: coming[0]):
            try:
                colliding = collision(node, miss)
            except Lost as error:
                reasons[f"border {miss.contact}"] = str(error)
                continue
            if self.between[0] <= colliding.z[-1] <= self.between[1]:
                return Ahead("border", colliding)
        return None

    def _across(self, node: Node, ahead: Ahead) -> tuple[Node, float] | None:
        touch: Collision = ahead.touch
        if touch.before is not node:
            self._add(touch.before)
        sides = {"before": touch.before, "after": touch.after}
        self.way.meet(Found(BORDER_COLLISION, touch.before, **sides, collision=touch))
        if touch.after is None:
            at = f"'{touch.miss.contact}' at {node.problem.over} = {touch.z[-1]:.9g}"
            self.way.end = "jump", f"a point of the cycle comes to the border {at}, and the rule jumps there"
            return None
        self._add(touch.after)
        return touch.after, float(np.linalg.norm(touch.after.u - touch.z / node.scales))
