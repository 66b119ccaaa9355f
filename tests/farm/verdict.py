"""Whether two tables show the same motion, and what follows for an FMU.

Two values of a variable agree within

    SHARE * size + ROUNDING * greatest value + twice what fmpy's runs of two tolerances differ by near that row

where size is the largest of its range in both tables, its stated nominal value, and UNIT of the largest range of all
variables of the same unit: what is zero but for rounding is judged by its like. Where both tools make the same steps of
Co-Simulation without inputs, SAME stands for SHARE. Where a motion is chaotic, fmpy's two runs part, and nothing is
judged any more. Around a jump each table gives a tube: by Model Exchange all rows within 1e-6 of the run, so that a
jump 1e-9 apart is no difference while a wrong level is one at the next row; by Co-Simulation, and in files of others,
where jumps are known to a step only, both ends of the step that has the jump.

A run is wrong where it differs from fmpy's by the same interface, unless the reference, or a Co-Simulation that both
tools find alike, sides with it against fmpy; an FMU is where no run of ours agrees with its reference, whose interface
the folder may name ("me", "cs") and nobody else does. Of a third-party FMU the two interfaces may differ, as its own
solver does what it likes: it is said, and is wrong only beyond LOOSE, where no other tool has confirmed either. Those
of an FMU of ours may not. Where an FMU ends its run, its last row may be of either side of the event that did.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from fmu_models.base.child_process import IsolatedFailure
from fmu_models.base.errors import StickslipError
from tests.farm.runs import CS, ENGINE, FMPY, JOBS, ME, OURS, Run

SHARE, SAME, LOOSE, ROUNDING, UNIT = 1e-5, 1e-9, 2e-2, 1e-9, 1e-3
STEEP = 10.0  # times the changes in the steps beside it: such a step has a jump
NEAR = 5  # rows
PASS, REFUSED, WRONG, CRASHED, TIMED_OUT = "pass", "refused", "wrong", "crashed", "timed out"
SEVERITY = (PASS, REFUSED, TIMED_OUT, WRONG, CRASHED)
Outcome = Run | None | Exception


@dataclass(frozen=True)
class Tube:
    """A table to compare, its rows taken within ``side`` (s), jumps within their step if ``stepped``."""

    table: pd.DataFrame
    side: float
    stepped: bool

    def at(self, name: str, times: np.ndarray, discrete: bool) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest value (n,) of a variable around ``times`` (n,)."""
        time, value = self.table.iloc[:, 0].to_numpy(), self.table[name].to_numpy()
        edges = (value, value) if not self.stepped else _over_jumps(value, discrete)
        low, high = (np.interp(times, time, edge) for edge in edges)
        first, last = np.searchsorted(time, times - self.side), np.searchsorted(time, times + self.side, "right")
        for offset in range(int((last - first).max(initial=0))):
            row = np.minimum(first + offset, np.maximum(last - 1, 0))
            inside = first + offset < last
            low = np.where(inside, np.minimum(low, edges[0][row]), low)
            high = np.where(inside, np.maximum(high, edges[1][row]), high)
        return low, high


def _over_jumps(value: np.ndarray, discrete: bool) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest value at each row, with the one beyond a step that has a jump."""
    change = np.abs(np.diff(value))
    beside = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    jumps = change > 0 if discrete else (change > STEEP * beside) & (change > UNIT * np.ptp(value))
    low, high = value.copy(), value.copy()
    for edge, extreme in ((low, np.minimum), (high, np.maximum)):
        beyond = extreme(value[:-1], value[1:])
        edge[:-1] = np.where(jumps, beyond, edge[:-1])
        edge[1:] = np.where(jumps, extreme(edge[1:], beyond), edge[1:])
    return low, high


def gap(first: Tube, second: Tube, name: str, times: np.ndarray, discrete: bool) -> np.ndarray:
    """(n,) by how much the tubes of a variable miss each other; inf where one alone is no number."""
    with np.errstate(invalid="ignore"):
        (low, high), (least, most) = (tube.at(name, times, discrete) for tube in (first, second))
        off = np.maximum(0.0, np.maximum(low - most, least - high))
    finite = np.isfinite(low + high), np.isfinite(least + most)
    return np.where(finite[0] & finite[1], off, np.where(finite[0] == finite[1], 0.0, np.inf))


@dataclass(frozen=True)
class Difference:
    """Of a variable: by how many tolerances it differs at most, and where it is beyond them first, s, with the values
    of ours and of the judge."""

    variable: str
    worst: float
    time: float = float("nan")
    ours: float = float("nan")
    judge: float = float("nan")

    def __str__(self) -> str:
        return f"'{self.variable}' at t = {self.time:.9g} s: {self.ours:.9g} for {self.judge:.9g}"


@dataclass(frozen=True)
class Comparison:
    """A run of ours beside that of a judge ("fmpy", "reference", an interface), variable by variable."""

    interface: str
    judge: str
    differences: tuple[Difference, ...]

    @property
    def first(self) -> Difference | None:
        """The difference that begins first; None: they agree."""
        return min((d for d in self.differences if d.worst > 1), key=lambda d: d.time, default=None)


def compare(ours: Run, judge: Tube, interface: str, label: str, share: float, fmpy: Run | None = None) -> Comparison:
    """Our run and another one, at the rows of the latter; ``fmpy``: its runs, which say how sensitive the motion is."""
    mine = Tube(ours.table, ours.experiment.side, interface == CS)
    asked = ours.experiment
    times = np.unique(judge.table.iloc[:, 0].to_numpy()) if judge.stepped else asked.grid
    ends = [float(table.iloc[-1, 0]) for table in (ours.table, judge.table)]
    last = min(ends) - (mine.side if min(ends) < asked.stop - mine.side else -mine.side)
    times = times[(times >= asked.start) & (times <= last)]
    names = [name for name in ours.table.columns[1:] if name in judge.table.columns]
    ranges = {n: max(np.ptp(t[n].to_numpy()) for t in (ours.table, judge.table)) for n in names}
    units, sizes = ours.units or {}, ours.sizes or {}
    differences = []
    if min(ends[1], asked.stop) - ends[0] > 1.5 * asked.step or (
        label != "reference" and ends[0] - ends[1] > 1.5 * asked.step
    ):
        differences.append(Difference("the end", np.inf, min(ends), *ends))
    if times.size == 0:
        return Comparison(interface, label, tuple(differences))
    for name in names:
        discrete = name in ours.discrete
        like = max(ranges[n] for n in names if units.get(n) == units.get(name))
        size = max(ranges[name], sizes.get(name, 0.0), UNIT * like)
        greatest = np.abs(judge.table[name].to_numpy()).max(initial=0.0)
        tolerance = np.full(times.shape, share * size + ROUNDING * greatest + 1e-12)
        if fmpy is not None and fmpy.coarse is not None:
            fine, coarse = (Tube(table, mine.side, False) for table in (fmpy.table, fmpy.coarse))
            own = gap(fine, coarse, name, times, discrete)
            tolerance += 2 * pd.Series(own).rolling(2 * NEAR + 1, center=True, min_periods=1).max().to_numpy()
        ratio = gap(mine, judge, name, times, discrete) / tolerance
        k = int(np.argmax(ratio > 1)) if (ratio > 1).any() else int(np.argmax(ratio))
        values = (np.interp(times[k], t.iloc[:, 0], t[name]) for t in (ours.table, judge.table))
        differences.append(Difference(name, float(ratio.max()), float(times[k]), *map(float, values)))
    return Comparison(interface, label, tuple(differences))


@dataclass
class Verdict:
    """Of an FMU: the word, why, what else is worth saying, and the comparisons it rests on."""

    path: Path
    heading: str = ""
    word: str = PASS
    reason: str = ""
    interfaces: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    comparisons: list[Comparison] = field(default_factory=list)

    def worsen(self, word: str, reason: str) -> None:
        """The worst word counts, with the first reason for it."""
        if SEVERITY.index(word) > SEVERITY.index(self.word):
            self.word, self.reason = word, reason


def judged(path: Path, outcomes: Mapping[tuple[str, str], Outcome]) -> Verdict:
    """The verdict from the outcomes of the jobs."""
    verdict = Verdict(path)
    runs = {job: outcome for job, outcome in outcomes.items() if isinstance(outcome, Run)}
    for run in runs.values():
        verdict.heading = verdict.heading or run.heading
    verdict.interfaces = [i for i in (ME, CS) if any(outcomes.get((tool, i)) is not None for tool in (OURS, FMPY))]
    confirmed = {i: _beside_fmpy(verdict, runs, i) for i in (ME, CS) if (OURS, i) in runs}
    _beside_reference(verdict, runs, confirmed)
    _interfaces(verdict, runs, confirmed)
    for tool, interface in JOBS:
        failure = outcomes.get((tool, interface))
        if isinstance(failure, Exception):
            _failed(verdict, tool, interface, failure, confirmed)
    if not verdict.interfaces:
        verdict.worsen(REFUSED, "it has neither Model Exchange nor Co-Simulation")
    return verdict


def _failed(verdict: Verdict, tool: str, interface: str, failure: Exception, confirmed: Mapping[str, bool]) -> None:
    """A run that did not come back, or was refused; fmpy's are remarks where another judge stands."""
    timed = isinstance(failure, IsolatedFailure) and failure.cause == "time"
    word = REFUSED if isinstance(failure, StickslipError) and not isinstance(failure, IsolatedFailure) else CRASHED
    text = f"{interface} by {tool}: {' '.join(str(failure).split())[-300:]}"
    if tool != FMPY:
        verdict.worsen(TIMED_OUT if timed else word, text)
    elif interface in confirmed and not confirmed[interface]:
        verdict.worsen(REFUSED, text)
    verdict.remarks.append(f"{TIMED_OUT if timed else word}: {text}")


def _beside_fmpy(verdict: Verdict, runs: Mapping[tuple[str, str], Run], interface: str) -> bool:
    """Whether fmpy confirms our run by an interface."""
    ours, theirs = runs[OURS, interface], runs.get((FMPY, interface))
    if theirs is None:
        return False
    side, stepped = ours.experiment.side, interface == CS
    share = SAME if stepped and ours.experiment.inputs is None else SHARE
    comparison = compare(ours, Tube(theirs.table, side, stepped), interface, FMPY, share, theirs)
    verdict.comparisons.append(comparison)
    if comparison.first is None:
        return True
    for label, witness in _witnesses(runs, interface):
        with_ours, with_theirs = (compare(run, witness, interface, label, SHARE).first for run in (ours, theirs))
        if with_ours is None and with_theirs is not None:
            verdict.remarks.append(f"{interface}: the {label} sides with ours against fmpy, {comparison.first}")
            return True
    verdict.worsen(WRONG, f"{interface}, ours for fmpy's: {comparison.first}")
    return False


def _witnesses(runs: Mapping[tuple[str, str], Run], interface: str) -> Iterator[tuple[str, Tube]]:
    """What can side with ours against fmpy: the reference; of Model Exchange, a Co-Simulation that both find alike."""
    ours = runs[OURS, interface]
    if ours.experiment.reference is not None:
        yield "reference", Tube(ours.experiment.reference, ours.experiment.side, True)
    if interface == ME and (OURS, CS) in runs and (FMPY, CS) in runs:
        judge = Tube(runs[FMPY, CS].table, ours.experiment.side, True)
        if compare(runs[OURS, CS], judge, CS, "", SHARE).first is None:
            yield CS, judge


def _beside_reference(verdict: Verdict, runs: Mapping[tuple[str, str], Run], confirmed: dict[str, bool]) -> None:
    named = {"me": ME, "cs": CS}
    stated = {named[part] for part in verdict.path.parts if part in named}
    comparisons = []
    for interface in (ME, CS):
        ours = runs.get((OURS, interface))
        if ours is None or ours.experiment.reference is None or (stated and interface not in stated):
            continue
        judge = Tube(ours.experiment.reference, ours.experiment.side, True)
        comparisons.append(compare(ours, judge, interface, "reference", 10 * SHARE))
    agreeing = [c.interface for c in comparisons if c.first is None and c.differences]
    verdict.comparisons += comparisons
    confirmed |= dict.fromkeys(agreeing, True)
    differing = [c for c in comparisons if c.first is not None]
    if differing and not agreeing:
        nearest = min(differing, key=lambda c: max(d.worst for d in c.differences))
        verdict.worsen(WRONG, f"{nearest.interface}, ours for the reference: {nearest.first}")
    verdict.remarks += [f"{c.interface} is not what made the reference: {c.first}" for c in differing if agreeing]


def _interfaces(verdict: Verdict, runs: Mapping[tuple[str, str], Run], confirmed: dict[str, bool]) -> None:
    """Model Exchange beside Co-Simulation, and beside the engine inside an FMU of ours."""
    exchange = runs.get((OURS, ME))
    engine, co = runs.get((ENGINE, ME)), runs.get((OURS, CS))
    if exchange is None:
        return
    own = exchange.heading.partition(", ")[2].startswith("stickslip ")
    for label, second in (("engine", engine), (CS, co)):
        if second is None:
            continue
        judge = Tube(second.table, second.experiment.side, label == CS)
        strict = compare(exchange, judge, ME, label, SHARE, runs.get((FMPY, ME)) if own else None)
        verdict.comparisons.append(strict)
        if strict.first is None:
            confirmed |= dict.fromkeys((ME,) if label == "engine" else (ME, CS), True)
        elif own:
            verdict.worsen(WRONG, f"{ME} for {label}: {strict.first}")
        elif not any(confirmed.values()) and (loose := compare(exchange, judge, ME, label, LOOSE).first):
            verdict.worsen(WRONG, f"{ME} for {label}: {loose}")
        else:
            verdict.remarks.append(f"{ME} and {label} differ: {strict.first}")
