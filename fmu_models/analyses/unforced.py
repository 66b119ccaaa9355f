"""Attractors of a flow that nothing forces: equilibria, and cycles, each at a section of its own.

    seen      at a step of its own time (``Strobe`` without a period)
    rest      what a long run repeats at every step: an equilibrium, solved to rounding; attracting by its eigenvalues
    cycle     the motion that a long run has come to is sampled; where it moves fastest, in standard deviations, the
              level of the fastest state is the section. What returns to it is solved to rounding there: turns, period,
              multipliers
    which     a start comes to a cycle where its motion comes, at that section, to where the cycle surely attracts
    mirrored  two attractors are mirror images where changes of sign that steps do not notice bring one onto the other

A cycle that passes its own section without a least number of turns that was looked for stays a set (``Cloud``).
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np

from fmu_models.analyses.attractors import UNDECIDED, claimed, targets_of
from fmu_models.analyses.declaration import Option
from fmu_models.base.arrays import Complex, Integers, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.families.execution import Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.sections.crossing import Crossing
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.point import PATIENCE
from fmu_models.sections.stability import ON_CIRCLE, Stability
from fmu_models.sections.strobe import Strobe, strobe_of
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.ensemble import Targets
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.rows import RunRows

MOST, LONGEST, SETTLED = 3000, 64, 1e-10  # steps of a transient, period looked for, relative distance of equal points
Most = Annotated[int, Option("Steps after which a motion is taken to stay as it is.", minimum=1)]
# steps of the strobe over which a cycle is sampled, how finely, how often four times as many are tried until it comes
# back: relaxation cycles creep most of their time
SPAN, SAMPLES, LONGER = 1024, 4097, 5
FEW = 8  # starts that are followed until they repeat a cycle
PATIENT = 4.0  # spans in which a motion comes back to its section
OFTEN = 64  # times in a period
SAME = 1e-6  # of the size of a state: two equilibria, or a step and its mirror image, that are nearer are one


@dataclass(frozen=True, eq=False)
class Equilibrium(PeriodicMotion):
    """A point of rest, or, with a multiplier 1, one of many that attract together, as those of a stick.

    Attributes:
        points: (1, n).
        stability: of a step of the strobe: exp(eigenvalue times step).
    """

    RECORD: ClassVar = ("word", "points")

    @property
    def alone(self) -> bool:
        """Whether there are no others beside it."""
        return self.stability.hyperbolic

    @property
    def word(self) -> str:
        return "equilibrium" if self.alone else "equilibria side by side"

    def holds(self, points: Vector) -> bool:
        """Whether points (k, n) of an attractor are its own."""
        return bool(np.abs(points - self.points).max() < SAME)


@dataclass(frozen=True, eq=False)
class LimitCycle(PeriodicMotion):
    """A cycle of a flow.

    Attributes:
        points: (turns, n) where it meets its section.
        stability: multipliers, but for the 1 along the motion.
        time: the period, s.
        section: its own.
        reach: in sizes of the states, how far the motion goes from its mean, about.
    """

    RECORD: ClassVar = ("word", "time", "multipliers", "points")

    section: Crossing = None  # type: ignore[assignment] # behind fields that have defaults
    reach: float = 1.0

    @property
    def word(self) -> str:
        return f"cycle of {self.time:.6g} s"

    @property
    def multipliers(self) -> Complex:
        """(n - 1,) largest modulus first."""
        return self.stability.eigenvalues

    @cached_property
    def targets(self) -> Targets | None:
        """Where it surely attracts."""
        return targets_of(self.section, [self], self.reach)

    def farthest(self, point: Vector, times: int) -> float:
        """How far from a point (n,) its motion is within a period, in sizes, at so many times up to the whole of it."""
        states = self.section.fmu.states
        motion = self.section.trajectory(point, np.linspace(0.0, self.time, times + 1))
        moved = np.stack([motion[name][1:] - motion[name][0] for name in states], axis=1)
        return float(np.abs(moved / self.section.sizes()[: len(states)]).max())

    def holds(self, points: Vector) -> bool:
        """Whether points (k, n) of an attractor are its own."""
        return bool(self.absorbs(points[:1], 1, longest=LONGEST, settled=SETTLED).all())

    def absorbs(
        self, starts: Vector, workers: int | None, *, longest: int, settled: float, transient: int | None = None
    ) -> Integers:
        """(m,) turns after which starts (m, n) have surely come to it; 0 if they have not.

        transient: turns that are waited for; the others as of ``Jobs``.
        """
        runner = Runner(self.section, execution=Execution(workers=workers))
        search = {"longest": longest, "settled": settled, "transient": transient or 4 * self.period}
        if len(starts) > FEW:  # else it costs more to know where it attracts
            rows = runner.make(Jobs(starts, targets=self.targets, **search), quiet=True)
            return np.where(rows.orbits == 0, np.maximum(rows.steps, 1), 0)
        rows = runner.make(Jobs(starts, rows=2 * longest, **search), quiet=True)
        away = np.abs(self.section.difference(rows.points[:, :1] - self.points)) / self.section.sizes()
        came = (rows.periods > 0) & (away.max(axis=2).min(axis=1) < SAME)
        return np.where(came, np.maximum(rows.steps, 1), 0)


def limit_cycle(system: Strobe, point: Vector, **search: Any) -> LimitCycle | None:
    """The stable cycle that the motion from a point (n,) is on, nearly; None if it returns to no point of itself.

    search: ``longest`` and ``settled`` of ``Jobs``.
    """
    names, span = system.fmu.states, SPAN * float(system.periods({}, 1)[0])
    for longer in range(LONGER):
        motion = system.trajectory(point, np.linspace(0.0, 4.0**longer * span, SAMPLES))
        states, slopes = (np.stack([motion[n] for n in of], axis=1) for of in (names, rates(names)))
        section, start, reach = section_through(system, states, slopes, 4.0**longer * span)
        if section is None:
            return None
        rows = section.make(Jobs(start[None], rows=2 * search["longest"], **search), workers=1)
        if rows.filled[0] > 0:
            (motion,) = claimed(section, rows, longest=search["longest"]).motions
            cycle = None if motion is None else LimitCycle(**vars(motion), section=section, reach=reach)
            # what goes nowhere in its period is the rounding of an equilibrium
            return None if cycle is None or cycle.farthest(cycle.points[0], OFTEN) <= SAME else cycle
    return None


def section_through(
    system: Strobe, states: Vector, slopes: Vector, span: float
) -> tuple[Crossing | None, Vector, float]:
    """The level where a motion moves fastest, the point there, and the largest size of the motion.

    Args:
        states, slopes: (k, n) along it, and their rates.
        span: s, that they are taken over.
    """
    sizes = system.sizes()[: states.shape[1]]
    size = states.std(axis=0)
    speeds = np.abs(slopes) / np.where(size > SAME * sizes, size, np.inf)
    k, i = np.unravel_index(speeds.argmax(), speeds.shape)
    if not speeds[k, i] > 0.0:
        return None, states[k], 0.0
    settings = {"parameters": system.values, "tolerance": system.tolerance, "wait": PATIENT * span / PATIENCE}
    level, direction = float(states[k, i]), int(np.sign(slopes[k, i]))
    section = Crossing(system.fmu, system.fmu.states[i], level, direction, **settings)
    return section, section.start(states[k]), float((size / sizes).max())


def at_maxima(system: Strobe, state: str) -> Crossing:
    """The section where a state of what nothing forces is largest: its rate, another state or a multiple, falls to 0.

    Raises:
        StickslipError: the state drifts, or its rate is no other state.
    """
    names = system.fmu.states
    field, i = VectorField(system.fmu, system.values), names.index(state)
    beside = system.start(None)[: len(names)] + SAME * np.array([system.fmu.size_of(name) for name in names])
    row, rate = field.slopes(beside, ())[i], field.at(beside)
    (others,) = np.nonzero(row)
    drifts = state in system.fmu.cyclic
    if drifts or len(others) != 1 or others[0] == i or rate.rates[i] != row[others[0]] * rate.states[others[0]]:
        reason = f"'{state}' drifts" if drifts else f"the rate of '{state}' is no other state"
        raise StickslipError(
            f"Nothing forces '{system.name}', and {reason}, so that its maxima are no section. Name a state that comes "
            "back and whose rate is another one (--of, of=), or a section (--level STATE=VALUE, --impacts CONTACT)."
        )
    wait = PATIENT * SPAN * float(system.periods({}, 1)[0]) / PATIENCE
    settings = {"parameters": system.values, "tolerance": system.tolerance, "wait": wait}
    return Crossing(system.fmu, system.fmu.states[others[0]], 0.0, -int(np.sign(row[others[0]])), **settings)


def rates(states: Sequence[str]) -> list[str]:
    """Names of the rates of states."""
    return [f"der({name})" for name in states]


def at_its_cycle(
    system: SectionSystem, start: Mapping[str, float] | Sequence[float] | None
) -> tuple[SectionSystem, Mapping[str, float] | Sequence[float] | None]:
    """A strobe by the period of the cycle that its start comes to, and a point of that, where none was given.

    Raises:
        StickslipError: it comes to no cycle.
    """
    if not (isinstance(system, Strobe) and system.estimated):
        return system, start
    settled = system.make(Jobs(system.start(start)[None], transient=MOST), workers=1)
    cycle = limit_cycle(system, settled.ends[0], longest=LONGEST, settled=SETTLED)
    if cycle is None:
        raise StickslipError(
            f"'{system.name}' comes to no cycle from that start, so that it needs a period: give about how long it is "
            "(--period with --autonomous, period= with autonomous=True), or start elsewhere."
        )
    return strobe_of(system, period=cycle.time, autonomous=True), cycle.points[0].tolist()


def absorb(
    attractors: Sequence[Any], starts: Vector, labels: Integers, steps: Integers, workers: int, **jobs: Any
) -> None:
    """Label the starts (m, n) without a label that come to the cycles among attractors, and add their turns to steps.

    jobs: of ``Jobs``.
    """
    for number, cycle in enumerate(attractors):
        if isinstance(cycle, LimitCycle) and (labels == UNDECIDED).any():
            remaining = np.flatnonzero(labels == UNDECIDED)
            turns = cycle.absorbs(starts[remaining], workers, **jobs)
            labels[remaining[turns > 0]] = number
            steps[remaining] += turns


def settle_flows(
    system: Strobe, rows: RunRows, labels: Integers, attractors: list[Any], workers: int, **search: Any
) -> None:
    """Label the runs that have come to equilibria side by side or to cycles; those that are not known are added.

    search: ``longest`` and ``settled`` of ``Jobs``.
    """
    steps = np.zeros(len(labels), np.int64)
    absorb(attractors, rows.ends, labels, steps, workers, **search)
    for i in np.flatnonzero(labels == UNDECIDED):
        if labels[i] != UNDECIDED:  # another one's cycle by now
            continue
        rests = rows.periods[i] == 1
        motion = resting(system, rows.ends[i]) if rests else limit_cycle(system, rows.ends[i], **search)
        if motion is None:
            continue
        beside = [k for k, known in enumerate(attractors) if _same(known, motion)]
        labels[i] = beside[0] if beside else len(attractors)
        if not beside:
            attractors.append(motion)
            absorb(attractors, rows.ends, labels, steps, workers, **search)


def _same(known: Any, motion: Equilibrium | LimitCycle) -> bool:
    """Whether an attractor is this motion; equilibria side by side are one."""
    if isinstance(motion, Equilibrium):
        return known.word == motion.word
    if not isinstance(known, LimitCycle) or abs(known.time - motion.time) > SAME * motion.time:
        return False
    return known.holds(motion.points)


def resting(system: Strobe, point: Vector) -> Equilibrium | None:
    """The equilibrium at a point (n,) that steps repeat; None if it does not attract."""
    derivative = system.step(point[None]).derivatives[0]
    if not np.isfinite(derivative).all():  # where rates have a corner
        return None
    stability = Stability.of(derivative)
    return Equilibrium(point[None], stability, 0.0) if abs(stability.eigenvalues[0]) < 1.0 + ON_CIRCLE else None


def mirror_images(system: Strobe, attractors: Sequence[Any]) -> tuple[tuple[int, int], ...]:
    """Pairs of attractors that are images of one another by changes of sign of states, of eight of them at most."""
    numbered = itertools.combinations(range(len(attractors)), 2)
    pairs = [(i, j) for i, j in numbered if type(attractors[i]) is type(attractors[j])]
    if not pairs:
        return ()
    points = np.array([attractor.points[0] for attractor in attractors])
    after = system.step(points, derivative=False).points
    mirrored: set[tuple[int, int]] = set()
    for signs in map(np.array, itertools.islice(itertools.product((1.0, -1.0), repeat=points.shape[1]), 1, 256)):
        images = system.step(signs * points, derivative=False).points
        if (np.abs(images - signs * after) <= SAME * system.sizes()).all():
            mirrored |= {(i, j) for i, j in pairs if attractors[j].holds(signs * attractors[i].points)}
    return tuple(sorted(mirrored))
