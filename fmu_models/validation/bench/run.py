"""Every method at every tolerance on one problem: error, events, cost.

Times are those of the call that a user of a method makes, medians over rounds. In a round every row is run once, each
right after a run of the first method, so that what disturbs the machine disturbs both: their ratio is the median of the
ratios of the pairs. What a method does once (opening, compiling) is outside the times. Memory is the peak of what
Python's allocator, numpy's arrays included, hands out in one further run; compiled code that allocates for itself is
not seen. Events are paired with those of the reference: which are missing, and how far off the others are.
"""

import math
import signal
import statistics
import threading
import time
import tracemalloc
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from fmu_models.validation.bench.reference import TRUST, Parted, ReferenceSolution, reference
from fmu_models.validation.methods.catalogue import OURS
from fmu_models.validation.methods.result import (
    OPEN,
    RELEASED,
    Method,
    MethodProblem,
    MethodRun,
    NotInstalled,
    NotTreated,
    SwitchEvent,
)

ROUNDS = 15
LONGEST = 4.0  # s of one run, after which it is given up, with the method's tighter tolerances
REPEATING = 12.0  # s of all rounds, as the first runs let expect
# s from the begin, after which no further first run, timed run or run for memory is begun: a scene stays below 60 s
FIRST_UNTIL, TIMED_UNTIL, TRACED_UNTIL = 32.0, 44.0, 52.0
TRACED = 0.5  # s: longer runs are not made again for their memory
EVENTS = 300  # of a longer run only the part with so many is compared
CUTS = 3  # to a quarter, of a run that no two codes end alike
# of the distance to the nearest other event of the contact: a find further away is another event
REACH = 0.5


@dataclass(frozen=True)
class EventErrors:
    """expected: events of the reference; missed: those without a counterpart; extra: finds without one.

    time: s, largest distance of a pair, None without pairs.
    """

    expected: int
    missed: int
    extra: int
    time: float | None


@dataclass(frozen=True)
class MethodRow:
    """One method at one tolerance.

    Attributes:
        error: of the end state, in nominal values of the states.
        ranked: the error is beyond doubt of the reference.
        events: against those of the reference; None if the method reports none.
        evaluations: right-hand sides, None if unknown.
        seconds, spread: median of the wall time and distance of its quartiles, s.
        ratio: median of the times in those of the first method, pair by pair; None if only run once.
        runs: number of timed runs.
        memory: bytes, None if not measured.
    """

    method: str
    family: str
    tolerance: float
    error: float
    ranked: bool
    events: EventErrors | None
    evaluations: int | None
    seconds: float
    spread: float
    ratio: float | None
    runs: int
    memory: int | None


@dataclass(frozen=True)
class Refusal:
    """A method, or one tolerance of it, without a result, and why."""

    method: str
    why: str


@dataclass(frozen=True, eq=False)
class MethodComparison:
    """All rows of a problem.

    Attributes:
        asked_time: end of the run that was asked for, s; ``stop_time`` is earlier where that is too long to compare.
        reference: sentence that says what errors are measured against.
        own_error: of the reference, in nominal values.
        expected: number of events, None if the reference has none.
        interrupted: not everything was run.
        seconds: wall time of everything, s.
    """

    name: str
    title: str
    stop_time: float
    asked_time: float
    states: tuple[str, ...]
    reference: str
    own_error: float
    expected: int | None
    rows: tuple[MethodRow, ...]
    refusals: tuple[Refusal, ...]
    interrupted: bool
    seconds: float

    @property
    def shortened(self) -> str:
        """A sentence if only the begin of the run is compared, else nothing."""
        if self.stop_time == self.asked_time:
            return ""
        return (
            f"Shortened: the first {self.stop_time:g} s of {self.asked_time:g} s are compared, {EVENTS} events at most "
            "and not beyond where different codes part."
        )


@dataclass(eq=False)
class _Entry:
    method: Method
    tolerance: float
    make: Callable[[float], MethodRun]
    first: MethodRun
    times: list[float]
    ratios: list[float]
    memory: int | None = None


def compare(
    problem: MethodProblem, methods: Sequence[Method], progress: Callable[[float], None] = lambda _: None
) -> MethodComparison:
    """Run everything; an interrupt from the keyboard ends it early and keeps what there is. StickslipError: there is no
    reference. KeyboardInterrupt: before there is one."""
    started = time.monotonic()
    requested = problem.stop_time
    problem, solution = _comparable(problem, lambda: progress(min(0.3, (time.monotonic() - started) / 60.0)))
    entries: list[_Entry] = []
    refusals: list[Refusal] = []
    interrupted = False
    try:
        for entry in _first_runs(problem, methods, refusals, started + FIRST_UNTIL, lambda f: progress(0.3 + 0.35 * f)):
            entries.append(entry)
        _rounds(entries, started + TIMED_UNTIL, lambda f: progress(0.65 + 0.25 * f))
        for i, entry in enumerate(entries):
            entry.memory = _memory(entry) if time.monotonic() < started + TRACED_UNTIL else None
            progress(0.9 + 0.1 * (i + 1) / len(entries))
    except KeyboardInterrupt:
        interrupted = True
    entries.sort(key=lambda entry: methods.index(entry.method))
    rows = [_row(entry, solution, problem) for entry in entries]
    expected = None if solution.switches is None else sum(s.matters for s in solution.switches)
    return MethodComparison(
        problem.name, problem.title, problem.stop_time, requested, problem.states,
        solution.sentence, solution.own_error(), expected, tuple(rows), tuple(refusals),
        interrupted, time.monotonic() - started,
    )  # fmt: skip


def _comparable(problem: MethodProblem, tick: Callable[[], None]) -> tuple[MethodProblem, ReferenceSolution]:
    """The problem and its reference; of a chaotic run a quarter, until codes agree."""
    events = list(OURS.prepare(problem)(OURS.tolerances[0]).switches or ())
    if len(events) > EVENTS:
        problem = replace(problem, stop_time=(events[EVENTS - 1].time + events[EVENTS].time) / 2)
    for _ in range(CUTS):
        try:
            return problem, reference(problem, tick)
        except Parted:
            problem = replace(problem, stop_time=problem.stop_time / 4)
    return problem, reference(problem, tick)


def _first_runs(
    problem: MethodProblem,
    methods: Sequence[Method],
    refusals: list[Refusal],
    until: float,
    progress: Callable[[float], None],
) -> Iterator[_Entry]:
    """One run per row, which also warms up: every method at its loosest tolerance first, then at the next."""
    ready: dict[Method, Callable[[float], MethodRun]] = {}
    for method in methods:
        try:
            ready[method] = method.prepare(problem)
        except (NotTreated, NotInstalled) as error:
            refusals.append(Refusal(method.name, str(error)))
    total = sum(len(method.tolerances) for method in ready)
    done = 0
    for k in range(max((len(method.tolerances) for method in ready), default=0)):
        for method in [m for m in ready if k < len(m.tolerances)]:
            tolerance = method.tolerances[k]
            done += 1
            progress(done / total)
            if time.monotonic() > until:
                refusals.append(Refusal(f"{method.name}, {tolerance:g}", "not run: the time was used up"))
                continue
            try:
                with _limit(LONGEST):
                    first = ready[method](tolerance)
            except (NotTreated, TimeoutError) as error:
                refusals.append(Refusal(f"{method.name}, {tolerance:g}", str(error)))
                if isinstance(error, TimeoutError):
                    del ready[method]
            else:
                yield _Entry(method, tolerance, ready[method], first, [], [])


def _rounds(entries: Sequence[_Entry], until: float, progress: Callable[[float], None]) -> None:
    """Timed runs in turn, each after one of the first method."""
    base = next((e for e in entries if e.method.name == OURS.name), entries[0] if entries else None)
    share = REPEATING / max(1, len(entries))
    for i in range(ROUNDS):
        for entry in entries:
            # a row that is dear has had its share after fewer rounds, or after its first run
            enough = i >= share / entry.first.seconds + (entry.first.seconds < TRACED)
            if base is None or enough or time.monotonic() > until:
                continue
            paired = base.make(base.tolerance).seconds
            seconds = entry.make(entry.tolerance).seconds
            entry.times.append(seconds)
            entry.ratios.append(seconds / paired)
        progress((i + 1) / ROUNDS)


def _row(entry: _Entry, solution: ReferenceSolution, problem: MethodProblem) -> MethodRow:
    method, first = entry.method, entry.first
    error = solution.error(first.end)
    events = None
    if first.switches is not None and solution.switches is not None:
        events = event_errors(first.switches, solution.switches, problem.stop_time)
    times = entry.times or [first.seconds]
    quarters = statistics.quantiles(times, n=4) if len(times) > 1 else [times[0]] * 3
    return MethodRow(
        method=method.name,
        family=method.family,
        tolerance=entry.tolerance,
        error=error,
        ranked=math.isfinite(error) and error > TRUST * solution.own_error(method),
        events=events,
        evaluations=first.evaluations,
        seconds=statistics.median(times),
        spread=quarters[2] - quarters[0],
        ratio=statistics.median(entry.ratios) if entry.ratios else None,
        runs=len(times),
        memory=entry.memory,
    )


def _memory(entry: _Entry) -> int | None:
    if entry.first.seconds > TRACED:
        return None
    tracemalloc.start()
    try:
        entry.make(entry.tolerance)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in what takes longer; only where the system has alarms, and in the main thread."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: object) -> None:
        raise TimeoutError(f"given up after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def event_errors(computed: Sequence[SwitchEvent], reference: Sequence[SwitchEvent], stop: float) -> EventErrors:
    """Pair the events of every contact that end in the same state, each with the nearest still free."""
    kinds: dict[tuple[str, int], tuple[list[float], list[float]]] = defaultdict(lambda: ([], []))
    for column, switches in enumerate((computed, reference)):
        for switch in switches:
            if switch.matters:
                # that a body has left its stop says the same whether it is still inside or not
                after = OPEN if switch.after == RELEASED else switch.after
                kinds[switch.contact, after][column].append(switch.time)
    missed, paired = 0, 0
    largest: float | None = None
    for finds, times in kinds.values():
        free = sorted(finds)
        for i, t in enumerate(times):
            around = [abs(t - times[j]) for j in (i - 1, i + 1) if 0 <= j < len(times)]
            reach = REACH * min([d for d in around if d > 0.0], default=stop)
            nearest = min(free, key=lambda candidate, t=t: abs(candidate - t), default=None)
            if nearest is None or abs(nearest - t) > reach:
                missed += 1
                continue
            free.remove(nearest)
            paired += 1
            largest = max(largest or 0.0, abs(nearest - t))
    expected = sum(len(times) for _, times in kinds.values())
    finds = sum(len(finds) for finds, _ in kinds.values())
    return EventErrors(expected, missed, finds - paired, largest)
