"""Which cases of stress are run, and their cells judged in child processes, so that nothing that happens in one of them
stops the grid.

Cases come by name of the model, by pattern, as a quick choice, or drawn at random. A child that dies, or does not
answer in time, is a failed cell of that case, and another child takes its place.
"""

import fnmatch
import operator
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from fmu_models import oscillators
from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.processes import ProcessPool
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.validation.stress.cases import Case, grid
from fmu_models.validation.stress.cross_check import SecondPath, cross_check
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.judge import StressCell, StressSubject, judge
from fmu_models.validation.stress.random_cases import RANDOM, random_cases

# a cell that has not answered by then hangs, s: its allowances of steps are some seconds of work on a slow machine
PATIENCE = 60.0


def cases_of(name: str, until: float | None = None) -> list[Case]:
    """The grid of an oscillator."""
    model = oscillators.load(name)
    return grid(name, model, StressEquations(model), until=until)


def drawn(name: str, count: int, seed: int, until: float | None = None) -> list[Case]:
    """Random cases of an oscillator."""
    model = oscillators.load(name)
    return random_cases(name, model, Fmu.open(built(name)), StressEquations(model), count, seed, until=until)


def judges(processes: int | None = None, patience: float = PATIENCE) -> ProcessPool[StressCell]:
    """Children for ``judged``, one per core if no number is given; they start now."""
    return ProcessPool(_Judge().judged, processes=processes or os.cpu_count() or 1, limits=Limits(patience), threads=1)


def judged(
    cases: Sequence[Case], progress: Callable[[float], None], pool: ProcessPool[StressCell]
) -> Iterator[StressCell]:
    """The cells of the cases as they are finished by ``judges``; ``progress`` is told the fraction done."""
    outcomes = pool.run([(case,) for case in cases], group=operator.attrgetter("model"))
    for done, (number, outcome) in enumerate(outcomes, 1):
        progress(done / len(cases))
        if isinstance(outcome, IsolatedFailure):
            reason = f"the process died (exit code {outcome.code})"
            if outcome.cause == "time":
                reason = f"no answer within {pool.limits.time:g} s"
            yield StressCell(cases[number], "failed", None, "process", reason, seconds=outcome.seconds)
        elif isinstance(outcome, Exception):
            raise outcome
        else:
            yield outcome


class _Judge:
    """What a child works with: it keeps the model of its last case."""

    def __init__(self) -> None:
        self.name = ""
        self.second: SecondPath | None = None

    def judged(self, case: Case) -> StressCell:
        """The cell of a case."""
        try:
            if self.second is None or case.model != self.name:
                self.second = SecondPath(StressSubject.of(oscillators.load(case.model), Fmu.open(built(case.model))))
                self.name = case.model
            started = time.perf_counter()
            cell = cross_check(case, self.second) if case.of == RANDOM else judge(case, self.second.subject)
            return replace(cell, seconds=time.perf_counter() - started)
        except Exception as error:  # a fault of the judge is a failed cell, not the end of the grid
            return StressCell(case, "failed", None, "program", f"{type(error).__name__}: {error}")


def listed_cases(models: list[str], pattern: str | None, until: float | None, quick: bool) -> list[Case]:
    """The cases asked for; of a quick look without models those of one model per kind of contact. StickslipError: an
    unknown model, or no case left."""
    if not models:
        models = _one_per_kind() if quick else oscillators.names()
    cases = [case for name in dict.fromkeys(models) for case in cases_of(name, until)]
    if pattern is None:
        return [case for case in cases if case.quick or not quick]
    chosen = [case for case in cases if fnmatch.fnmatchcase(case.name, pattern) and (case.quick or not quick)]
    if not chosen:
        names = [case.name for case in cases if case.quick or not quick]
        raise StickslipError(f"No case matches '{pattern}'.{nearest(pattern, names)}")
    return chosen


def drawn_cases(models: list[str], count: int, seed: int, until: float | None) -> list[Case]:
    """So many cases, as equal numbers of each model as there can be. StickslipError: an unknown model."""
    names = list(dict.fromkeys(models)) or oscillators.names()
    share, remainder = divmod(count, len(names))
    return [case for i, name in enumerate(names) for case in drawn(name, share + (i < remainder), seed, until)]


def _one_per_kind() -> list[str]:
    """The first model by name of every kind of contact."""
    first_cases: dict[str, str] = {}
    for name in oscillators.names():
        for contact in oscillators.load(name).contacts:
            first_cases.setdefault(type(contact).__name__, name)
    return sorted(set(first_cases.values()))
