"""A branch followed in one direction, from a motion to its end.

repeat  step    predict along the tangent, correct at right angles to it; longer or shorter next time
        smooth  what lies between the last two motions (special/smooth.py)
        word    where the step leads into another word, or to no motion at all: which event is lost or comes first, by
                the speeds of events and the least values of misses along the tangent; locate that point
                (discontinuous.py, lost_event.py and detachment.py of special), scan the way back to it once more,
                since folds and flips hide beside it, and go on in the other word, with steps that grow from nothing
until   the parameter leaves its range, the branch is back at its begin, or there is no way on: says why
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.kept import Pieces
from fmu_models.continuation.problem.node import SAME, Lost, Node, look, parameter, tangent_of
from fmu_models.continuation.special import smooth
from fmu_models.continuation.special.detachment import from_other_side
from fmu_models.continuation.special.discontinuous import Touch
from fmu_models.continuation.special.growing_multiplier import sticking_along, why_huge
from fmu_models.continuation.special.homoclinic_end import homoclinic_end
from fmu_models.continuation.special.kinds import BRANCH_POINT, HOMOCLINIC, HOPF, JUMP
from fmu_models.continuation.special.several import is_part
from fmu_models.continuation.special.shrunk_cycle import amplitude, hopf_of
from fmu_models.continuation.step.same_motion import CLOSED, begun_at, between, images
from fmu_models.continuation.step.way import Found, Way
from fmu_models.continuation.step.word_change import Ahead, beyond, next_change
from fmu_models.language.contact_kinds import CHATTERING

# steps, in u: the first, the longest, the shortest but for those that grow from a change of the word; and halvings of
# one, at most
FIRST, LONGEST, SHORTEST, HALVINGS = 0.01, 0.1, 1e-6, 14
STRAIGHT = 0.95  # least cosine between tangents of neighbours
ASIDE = 0.2  # how far a correction may lead, in parts of its step
LARGE = 50.0  # states beyond so many times their scale, or their begin, are on their way to infinity
# so many changes of the word by one event more each, within so little of the range: there are infinitely many
CHAIN, TOGETHER = 5, 1e-5
WARY = 1e-3  # from this step on, in u, a test that may have been zero twice on the way is looked at nearer
PIECE = 16  # motions that are kept at once on the disk, at least
# how far beyond its last motion, in parts of the range, a parameter is tried that may be out of its bounds
BESIDE = 1e-4
HIDDEN, SHORT = 4, 3e-5  # so many short steps in a row that were cut by a change of the word that could not be found


def is_far(node: Node, begin: Node) -> bool:
    """Whether the states of a motion are on their way to infinity."""
    n = len(node.problem.states)
    return bool(np.abs(node.u[:n]).max() > LARGE * max(1.0, float(np.abs(begin.u[:n]).max())))


class Follower:
    """Follows one branch; see the module.

    Args:
        between: range of the parameter.
        begin: the motion that it begins at; its tangent says in which direction.
        points: at most.
        tell: called with every motion.
        pieces: where it is kept, if it is, and what is there already.
    """

    def __init__(
        self,
        begin: Node,
        between: tuple[float, float],
        points: int,
        tell: Callable[[Node], None] = lambda node: None,
        pieces: Pieces | None = None,
    ) -> None:
        self.begin, self.between, self.points, self.tell = begin, sorted(between), points, tell
        self.pieces = pieces or Pieces()
        self.way = Way()
        self.hidden = 0
        self.whole = not begin.repeats(SAME)
        self._kept = (0, 0)

    def follow(self) -> Way:
        """To the end, or to where the keyboard interrupts it."""
        try:
            pace = self._resumed() or self._begun(self.begin)
            if self.way.end[0] == "unfinished":
                self._go_on(*pace)
                self._keep(0.0, False, at_least=0)
        except KeyboardInterrupt:
            self.way.end = ("interrupted", f"what was found until then is kept{self.pieces.where}")
        return self.way

    def _resumed(self) -> tuple[float, bool] | None:
        """The next step after what is kept, and whether steps grow from nothing; None if nothing is."""
        for nodes, findings, *_ in self.pieces.known:
            self.way.nodes += nodes
            self.way.findings += findings
        if not self.pieces.known:
            return None
        self._kept = len(self.way.nodes), len(self.way.findings)
        *_, pace, self.hidden, self.way.end = self.pieces.known[-1]
        return pace

    def _keep(self, step: float, grows: bool, at_least: int = PIECE) -> None:
        """What has been passed since the last piece, if it is so much."""
        nodes, findings = self.way.nodes[self._kept[0] :], self.way.findings[self._kept[1] :]
        if len(nodes) >= at_least:
            self.pieces.put((nodes, findings, (step, grows), self.hidden, self.way.end))
            self._kept = len(self.way.nodes), len(self.way.findings)

    def _begun(self, node: Node) -> tuple[float, bool]:
        """The begin as the first motion; the first step."""
        self._add(node if self._leaves(node) else self._placed(node))
        return FIRST, False

    def _go_on(self, step: float, grows: bool) -> None:
        node = self.way.nodes[-1]
        while self.way.end[0] == "unfinished":
            self._keep(step, grows)
            if len(self.way.nodes) >= self.points:
                self.way.end = "points", f"{self.points} motions were followed; ask for more{why_huge(self.way.nodes)}"
                return
            after = self._stepped(node, step) if grows or step >= SHORTEST else self._cramped(node)
            if isinstance(after, Ahead):
                crossed = self._across(node, after)
                if crossed is None:
                    return
                node, step = crossed
                grows = True
                continue
            if after is None:
                return
            node, used = after
            self._add(node)
            if self.way.end[0] != "unfinished" or self._ended(node):
                return
            quick = node.iterations <= 4
            step = used * (2.0 if grows and quick else 1.4 if quick else 0.8)
            grows = grows and step < FIRST
            step = min(step, LONGEST)
            node = self.way.nodes[-1] = self._placed(node)

    def _add(self, node: Node) -> None:
        self.way.add(node)
        self.tell(node)

    def _placed(self, node: Node) -> Node:
        """At another phase, where an event is near the strobe."""
        moved = node.problem.rephased(node.z, node.seen, node.scales)
        if moved is None:
            return node
        try:
            return begun_at(node, *moved)
        except Lost:
            return node

    def _stepped(self, node: Node, step: float, looks: bool = True) -> tuple[Node, float] | Ahead | None:
        """The next motion of the same word and how far it is, or the change of the word that comes before; None where
        there is neither."""
        reasons: dict[str, str] = {}
        hidden = False
        for _ in range(HALVINGS):
            try:
                after, length = self._corrected(node, step)
                same = after.word == node.word and self._near(node, after, length)
                if same and not self._doubtful(node, after, length):
                    self.hidden = self.hidden + 1 if hidden and reasons and step < SHORT else 0
                    if self.hidden >= HIDDEN and looks:
                        break
                    return after, step
                lost = after.word != node.word
            except Lost:
                lost = True
            if lost and looks:
                ahead = self._change(node, step, reasons)
                if ahead is not None:
                    return ahead
                hidden = True
            step /= 2
        if looks:
            self._stuck(node, reasons)
        return None

    def _cramped(self, node: Node) -> Ahead | None:
        """The change of the word towards which steps become too short, if it is seen."""
        reasons = {"steps": "they become too short"}
        ahead = self._change(node, SHORT, reasons)
        if ahead is None:
            self._stuck(node, reasons)
        return ahead

    def _stuck(self, node: Node, reasons: dict[str, str]) -> None:
        at = f"{node.problem.over} = {node.value:.9g}"
        chattering = [contact for contact, _, after in node.word if after == CHATTERING]
        homoclinic = homoclinic_end(self.way.nodes)
        refused, sticks = self._refused(node), sticking_along(node)
        if refused:
            self.way.end = ("bounds", f"beyond {at} there is no such model: {refused}")
        elif homoclinic is not None:
            z = np.append(node.z[:-1], homoclinic.value)
            self.way.meet(Found(HOMOCLINIC, replace(node, z=z)))
            coordinates = zip(node.problem.states, homoclinic.point.tolist(), strict=True)
            saddle = ", ".join(f"{name} = {value:.6g}" for name, value in coordinates)
            why = f"the period is without end at {node.problem.over} = {homoclinic.value:.12g}"
            self.way.end = "homoclinic", f"{why}: the cycle comes to the saddle {saddle}, and stays ever longer near it"
        elif chattering:
            reason = f"'{chattering[0]}' comes to rest after infinitely many impacts"
            self.way.end = "chatter", f"no motion in which {reason} follows at {at}"
        elif sticks:
            why = "motions beside it are as good, none stands alone, and a multiplier is 1"
            self.way.end = "set", f"'{sticks}' sticks wherever it is at {at}: {why}"
        else:
            explanation = "; ".join(f"{name}: {why}" for name, why in list(reasons.items())[:3])
            explanation = f"it{f' ({explanation})' if explanation else ''}{why_huge(self.way.nodes)}"
            why = f"no motion of the same events follows at {at}, and no change of them explains {explanation}"
            self.way.end = "unresolved", why

    def _refused(self, node: Node) -> str:
        """Why the parameter cannot go on, whatever the motion is; "" if it can."""
        refusals = []
        for candidate in (node, self.begin):
            z = candidate.z.copy()
            z[-1] = node.value + BESIDE * np.sign(node.tangent[-1]) * node.scales[-1]
            try:
                candidate.problem.see(z)
                return ""
            except StickslipError as error:
                refusals.append(str(error))
        return refusals[0] if refusals[0] == refusals[1] else ""

    def _corrected(self, node: Node, step: float) -> tuple[Node, float]:
        """The motion a step ahead, or at the end of the range, and how long the step became."""
        low, high = self.between
        guess = node.u + step * node.tangent
        reached = guess[-1] * node.scales[-1]
        if low <= reached <= high:
            after = node.corrected(guess, node.arclength(step), near=True)
            if low <= after.value <= high:
                return after, step
            reached = after.value  # a curved branch left the range where its tangent did not
        value = min(max(reached, low), high)
        step = (value - node.value) / (node.tangent[-1] * node.scales[-1])
        guess = node.u + step * node.tangent
        return node.corrected(guess, parameter(value), near=True), step

    def _near(self, node: Node, after: Node, step: float) -> bool:
        """Whether the branch has hardly turned on the way."""
        turned = after.tangent @ node.tangent
        if step > FIRST and after.tests[BRANCH_POINT] * node.tests[BRANCH_POINT] < 0.0:
            return False  # a short step does not change over to the branch that crosses there
        return bool(turned > STRAIGHT and np.linalg.norm(after.u - node.u - step * node.tangent) < ASIDE * step)

    def _repeats(self, node: Node) -> bool:
        """Whether a motion is one of half the period, on a branch that began with another one."""
        half = len(node.seen.word) // 2
        return self.whole and node.seen.word[:half] == node.seen.word[half:] and node.repeats(SAME)

    def _doubtful(self, node: Node, after: Node, step: float) -> bool:
        """Whether a step has led over to another branch, or past two zeros of a test."""
        if self._repeats(after):
            return True
        nodes = self.way.nodes
        if step <= WARY or len(nodes) < 2 or node is not nodes[-1]:
            return False
        past = nodes[-2]
        return past.word == node.word and past.problem is node.problem and smooth.hides(past, node, after)

    def _leaves(self, node: Node) -> bool:
        """Whether it begins at the end of the range, outward."""
        return node.tangent[-1] * (node.value - sum(self.between) / 2) > 0.0 and self._at_bound(node)

    def _at_bound(self, node: Node) -> bool:
        low, high = self.between
        if min(abs(node.value - low), abs(node.value - high)) > 1e-12 * (high - low):
            return False
        self.way.end = ("range", f"{node.problem.over} = {node.value:g} is the end of its range")
        return True

    def _ended(self, node: Node) -> bool:
        if self._at_bound(node):
            return True
        if is_far(node, self.begin):
            self.way.end = ("infinity", f"the states grow without end towards {node.problem.over} = {node.value:.6g}")
            return True
        return self._shrunk(node) or self._closed(node)

    def _shrunk(self, node: Node) -> bool:
        """Whether the cycle is about to become an equilibrium."""
        before = self.way.nodes[-2]
        grows = before.problem is node.problem and amplitude(node) >= amplitude(before)
        hopf = None if grows else hopf_of(node)
        if hopf is None:
            return False
        self.way.meet(Found(HOPF, hopf))
        self.way.end = "equilibrium", f"the cycle shrinks to the equilibrium at {node.problem.over} = {hopf.value:.9g}"
        return True

    def _closed(self, node: Node) -> bool:
        """Whether the last step has passed the begin."""
        nodes = self.way.nodes
        if len(nodes) < 8 or node.word != self.begin.word or node.problem is not nodes[-2].problem:
            return False
        before = nodes[-2]
        begins = images(self.begin, node)
        z = next((candidate for candidate in begins if between(before, node, candidate / node.scales)), None)
        seen = None if z is None else look(node.problem, z)
        if z is None or seen is None:
            return False
        self.way.nodes[-1] = replace(node, z=z, seen=seen, tangent=tangent_of(seen, node.scales, node.tangent))
        self.way.end = ("closed", "the branch is back at its begin")
        return True

    def _change(self, node: Node, step: float, reasons: dict[str, str]) -> Ahead | None:
        """The next change of the word, if it is seen to come; why not goes to ``reasons``."""
        return next_change(node, step, self.between, reasons)

    def _across(self, node: Node, ahead: Ahead) -> tuple[Node, float] | None:
        """Over a change of the word: a motion beyond it, and the first step from there; None at an end."""
        kind, touch = ahead.kind, ahead.touch
        if kind == "event":
            self._rescan(node, touch)
            if self.way.end[0] != "unfinished":  # the parent of a doubled branch comes before
                return None
            after = touch.node.turned() if touch.node.along(touch.miss.gradient) < 0.0 else touch.node
            before = touch.event_side[0]
        else:
            for passed in touch.trail or (touch.node,):
                self._add(passed)
            before = touch.node
            try:
                after, touch = beyond(kind, touch)
            except Lost as error:
                self.way.meet(Found(JUMP, touch.node, touch, touch.node))
                name = touch.miss.contact
                reason = f"what follows an event of '{name}' and the one before it depends on which comes first"
                reason = reason if kind == "tie" else f"the motion begins to touch '{name}' there"
                self.way.end = ("jump", f"{reason}: {error}")
                return None
        opposite = from_other_side(touch, after) if kind == "begin" else None
        self.way.meet(Found("change", touch.node, touch, before, after, opposite))
        distance = max(float(np.linalg.norm(after.u - touch.u)), 1e-7)
        if self._closed_at(touch):
            return None
        if kind == "event" and is_part(touch, before):
            self.way.end = "parent", "several events come at once there: it has come to the motion without any of them"
            return None
        if self._repeats(after):
            self.way.end = ("parent", "the motion is that of half its period: it has come to the branch of its parent")
            return None
        for passed in reversed(opposite.trail if opposite else ()):
            self._add(passed.turned())
        self._add(after)
        return None if self._accumulates(touch) else (after, distance)

    def _accumulates(self, touch: Touch) -> bool:
        """Whether one event after the other is added at values of the parameter that come together."""
        touches = [finding.touch for _, finding in self.way.findings if finding.touch is not None][-CHAIN:]
        lengths = [len(touch.node.word) for touch in touches]
        values = [float(member.u[-1]) for member in touches]
        if len(touches) < CHAIN or not all(np.diff(lengths) > 0) or np.ptp(values) > TOGETHER:
            return False
        towards = f"{touch.node.problem.over} = {touch.z[-1]:.9g}: beyond lies a motion with infinitely many"
        self.way.end = "chatter", f"impacts of '{touch.miss.contact}' are added without end towards {towards}"
        return True

    def _closed_at(self, touch: Touch) -> bool:
        """Whether the same point has been passed before."""
        for _, finding in self.way.findings[:-1]:
            if finding.touch is None or finding.touch.miss.contact != touch.miss.contact:
                continue
            if abs(finding.touch.u[-1] - touch.u[-1]) < 1e-8 and finding.node.word == touch.node.word:
                begins = images(finding.touch.node, touch.node)
                distances = [np.abs(z / touch.node.scales - touch.node.u).max() for z in begins]
                if min(distances) < CLOSED:
                    self.way.findings.pop()
                    self.way.end = ("closed", "the branch is back at a point that it has passed")
                    return True
        return False

    def _rescan(self, node: Node, touch: Touch) -> None:
        """The last piece of the way to an event that is lost, from that point back and in steps that grow."""
        nodes, step, at = [touch.event_side[0]], 1e-7, touch.event_side[0]
        step = max(step, float(np.linalg.norm(at.u - touch.u)))
        length = float(np.linalg.norm(node.u - touch.u))
        while True:
            following = self._stepped(at, step, looks=False)
            if not isinstance(following, tuple) or np.linalg.norm(following[0].u - touch.u) >= length:
                break
            at, step = following[0], min(2.0 * following[1], LONGEST)
            nodes.append(at)
        for candidate in reversed(nodes):
            if self.way.end[0] == "unfinished":
                self._add(candidate.turned())
