"""Edge states: what a motion comes to that stays on the border of two basins.

    bisect   on the segment between two starts that come to different attractors, until they are CLOSE
    follow   both go on until they are APART, and are bisected anew: their middle follows the border
    solve    where it stands or comes back Newton's method, without asking for stability, finds the motion; it is the
             edge state if one multiplier alone lies outside the unit circle, the border that was followed is along its
             other directions, and small pushes to both sides along that one lead to the two attractors

A third attractor that is met on the way takes the place of one of the two. Where two starts 1e-12 apart come apart in
one step, motions are torn there, and the border belongs to no motion that stays on it.

Source: Skufca, Yorke, Eckhardt, Edge of chaos in a parallel shear flow, Physical Review Letters 96 (2006).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import scipy.linalg

from fmu_models.analyses.attractors import UNDECIDED
from fmu_models.analyses.declaration import NO_NUMBERS, WATCHED, Analysis, Numbers, Option
from fmu_models.analyses.labels import FAILED, Labeller, watched
from fmu_models.analyses.unforced import LONGEST, MOST, SPAN, Equilibrium, LimitCycle, Most, rates, section_through
from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.families.execution import Runner
from fmu_models.sections.periodic import PeriodicMotion, least_periods, motion_at, solved_cycles
from fmu_models.sections.stability import ON_CIRCLE
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.subject import Subject
from fmu_models.sections.system import SectionSystem

# in sizes of the states: between which distances a pair of starts is followed, and when motions are torn
CLOSE, APART, TEAR = 1e-6, 1e-3, 1e-12
BESIDE = (0.5, 0.38)  # shares of the segment; the middle may be the edge state itself, which comes to nothing
CROSSED = 16  # doublings of the pair, at most, that bring an end back to its side
NEAR = 3e-2  # by so much Newton's method may move the border, in sizes of the states
ASTRAY = 10.0  # times that, on the way
ALONG = 0.1  # share of that move that may lie along the unstable direction
PUSH = 1e-4  # to both sides of an edge state, in sizes of the states
STRETCH, SAMPLES = 16, 5  # steps of the border along which a cycle is looked for, and samples in each
TURNS = 8  # of a cycle of what nothing forces, at its section, at most
LABELS = 1000
NOWHERE = (UNDECIDED, FAILED)


@dataclass(frozen=True, eq=False)
class Edge:
    """A motion on the border of two basins, one of whose multipliers lies outside the unit circle.

    Attributes:
        motion: solved to rounding: an equilibrium, a cycle, or one of so many steps of the section.
        section: at which.
        outward, normal: (n,) direction in which it is left, in the numbers of a point, and the row that gives the part
            of a difference along that, both at its first point.
    """

    motion: PeriodicMotion
    section: SectionSystem
    outward: Vector
    normal: Vector

    @classmethod
    def of(cls, motion: PeriodicMotion, section: SectionSystem) -> "Edge | None":
        """The edge state that a motion is; None if not one of its multipliers alone lies outside the unit circle."""
        product = np.eye(motion.points.shape[1])
        for derivative in section.step(motion.points).derivatives:
            product = derivative @ product
        eigen: Any = scipy.linalg.eig(product, left=True)
        values, left, vectors = eigen
        outside = np.flatnonzero(np.abs(values) > 1.0 + ON_CIRCLE)
        if len(outside) != 1 or values[outside[0]].imag != 0.0:
            return None
        normal = left[:, outside[0]].real
        outward = vectors[:, outside[0]].real
        outward = outward / np.abs(outward / section.sizes()).max()
        return cls(motion, section, outward, normal / (normal @ outward))


@dataclass(frozen=True, eq=False)
class EdgeState(Pictured):
    """What was found on the border of two basins.

    Attributes:
        model, states: its name, and those of the numbers of a point.
        between: what the starts on both sides come to, in words.
        met: attractors whose labels were told on the way, in words.
        word: what the edge state is; "torn", or "not decided" where it was followed to no end.
        edge: where it is a motion that repeats itself.
        path: (k, n) the border as it was followed.
        labels: starts that were labelled.
        units: of the states.
        how: of ``SectionSystem``.
    """

    COLUMNS: ClassVar = ("{states}=path",)
    RECORD: ClassVar = ("model", "states", "between", "met", "word", "points", "multipliers", "time", "labels", "how")

    model: str
    states: tuple[str, ...]
    between: tuple[str, str]
    met: tuple[str, ...]
    word: str
    edge: Edge | None
    path: Vector
    labels: int
    units: Mapping[str, str] = field(default_factory=dict)
    how: str = ""

    @property
    def points(self) -> Vector:
        """(period, n) of the edge state; the last one of the path where it is no motion that repeats itself."""
        return self.edge.motion.points if self.edge else self.path[-1:]

    @property
    def multipliers(self) -> Complex | None:
        """(n,) of the edge state, largest modulus first."""
        return self.edge.motion.stability.eigenvalues if self.edge else None

    @property
    def time(self) -> float:
        """Its period, in the unit of the system; 0 of an equilibrium."""
        return self.edge.motion.time if self.edge else np.nan

    def _heading(self) -> str:
        return f"Edge state of {self.model} between {self.between[0]} and {self.between[1]}: {self.word}"

    def _contents(self) -> Mapping[str, Any]:
        shown = {name: self.points[:, i] for i, name in enumerate(self.states)}
        return {**shown, "multipliers": self.multipliers, "labels": self.labels, "how": self.how or None}


def edge_state(
    system: Subject,
    start: Mapping[str, float] | None = None,
    *,
    other: Annotated[Numbers, Option("Start on the other side of the border.")] = NO_NUMBERS,
    labels: Annotated[int, Option("Starts to label, at most.", minimum=2)] = LABELS,
    most: Most = MOST,
    longest: int = LONGEST,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> EdgeState:
    """Find the unstable motion on the border of two basins.

    Args:
        system: a map, an oscillator at a section, or a model as it is, where nothing forces it.
        start: on one side; states that are left out have their default.
        other: on the other side; states that are left out are those of ``start``.
        labels: starts that are labelled, at most.
        most, longest: of ``basins``.
        progress: called with the share of the labels that are used up.

    Raises:
        StickslipError: both starts come to one attractor, or one of them to none; unknown states.
    """
    system = watched(system)
    pair = np.array([system.start(start), system.start({**(start or {}), **other})])
    with Runner(system) as runner:
        labeller = Labeller(runner, system, most, longest)
        border = Border(labeller, pair, labels, progress)
        word, edge = border.followed()
    met = tuple(attractor.word for attractor in labeller.attractors)
    names = system.name, tuple(system.states), border.words, met, word, edge, np.array(border.path)
    return EdgeState(*names, labeller.count, system.units(*system.states), system.how)


class Border:
    """The border of two basins, between a pair of starts (2, n) that come to different attractors.

    Args:
        labeller: tells what starts come to.
        pair: on both sides.
        most: labels, at most.
        progress: called with the share of them that are used up.

    Attributes:
        sides: (2,) labels of the pair.
        path: points on the border, one after the other.

    Raises:
        StickslipError: the two come to the same attractor, or one to none.
    """

    def __init__(
        self,
        labeller: Labeller,
        pair: Vector,
        most: int,
        progress: Callable[[float], Any] = lambda fraction: None,
        sides: tuple[int, int] | None = None,
    ) -> None:
        self.labeller, self.system, self.pair, self.most, self.progress = (
            labeller,
            labeller.system,
            pair,
            most,
            progress,
        )
        first, second = (int(label) for label in (labeller.label(pair).labels if sides is None else sides))
        self.sides = first, second
        self.path: list[Vector] = []
        if first == second or first in NOWHERE or second in NOWHERE:
            raise StickslipError(
                f"The starts of {self.system.name} come to '{self.words[0]}' and '{self.words[1]}': no border of two "
                "basins is known to lie between them. Choose starts that come to different attractors; basins shows "
                "them."
            )

    @property
    def words(self) -> tuple[str, str]:
        """What the two sides come to."""
        return self.labeller.word(self.sides[0]), self.labeller.word(self.sides[1])

    def middle(self, share: float = 0.5) -> Vector:
        """(n,) on the border, within the distance of the pair."""
        return self.pair[0] + share * self.system.difference(self.pair[1] - self.pair[0])

    @property
    def distance(self) -> float:
        """Of the pair, in sizes of the states."""
        return self._size(self.pair[1] - self.pair[0])

    def _size(self, difference: Vector) -> float:
        return float(np.abs(self.system.difference(difference) / self.system.sizes()).max())

    def bisect(self, close: float) -> bool:
        """Bring the pair so close; False where the labels are used up before, or the middle comes to nothing."""
        untouched = {0, 1}
        while self.distance > close:
            if self.labeller.count >= self.most or any((self.middle() == end).all() for end in self.pair):
                return False
            self.progress(self.labeller.count / self.most)
            for middle in map(self.middle, BESIDE):
                label = int(self.labeller.label(middle[None]).labels[0])
                if label not in NOWHERE:
                    break
            else:
                return False
            # a third attractor takes the place of the second one
            k = 0 if label == self.sides[0] else 1
            self.pair[k] = middle
            self.sides = (label, self.sides[1]) if k == 0 else (self.sides[0], label)
            untouched.discard(k)
            if self.distance <= close:
                for end in untouched:
                    self._taken_back(end)
                untouched = set()
        return True

    def _taken_back(self, k: int) -> None:
        """Bring an end back to its side, where it lay nearer to the border than rounding and has crossed it since."""
        for _ in range(CROSSED):
            if int(self.labeller.label(self.pair[k][None]).labels[0]) == self.sides[k]:
                return
            self.pair[k] += self.system.difference(self.pair[k] - self.pair[1 - k])

    def followed(self) -> tuple[str, Edge | None]:
        """What the border comes to, in a word, and the edge state."""
        while self.bisect(CLOSE):
            self.path.append(self.middle())
            for edge in self._candidates():
                if self._on_border(edge):
                    return edge.motion.word, edge
            if not self._follow():
                return "torn", None
        self.path.append(self.middle())
        return "not decided", None

    def _follow(self) -> bool:
        """Let the pair go on until it is apart; False where the two are torn from one another in a step."""
        for _ in range(self.labeller.most):
            if self.distance > APART:
                break
            before, distance = self.pair.copy(), self.distance
            self._step()
            if self.distance > APART and self.distance > APART / CLOSE * distance:
                after, self.pair = self.pair, before
                if not self.bisect(TEAR):
                    self.pair = after
                    break
                at, distance = self.middle(), self.distance
                self._step()
                if self.distance > APART / CLOSE * distance and self.distance > APART:
                    self.path.append(at)
                    return False
            self.path.append(self.middle())
        return True

    def _step(self) -> None:
        step = self.system.step(self.pair, derivative=False)
        if step.why:
            raise StickslipError(f"{self.system.name}: the border ends: {next(iter(step.why.values()))}.")
        self.pair = step.points

    def _candidates(self) -> Iterator[Edge]:
        """Edge states that Newton's method finds near the border."""
        if self.system.autonomous:
            guesses = [self.path[-1][None]]
        else:
            periods = range(1, min(len(self.path), self.labeller.longest + 1))
            near = [k for k in periods if self._size(self.path[-1] - self.path[-1 - k]) < NEAR]
            guesses = [np.array(self.path[-k:]) for k in dict.fromkeys([1, *near[:3]])]
        for guess in guesses:
            for edge in self._solved(self.system, guess):
                rest = Equilibrium(**{**vars(edge.motion), "time": 0.0}) if self.system.autonomous else edge.motion
                yield replace(edge, motion=rest)
        if self.system.autonomous and isinstance(self.system, Strobe):
            yield from self._cycles(self.system)

    def _solved(self, system: SectionSystem, guess: Vector) -> Iterator[Edge]:
        """The edge state near points (period, n) at a section."""
        cycles, _ = solved_cycles(system, guess[None], within=ASTRAY * NEAR)
        if not len(cycles) or least_periods(system, cycles, system.sizes())[0] < len(guess):
            return
        moved = system.difference(guess[0] - cycles[0, 0])
        edge = Edge.of(motion_at(system, cycles[0]), system)
        if edge is None or np.abs(system.difference(guess - cycles[0]) / system.sizes()).max() > NEAR:
            return
        size = np.abs(moved / system.sizes()).max()
        if np.abs(edge.normal @ moved) <= ALONG * size + CLOSE:
            yield edge

    def _cycles(self, system: Strobe) -> Iterator[Edge]:
        """Cycles of what nothing forces near the border, at a section of their own."""
        if len(self.path) < STRETCH:
            return
        section, start, reach = section_through(system, *self._stretch(system), SPAN * float(system.periods({}, 1)[0]))
        if section is None:
            return
        guess = [start]
        for _ in range(TURNS):
            for edge in self._solved(section, np.array(guess)):
                cycle = LimitCycle(**vars(edge.motion), section=section, reach=reach)
                yield replace(edge, motion=cycle)
            step = section.step(guess[-1][None], derivative=False)
            if step.why:
                return
            guess.append(step.points[0])

    def _stretch(self, system: Strobe) -> tuple[Vector, Vector]:
        """(k, n) states along the last of the border, and their rates."""
        names, times = system.fmu.states, np.linspace(0.0, float(system.periods({}, 1)[0]), SAMPLES)
        pieces = [system.trajectory(point, times) for point in self.path[-STRETCH:]]
        columns = ([np.concatenate([piece[name] for piece in pieces]) for name in of] for of in (names, rates(names)))
        states, slopes = (np.stack(column, axis=1) for column in columns)
        return states, slopes

    def _on_border(self, edge: Edge) -> bool:
        """Whether pushes to both sides of an edge state lead to the two attractors."""
        if self.labeller.count + 2 > self.most:
            return False
        point = edge.motion.points[0]
        pushed = np.array([point + PUSH * edge.outward, point - PUSH * edge.outward])
        return set(self.labeller.label(pushed).labels.tolist()) == set(self.sides)


def _numbers(result: EdgeState) -> dict[str, float]:
    values = {
        "found": float(result.edge is not None),
        "labels": float(result.labels),
        "period": float(len(result.points)),
    }
    values |= {name: float(value) for name, value in zip(result.states, result.points[0], strict=True)}
    if result.multipliers is not None:
        values |= {"multiplier": float(result.multipliers[0].real), "time": result.time}
    return values


ANALYSIS = Analysis(
    function=edge_state,
    numbers=_numbers,
    results=(
        "`found` (1 where it repeats itself), `<state>` of its first point, `period`, `time`, `multiplier`, the "
        "largest, and `labels`, how many starts were labelled"
    ),
    example="discontinuous_support --forcing omega --set ks=10 --set omega=1.18 --other v=6.5 --figure edge.png",
    label="following the border",
    without=WATCHED,
    page=False,
)
