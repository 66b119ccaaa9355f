"""A hunt: cases of a target drawn from a seed, each in a child process, and what is found wrong.

A case is one function of a random generator that depends on the target, the seed and the number of the case alone. It
may return, or refuse by a StickslipError with words. All else is a finding: another error, a warning of a library, an
answer that does not come, a child that dies, a report of a sanitizer.
"""

from __future__ import annotations

import functools
import os
import random
import re
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import sanitizers

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError, StickslipWarning
from fmu_models.base.processes import in_processes, isolated

PATIENCE = 180.0  # s for one case on a machine that has other work
MEMORY = 3000.0  # MB, of cases without sanitizers, which reserve more than any machine has
LINES, WIDE = 9, 240  # of a traceback that is shown
MOST = 2_000_000  # cases of a target in one hunt


def nothing() -> None:
    """Of what needs no preparation."""


@dataclass(frozen=True)
class Target:
    """What is hunted in.

    Attributes:
        name: of the target.
        case: makes and tries one case; may write into the present folder, which is empty. What it returns is counted.
        prepare: before the first case, in a process of its own: builds what cases load. Like ``case`` a function of
            a module, for it goes to other processes.
        native: C of ours runs in it: under sanitizers where there are some.
        weight: cases in a round of all targets; many where they are quick.
    """

    name: str
    case: Callable[[random.Random], Counter[str] | None]
    prepare: Callable[[], object] = nothing
    native: bool = False
    weight: int = 4


class WrongError(Exception):
    """An answer that a case finds wrong: what tells it from others, and all that shows it."""

    def __init__(self, place: str, details: str) -> None:
        super().__init__(place, details)
        self.place, self.details = place, details


@dataclass(frozen=True)
class Done:
    """A case that is over, with what it counted."""

    name: str
    counts: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Finding:
    """What went wrong, in a case that can be repeated; ``place`` is what tells it from others."""

    target: str
    seed: int
    number: int
    place: str
    details: str

    def __str__(self) -> str:
        again = f"python tests/fuzz --target {self.target} --seed {self.seed} --case {self.number}"
        return f"{self.place}\n{self.details.rstrip()}\n  again: {again}"


def generator(target: str, seed: int, number: int) -> random.Random:
    """The same on every machine."""
    return random.Random(f"{target}/{seed}/{number}")


def tried(target: Target, seed: int, number: int) -> tuple[str, str] | Counter[str] | None:
    """One case in this process: place and traceback of what is wrong with it, or what it counted."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", StickslipWarning)  # what was mended is told
        try:
            return target.case(generator(target.name, seed, number))
        except WrongError as wrong:
            return f"{target.name}: {wrong.place}", wrong.details
        except StickslipError as error:
            if not str(error).strip():
                return f"{target.name}: an error without words", _last(error)
        except Exception as error:
            return f"{target.name}: {_place(error)}", _last(error)
    return None


def hunt(
    targets: Sequence[Target],
    seed: int,
    seconds: float,
    *,
    first: int = 0,
    rounds: int = MOST,
    processes: int | None = None,
) -> Iterator[Finding | Done]:
    """In targets that are all native or all not: findings as they come, each place once, and every case that is
    done."""
    seen: set[str] = set()
    with _environment(targets[0]) as reports:
        isolated(_prepare, tuple(targets))
        limits = Limits(PATIENCE, None if reports else MEMORY)
        work = functools.partial(_in_child, tuple(targets), seed)
        jobs = list(_jobs(targets, first, rounds))
        end = time.monotonic() + seconds
        outcomes = in_processes(work, jobs, processes=processes or os.cpu_count() or 1, limits=limits)
        for at, outcome in outcomes:
            which, number = jobs[at]
            target = targets[which]
            found = _judged(target, outcome, reports)
            if isinstance(found, tuple) and found[0] not in seen:
                seen.add(found[0])
                yield Finding(target.name, seed, number, *found)
            yield Done(target.name, found if isinstance(found, Counter) else Counter())
            if time.monotonic() > end:
                break
        outcomes.close()


def _prepare(targets: tuple[Target, ...]) -> None:
    for target in targets:
        target.prepare()


def _jobs(targets: Sequence[Target], first: int, rounds: int) -> Iterator[tuple[int, int]]:
    """Places in ``targets`` and numbers of cases: in every round as many of each as it weighs."""
    for turn in range(min(rounds, MOST // sum(target.weight for target in targets) + 1)):
        for which, target in enumerate(targets):
            for number in range(target.weight):
                yield which, first + turn * target.weight + number


def _in_child(targets: tuple[Target, ...], seed: int, which: int, number: int) -> tuple[str, str] | Counter[str] | None:
    from fmu_models.base.temporary import temporary_folder

    with temporary_folder("fuzz") as folder:
        here = os.getcwd()
        os.chdir(folder)
        try:
            return tried(targets[which], seed, number)
        finally:
            os.chdir(here)


def _judged(
    target: Target, outcome: object, reports: sanitizers.Reports | None
) -> tuple[str, str] | Counter[str] | None:
    if isinstance(outcome, IsolatedFailure):
        said = reports.taken() if reports else ""
        lines = [line.strip() for line in said.splitlines() if "runtime error" in line or "SUMMARY" in line]
        # where a library was loaded differs from run to run
        place = re.sub(r"\(?/\S+|0x[0-9a-f]+", "", lines[0]) if lines else str(outcome)
        return f"{target.name}: {place}", said or str(outcome)
    if isinstance(outcome, Exception):
        return f"{target.name}: the hunt itself: {outcome}", str(outcome)
    return outcome  # pyright: ignore[reportReturnType]  # of _in_child


def _place(error: Exception) -> str:
    """Kind of an error, and the last line of ours that it went through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [frame for frame in frames if any(f"/{name}/" in frame.filename for name in OURS)]
    at = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}" if ours else "?"
    return f"{type(error).__name__} at {at}"


def _last(error: Exception) -> str:
    """The end of its traceback, as long as a page is wide."""
    lines = "".join(traceback.format_exception(error)).splitlines()
    return "\n".join(line[:WIDE] for line in lines[-LINES:])


OURS = ("fmu_models", "identification", "rig_io")


@contextmanager
def _environment(target: Target) -> Iterator[sanitizers.Reports | None]:
    with sanitizers.sanitized() if target.native and not sanitizers.missing() else nullcontext() as reports:
        yield reports
