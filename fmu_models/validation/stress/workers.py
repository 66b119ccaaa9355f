"""Cells judged in child processes, so that nothing that happens in one of them stops the grid.

A child that dies, or does not answer in time, is a failed cell of that case, and another child takes its place. An
interrupt stops all of them; what was finished is kept.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any

from fmu_models.validation.stress.cases import Case, grid
from fmu_models.validation.stress.judge import Cell

# a cell that has not answered by then hangs, s: its allowances of steps are some seconds of work on a slow machine
PATIENCE = 60.0


@dataclass(eq=False)
class _Child:
    """A process, the pipe to it, the case it works on and since when, and the model that it has loaded."""

    process: Any
    pipe: Connection
    case: Case | None = None
    since: float = field(default_factory=time.monotonic)
    model: str | None = None


def cases_of(name: str, until: float | None = None) -> list[Case]:
    """The grid of an oscillator."""
    from fmu_models import oscillators
    from fmu_models.validation.stress.equations import Equations

    model = oscillators.load(name)
    return grid(name, model, Equations(model), until=until)


def judged(
    cases: Sequence[Case],
    progress: Callable[[float], None],
    *,
    processes: int | None = None,
    patience: float = PATIENCE,
) -> Iterator[Cell]:
    """The cells of the cases as they are finished; ``progress`` is told the fraction done."""
    context = multiprocessing.get_context("spawn")
    count = min(processes or os.cpu_count() or 1, max(1, len(cases)))
    waiting: dict[str, list[Case]] = {}
    for case in cases:
        waiting.setdefault(case.model, []).append(case)
    done = 0
    children: list[_Child] = []
    try:
        children += [_new(context) for _ in range(count)]
        while any(waiting.values()) or any(child.case for child in children):
            for child in children:
                if child.case is None and any(waiting.values()):
                    child.model = _next_model(child, children, waiting)
                    child.case, child.since = waiting[child.model].pop(0), time.monotonic()
                    child.pipe.send(child.case)
            for i, child in enumerate(children):
                cell = _answer(child, patience)
                if cell is None:
                    continue
                done += 1
                progress(done / len(cases))
                if not child.process.is_alive():
                    children[i] = _new(context)
                child.case = None
                yield cell
            busy = [child.pipe for child in children if child.case]
            if busy:
                wait(busy, timeout=0.5)
    finally:
        for child in children:
            child.process.kill()
            child.process.join()


def _next_model(child: _Child, children: list[_Child], waiting: dict[str, list[Case]]) -> str:
    """The model that a child knows already, else one that nobody works on, else that with the most cases left."""
    if child.model and waiting[child.model]:
        return child.model
    taken = {other.model for other in children}
    return max(waiting, key=lambda model: (bool(waiting[model]), model not in taken, len(waiting[model])))


def _new(context: Any) -> _Child:
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there,), daemon=True)
    process.start()
    there.close()
    return _Child(process, here)


def _answer(child: _Child, patience: float) -> Cell | None:
    """The cell of a child that has finished, died or taken too long; None if it is at work."""
    case = child.case
    if case is None:
        return None
    seconds = time.monotonic() - child.since
    if child.pipe.poll():
        try:
            return child.pipe.recv()
        except (EOFError, OSError):
            child.process.join()
            code = child.process.exitcode
            return Cell(case, "failed", None, "process", f"the process died (exit code {code})", seconds=seconds)
    if seconds > patience:
        child.process.kill()
        child.process.join()
        return Cell(case, "failed", None, "process", f"no answer within {patience:g} s", seconds=seconds)
    return None


def _work(pipe: Connection) -> None:
    """Judge what comes through the pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what an interrupt means
    from fmu_models import oscillators
    from fmu_models.codegen.package import built
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.validation.stress.judge import Subject, judge

    loaded: dict[str, Any] = {}
    with contextlib.suppress(EOFError, OSError):
        while True:
            case: Case = pipe.recv()
            try:
                if case.model not in loaded:
                    loaded.clear()
                    loaded[case.model] = Subject.of(oscillators.load(case.model), Fmu.open(built(case.model)))
                cell = judge(case, loaded[case.model])
            except Exception as error:  # a fault of the judge is a failed cell, not the end of the grid
                cell = Cell(case, "failed", None, "program", f"{type(error).__name__}: {error}")
            pipe.send(cell)
