"""Which attractor starts come to, and the attractors themselves, which are found on the way.

    find   a few starts, in fixed order, run until they repeat themselves: stable periodic motions, solved to rounding
    map    all starts run until they come to where a known attractor surely attracts, or repeat themselves; what repeats
           itself without being known is solved and becomes an attractor too
    rest   where two halves of a long run that never repeats itself fill the same cells, they are those of an attractor,
           by its exponents chaos, a torus, or not decided (``aperiodic``); a start belongs to the one whose cells hold
           its last points, and clouds that overlap are one. Where chaos does not last its runs go on. What is left is
           undecided

What nothing forces is looked at by steps of its own time, and its cycles each at a section of their own (``unforced``).

Every start is run by itself, so that the result does not depend on who makes which run; unstable motions are no
attractors.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.analyses.attractors import UNDECIDED, claimed, index_of, targets_of
from fmu_models.analyses.clouds import ChaoticTransient, Cloud, Clouds
from fmu_models.analyses.unforced import LONGEST, MOST, SETTLED, Equilibrium, LimitCycle, absorb, settle_flows
from fmu_models.base.arrays import Integers, Vector
from fmu_models.families import jobs as families
from fmu_models.families.execution import Runner
from fmu_models.families.jobs import Jobs
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.strobe import Strobe, strobe_of
from fmu_models.sections.subject import Subject, seen
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.ensemble import Targets
from fmu_models.simulation.rows import RunRows

INFINITE, FAILED = -2, -3  # labels beside UNDECIDED
ENDED = np.full(len(families.OUTCOMES), UNDECIDED)  # by outcome, labels of the runs that end without an attractor
ENDED[[families.ESCAPED, families.LOST, families.BROKEN]] = INFINITE, FAILED, FAILED
UNLABELLED = {UNDECIDED: "undecided", INFINITE: "to infinity", FAILED: "failed"}
COARSE = 64  # starts that look for attractors first

Attractor = PeriodicMotion | Cloud


@dataclass(frozen=True, eq=False)
class Labels:
    """What m starts come to.

    Attributes:
        labels: (m,) indices of attractors; -1 undecided, -2 to infinity, -3 could not be run.
        steps: (m,) of the section until that was decided.
        messages: why a start could not be run, by its number.
    """

    labels: Integers
    steps: Integers
    messages: dict[int, str]


class Labeller:
    """Tell which attractor starts come to; attractors that are not known yet are found.

    Args:
        runner: makes the runs.
        system: whose; at the values of its parameters.
        most: steps after which a motion that has not repeated itself is taken to stay as it is.
        longest: period that is looked for.
        verdicts, lasting: whether sets without a period are judged by their exponents, and whether chaos must last.

    Attributes:
        attractors: found by now, in that order.
        count: starts labelled.
    """

    def __init__(
        self, runner: Runner, system: SectionSystem, most: int = MOST, longest: int = LONGEST,
        *, verdicts: bool = True, lasting: bool = True,
    ) -> None:  # fmt: skip
        self.runner, self.system, self.most, self.longest = runner, system, most, longest
        self.attractors: list[Attractor] = []
        search = {"longest": longest, "settled": SETTLED}
        self._clouds = Clouds(runner, system, self.attractors, most, search, verdicts=verdicts, lasting=lasting)
        self.count = 0
        self._targets: tuple[list[PeriodicMotion], Targets | None] = [], None

    @property
    def transients(self) -> list[ChaoticTransient]:
        """Chaos that did not last, found by now."""
        return self._clouds.transients

    def explore(self, starts: Vector) -> None:
        """Find attractors from starts (m, n), before others are labelled."""
        jobs = Jobs(starts, transient=self.most, rows=2 * self.longest, longest=self.longest, settled=SETTLED)
        self._decide(self.runner.make(jobs, quiet=True))

    def label(self, starts: Vector, *, quiet: bool = True) -> Labels:
        """Label starts (m, n); ``quiet``: without a word of progress."""
        self.count += len(starts)
        labels, steps = np.full(len(starts), UNDECIDED), np.zeros(len(starts), np.int64)
        messages: dict[int, str] = {}
        open_indices, ends = [np.zeros(0, np.int64)], [starts[:0]]
        how = {"transient": self.most, "longest": self.longest, "settled": SETTLED}
        absorb(self.attractors, starts, labels, steps, self.runner.workers, **how)
        mapped = np.flatnonzero(labels == UNDECIDED)
        periodic, targets = self._known()
        known = np.array([*map(self.attractors.index, periodic), UNDECIDED])  # the last one is that of no orbit, -1

        def map_some(first: int, chunk: RunRows) -> None:
            indices = mapped[first : first + len(chunk.filled)]
            labels[indices] = decided = np.where(chunk.orbits >= 0, known[chunk.orbits], ENDED[chunk.outcomes])
            steps[indices] += chunk.steps
            open_ = np.flatnonzero((decided == UNDECIDED) & (chunk.filled > 0))
            open_indices.append(indices[open_])
            ends.append(chunk.only(open_).ends)
            messages.update({int(indices[i]): text for i, text in chunk.messages.items()})

        if mapped.size:
            some = starts[mapped] if mapped.size < len(starts) else starts
            self.runner.each(Jobs(some, targets=targets, **how), map_some, quiet=quiet)
        undecided = np.concatenate(open_indices)

        def settle_some(first: int, chunk: RunRows) -> None:
            indices = undecided[first : first + len(chunk.filled)]
            decided = self._decide(chunk)
            left = self._clouds.assign(chunk, decided)
            if left.size:
                onward = self.runner.make(self._clouds.onward(chunk.ends[left]), quiet=True)
                decided[left] = self._decide(onward)
                steps[indices[left]] += onward.steps
            labels[indices] = decided

        if undecided.size:
            jobs = Jobs(np.concatenate(ends), rows=2 * self.longest, longest=self.longest, settled=SETTLED)
            self.runner.each(jobs, settle_some, quiet=quiet)
        return Labels(labels, steps, messages)

    def word(self, label: int) -> str:
        """What a label stands for; numbered where several attractors are the same in words."""
        if label < 0:
            return UNLABELLED[label]
        words = [attractor.word for attractor in self.attractors]
        return f"{words[label]} ({label + 1})" if words.count(words[label]) > 1 else words[label]

    def _known(self) -> tuple[list[PeriodicMotion], Targets | None]:
        """The motions that are known by their points at the section, and where they surely attract."""
        periodic = _at(self.attractors)
        if periodic != self._targets[0]:
            self._targets = periodic, targets_of(self.system, periodic)
        return self._targets

    def _decide(self, rows: RunRows) -> Integers:
        """Labels of the runs that repeat themselves; motions that are not known yet are added."""
        system, attractors = self.system, self.attractors
        labels = ENDED[rows.outcomes]
        indices = np.flatnonzero((rows.outcomes == families.SETTLED) | (rows.outcomes == families.FINISHED))
        if not indices.size:
            return labels
        claims = claimed(system, rows.only(indices), longest=self.longest)
        for i, motion in zip(indices, claims.motions, strict=True):
            if motion is None:
                continue
            periodic = _at(attractors)
            index = index_of(system, motion, periodic)
            if index < 0:
                attractors.append(Equilibrium(**{**vars(motion), "time": 0.0}) if system.autonomous else motion)
                labels[i] = len(attractors) - 1
            else:
                labels[i] = attractors.index(periodic[index])
        if isinstance(system, Strobe) and system.autonomous:
            settle_flows(system, rows, labels, attractors, self.runner.workers, longest=self.longest, settled=SETTLED)
        return labels


def watched(subject: Subject) -> SectionSystem:
    """The section that labels are told at: of what nothing forces a strobe by steps of its own time.

    Errors as for ``seen``.
    """
    system = seen(subject)
    if isinstance(system, Strobe) and system.unforced and not system.autonomous:  # steps of no meaning to it
        return strobe_of(system)
    return system


def _at(attractors: Sequence[Attractor]) -> list[PeriodicMotion]:
    """The motions that are known by their points at the section, and stable there."""
    periodic = [attractor for attractor in attractors if isinstance(attractor, PeriodicMotion)]
    return [motion for motion in periodic if not isinstance(motion, LimitCycle) and motion.stability.stable]
