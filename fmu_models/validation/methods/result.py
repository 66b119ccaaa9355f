"""What every method gets and gives: a problem with numbers, and a run with its cost."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.language import contact_kinds
from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.lowering.hybrid_system import HybridSystem

# contact states as the methods call them
MINUS, PLUS = contact_kinds.SLIP_MINUS, contact_kinds.SLIP_PLUS
STICK, OPEN, CLOSED = contact_kinds.STICK, contact_kinds.OPEN, contact_kinds.CLOSED
RELEASED = contact_kinds.RELEASED


class NotTreated(StickslipError):
    """A method cannot treat a model; the message says why, and which one can."""


class TooLong(NotTreated):
    """A run would take more than its method is given."""


class NotInstalled(StickslipError):
    """A peer is not there."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MethodProblem:
    """One run, the same for every method.

    Attributes:
        name, title: of the scene or model.
        system: lowered, every parameter and input a number; free symbols are states and the time.
        start: (n_states,), SI; coordinates, then driven states, then internal states.
        nominal: (n_states,), magnitude of each state.
        stop_time: s, from time 0.
        fmu: the exported FMU.
        arguments: ``parameters``, ``start`` and ``inputs`` of a run of that FMU.
        steady: inputs do not change with time; only then ``system`` has numbers for them.
    """

    name: str
    title: str
    system: HybridSystem
    start: NDArray[np.float64]
    nominal: NDArray[np.float64]
    stop_time: float
    fmu: Path
    arguments: Mapping[str, Any]
    steady: bool = True

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(state.name for state in self.system.states)


@dataclass(frozen=True)
class SwitchEvent:
    """A change of contact state or a bounce (``before`` equals ``after``) at ``time``, s."""

    time: float
    contact: str
    before: int
    after: int

    @property
    def matters(self) -> bool:
        """Whether a force changed: not where a released body leaves its support for good."""
        return (self.before, self.after) not in ((RELEASED, OPEN), (OPEN, RELEASED))


@dataclass(frozen=True, eq=False)
class MethodRun:
    """What came of a run.

    Attributes:
        end: (n_states,) at the end of the run, SI.
        switches: those that the method reports, in order; None if it knows of none.
        evaluations: right-hand sides; of a Taylor method orders of series; None if the method does not say.
        seconds: wall time of the call that its user makes, from arguments to result. What the first call of a program
            does once (opening, compiling, making an instance that is kept) is outside.
    """

    end: NDArray[np.float64]
    switches: tuple[SwitchEvent, ...] | None
    evaluations: int | None
    seconds: float


class Method(Protocol):
    """A way to integrate; one file each."""

    @property
    def name(self) -> str:
        """In a few words, with its own parameters."""
        ...

    @property
    def family(self) -> Literal["event-driven", "switch model", "smoothing", "time-stepping"]:
        """How it treats what is not smooth."""
        ...

    @property
    def tolerances(self) -> tuple[float, ...]:
        """What a work-precision diagram runs it at: relative errors of a step, or steps in parts of the run."""
        ...

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Everything that is done once per problem; what it returns makes a run at a tolerance. NotTreated: the method
        cannot treat the model. NotInstalled: it needs a package that is not there."""
        ...


def needs_steady_inputs(problem: MethodProblem, method: str) -> None:
    """Refuse a drive that varies, and signals. NotTreated: it does."""
    if not problem.steady or problem.system.signals:
        raise NotTreated(f"{method}: a drive or signal of {problem.name} varies with time. Use event-driven Taylor.")


def needs_fields_alone(contact: ContactDynamics, method: str) -> None:
    """Refuse a contact at which states jump by a rule or whose force remembers; ``method``: what cannot treat that.
    NotTreated: it is such a contact."""
    rests = bool(contact.reset_sides & 8)
    if contact.reset or contact.remembers or rests:
        reason = "states jump" if contact.reset else "it may rest" if rests else "the force knows the speed of entry"
        raise NotTreated(f"'{contact.name}': {reason}, which {method}. Use event-driven Taylor.")


def repeatable(
    run: Callable[[float], tuple[Any, tuple[SwitchEvent, ...] | None, int]], n: int, first: float | None = None
) -> Callable[[float], MethodRun]:
    """Timed runs at a tolerance. One before them, at ``first`` or their own, compiles the modes: that is start-up."""
    warm = False

    def make(tolerance: float) -> MethodRun:
        nonlocal warm
        if not warm:
            run(first or tolerance)
            warm = True
        return timed(lambda: run(tolerance), n)

    return make


def timed(run: Callable[[], tuple[Any, tuple[SwitchEvent, ...] | None, int]], n: int) -> MethodRun:
    """Make a run that returns end state, switches and evaluations, and measure its time."""
    started = time.perf_counter()
    end, switches, evaluations = run()
    seconds = time.perf_counter() - started
    return MethodRun(np.array([float(value) for value in end[:n]]), switches, evaluations, seconds)
