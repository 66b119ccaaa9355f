"""Many runs as data: what is asked for, the chunks it is cut into, and the rows that come of it.

    jobs -> chunks -> rows

A chunk is made by one call, knows nothing of the others, and fills rows of its own: the result does not depend on who
makes which chunk, nor when. Whoever can call ``run`` of a system with a part of the jobs (a thread, another process,
another machine) and put the rows at their place can make a family of motions.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

# steps of a section in a chunk, about: some 50 ms of work
CHUNK = 5000
# steps after which a run that may end early has ended, as a rule
EARLY = 50
# how a run ended
FINISHED, SETTLED, ABSORBED, ESCAPED, LOST, BROKEN, STOPPED = range(7)
OUTCOMES = ("finished", "settled", "absorbed", "to infinity", "section not met", "error", "stopped")


@dataclass(frozen=True, eq=False)
class Targets:
    """Orbits at which a run may end.

    Attributes:
        points: (k, n) of all orbits, as a system has them.
        forms: (k, n, n) quadratic forms, below 1 near a point.
        after: (k,) the point that follows each.
        orbits: (k,) which orbit it belongs to.
        passes: (k,) how many points in a row a motion must come near to.
    """

    points: Vector
    forms: Vector
    after: NDArray[np.int64]
    orbits: NDArray[np.int64]
    passes: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Jobs:
    """Runs over many steps of a section.

    Attributes:
        starts: (m, n) points.
        varied: values (m,) of parameters by name that differ from run to run.
        transient: steps that are not recorded.
        rows, batch: rows that are, of so many steps each.
        chain: runs in a row of which each begins where the one before it ended.
        longest: period up to which a motion is asked whether it repeats itself, and then followed no farther; 0: none.
        settled: relative distance below which two points are one.
        targets: orbits at which a run may end.
        tangents: how many differences are followed; their growth is recorded. ``flow``: the first along the motion.
        derivatives: record the derivative of each step instead.
    """

    starts: Vector
    varied: Mapping[str, Vector] = field(default_factory=dict)
    transient: int = 0
    rows: int = 1
    batch: int = 1
    chain: int = 1
    longest: int = 0
    settled: float = 1e-11
    targets: Targets | None = None
    tangents: int = 0
    flow: bool = False
    derivatives: bool = False

    def __len__(self) -> int:
        return len(self.starts)

    def part(self, begin: int, end: int) -> Jobs:
        """Those from ``begin`` up to ``end``."""
        varied = {name: values[begin:end] for name, values in self.varied.items()}
        return dataclasses.replace(self, starts=self.starts[begin:end], varied=varied)

    def chunks(self, together: int = 1) -> list[tuple[int, int]]:
        """Begin and end of each chunk, of at least so many runs; a chain stays whole."""
        steps = self.transient + self.rows * self.batch
        if self.targets is not None or self.longest:
            steps = min(steps, EARLY)
        size = max(together, CHUNK // max(1, steps * self.chain * (1 + 2 * self.tangents)), 1) * self.chain
        return [(begin, min(begin + size, len(self))) for begin in range(0, len(self), size)]


@dataclass(frozen=True, eq=False)
class Rows:
    """What came of m runs.

    Attributes:
        points: (m, rows, n) at the section; nan where a run has fewer.
        times: (m, rows) since the row before.
        held: (m, rows, contacts) time in contact or stick; began: how often that began.
        growth: (m, rows, tangents) logarithms; derivatives: (m, rows, n, n).
        filled, steps, outcomes, periods, orbits: (m,) rows that there are; steps made; how the run ended (an index of
            OUTCOMES); its period, 0 where none was found; the target that it came to, or -1.
        messages: of the runs that ended in an error, by number.
    """

    points: Vector
    times: Vector
    held: Vector
    began: NDArray[np.int32]
    growth: Vector
    derivatives: Vector
    filled: NDArray[np.int64]
    steps: NDArray[np.int64]
    outcomes: NDArray[np.int32]
    periods: NDArray[np.int64]
    orbits: NDArray[np.int64]
    messages: Mapping[int, str]

    def only(self, which: NDArray[np.int64]) -> Rows:
        """Those of some runs."""
        parts = {one.name: getattr(self, one.name) for one in dataclasses.fields(self) if one.name != "messages"}
        messages = {k: self.messages[int(i)] for k, i in enumerate(which) if int(i) in self.messages}
        return Rows(**{name: part[which] for name, part in parts.items()}, messages=messages)

    @property
    def ends(self) -> Vector:
        """(m, n) the last point of each run; nan where it has none."""
        last = np.maximum(self.filled - 1, 0)
        found = self.points[np.arange(len(last)), last] if self.points.shape[1] else self.points[:, :0].sum(axis=1)
        return np.where(self.filled[:, None] > 0, found, np.nan)


def joined(parts: Sequence[Rows], begins: Sequence[int]) -> Rows:
    """The rows of all chunks, which begin at these runs."""
    messages = {b + i: text for part, b in zip(parts, begins, strict=True) for i, text in part.messages.items()}
    names = [one.name for one in dataclasses.fields(Rows) if one.name != "messages"]
    return Rows(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names}, messages=messages)


Make = Callable[[Jobs, NDArray[np.int32]], Rows]


def make(
    run: Make,
    jobs: Jobs,
    *,
    together: int = 1,
    workers: int | None = None,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Rows:
    """All rows, by threads of this process; ``run`` makes a chunk and lets other threads work meanwhile.

    Args:
        together: runs in a chunk, at least.
        workers: number of threads; as many as there are cores if left out.
        progress: called with the fraction done, from this thread.

    Raises:
        StickslipError: as ``run`` does; KeyboardInterrupt ends all threads within a step.
    """
    chunks = jobs.chunks(together)
    stop = np.zeros(1, np.int32)
    if len(chunks) == 1:
        workers = 1
    count = min(workers or os.cpu_count() or 1, len(chunks))
    found: list[Rows | None] = [None] * len(chunks)
    errors: list[BaseException] = []
    ended: list[None] = []
    counter = itertools.count()  # one number to one thread: its next() is atomic
    done = threading.Condition()

    def work() -> None:
        try:
            while not errors and (k := next(counter)) < len(chunks):
                found[k] = run(jobs.part(*chunks[k]), stop)
                with done:
                    done.notify()
        except BaseException as error:
            errors.append(error)
        with done:
            ended.append(None)
            done.notify()

    threads = [threading.Thread(target=work, daemon=True) for _ in range(count)]
    try:
        for thread in threads:
            thread.start()
        while len(ended) < count:
            with done:
                if len(ended) < count:
                    done.wait(0.05)
            progress(sum(one is not None for one in found) / len(chunks))
    except BaseException:
        stop[0] = 1
        errors.append(KeyboardInterrupt())
        raise
    finally:
        for thread in threads:
            thread.join()
    if errors:
        raise errors[0]
    return joined([one for one in found if one is not None], [begin for begin, _ in chunks])
