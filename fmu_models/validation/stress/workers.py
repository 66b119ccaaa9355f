"""Cells judged in child processes, so that nothing that happens in one of them stops the grid.

A child that dies, or does not answer in time, is a failed cell of that case, and another child takes its place.
"""

import operator
import os
from collections.abc import Callable, Iterator, Sequence

from fmu_models import oscillators
from fmu_models.base.child_process import IsolatedFailure, Limits
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
            yield _failed(cases[number], outcome, pool.limits.time)
        elif isinstance(outcome, Exception):
            raise outcome
        else:
            yield outcome


def _failed(case: Case, failure: IsolatedFailure, patience: float | None) -> StressCell:
    late = failure.cause == "time"
    reason = f"no answer within {patience:g} s" if late else f"the process died (exit code {failure.code})"
    return StressCell(case, "failed", None, "process", reason, seconds=failure.seconds)


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
            return cross_check(case, self.second) if case.of == RANDOM else judge(case, self.second.subject)
        except Exception as error:  # a fault of the judge is a failed cell, not the end of the grid
            return StressCell(case, "failed", None, "program", f"{type(error).__name__}: {error}")
