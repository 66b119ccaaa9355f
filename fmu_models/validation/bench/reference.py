"""What errors are measured against, and how well that is known.

A closed form where there is one (linear_flow.py), else the most accurate of the runs by independent codes that treat
the model. Its own error is taken to be its distance from the next of them; when the code that is judged is one of the
two, the distance from another. An error below ``TRUST`` times that says nothing but that it is small.

A run that takes too long is given up by what it has done (products, steps, right-hand sides), never by the time that
took: which runs a reference rests on depends neither on the machine nor on its load.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.validation.methods.event_taylor import EventTaylor
from fmu_models.validation.methods.linear_flow import LinearFlow
from fmu_models.validation.methods.peers.fmpy_cvode import FmpyCvode
from fmu_models.validation.methods.peers.heyoka_taylor import HeyokaTaylor
from fmu_models.validation.methods.result import (
    Method,
    MethodProblem,
    MethodRun,
    NotInstalled,
    NotTreated,
    SwitchEvent,
    TooLong,
)
from fmu_models.validation.methods.scipy_events import ScipyEvents

TRUST = 3.0
ENOUGH = 3  # runs: two that agree and one that speaks for itself
MOST_STEPS, MOST_SIDES = 300_000, 1_500_000  # of one run, some ten seconds
APART = 1e-3  # in nominal values: two runs that differ by more are not of one motion


class Parted(StickslipError):
    """No two codes end in the same motion, or in time."""


@dataclass(frozen=True, eq=False)
class Witness:
    """A run that the reference rests on: by which code, how, and its end state (n_states,)."""

    code: str
    how: str
    end: NDArray[np.float64]
    exact: bool = False


@dataclass(frozen=True, eq=False)
class ReferenceSolution:
    """The end state (n_states,), the events, and the runs that they rest on, best first."""

    end: NDArray[np.float64]
    switches: tuple[SwitchEvent, ...] | None
    witnesses: tuple[Witness, ...]
    nominal: NDArray[np.float64]

    def error(self, end: NDArray[np.float64]) -> float:
        """Largest difference of a state, in its nominal value."""
        difference = float(np.max(np.abs(end - self.end) / self.nominal))
        return difference if math.isfinite(difference) else math.inf

    def own_error(self, method: Method | None = None) -> float:
        """How well the end state is known, without the word of the method itself; of a closed form, rounding."""
        first, *others = self.witnesses
        if first.exact:
            return float(np.max(np.spacing(np.abs(self.end)) / self.nominal))
        code = code_of(method) if method else ""
        return min((self.error(w.end) for w in others if w.code not in (code, first.code)), default=math.inf)

    @property
    def sentence(self) -> str:
        """Which runs it is, and how far they agree."""
        first, *others = self.witnesses
        if first.exact:
            agree = f"; {others[0].how} ends {self.error(others[0].end):.1e} from it" if others else ""
            return f"closed form ({first.how}){agree}"
        if not others:
            return f"{first.how}; nothing independent treats this model, errors are differences from it"
        witnesses = " and ".join(f"{w.how} ({self.error(w.end):.1e})" for w in others)
        return f"{first.how}, which agrees with {witnesses}"


def code_of(method: Method) -> str:
    """What makes two methods dependent: the code that does the work."""
    return getattr(method, "solver", "") or type(method).__name__


def reference(problem: MethodProblem, tick: Callable[[], None] = lambda: None) -> ReferenceSolution:
    """Make the runs. StickslipError: no two codes treat the model, or they end in different motions."""
    runs: list[tuple[Witness, MethodRun]] = []
    late = False
    candidates: tuple[tuple[Method, float, str], ...] = (
        (LinearFlow(), 1e-30, "matrix exponentials between events, 40 digits"),
        (HeyokaTaylor(extended=True, most=MOST_STEPS), 1e-19, "heyoka.py in long double at 1e-19"),
        (ScipyEvents("DOP853", longest=5e-4, most=MOST_SIDES), 1e-13, "scipy DOP853 with events at 1e-13"),
        (EventTaylor(), 1e-15, "event-driven Taylor at 1e-15"),
        (ScipyEvents("RK45", most=MOST_SIDES), 1e-13, "scipy RK45 with events at 1e-13"),
    )
    for method, tolerance, description in candidates:
        if len(runs) >= ENOUGH:
            break
        try:
            result = method.prepare(problem)(tolerance)
        except (NotTreated, NotInstalled) as error:
            late |= isinstance(error, TooLong)
            continue
        finally:
            tick()
        runs.append((Witness(code_of(method), description, result.end, exact=isinstance(method, LinearFlow)), result))
    if len(runs) == 1 and late:
        raise Parted(
            f"{problem.name}: only one code comes to its end with a bounded effort. Choose a shorter run (--until)."
        )
    if len(runs) == 1:  # our own engine alone: its contacts under a foreign integrator
        try:
            result = FmpyCvode().prepare(problem)(1e-10)
            description = "fmpy's CVode at 1e-10 (which shares the treatment of contacts)"
            runs.append((Witness("FmpyCvode", description, result.end), result))
        except NotTreated:
            pass
    if not runs:
        raise StickslipError(f"{problem.name}: no method can run it. Simulate it: stickslip simulate {problem.name}")
    for witness, run in runs:
        alone = ReferenceSolution(run.end, run.switches, (), problem.nominal)
        others = sorted((alone.error(w.end), i) for i, (w, _) in enumerate(runs) if w is not witness)
        agreeing = tuple(runs[i][0] for distance, i in others if distance < APART)
        if agreeing or len(runs) == 1:
            return ReferenceSolution(run.end, run.switches, (witness, *agreeing), problem.nominal)
    first, second = runs[0], runs[1][0]
    difference = ReferenceSolution(first[1].end, None, (), problem.nominal).error(second.end)
    raise Parted(
        f"{problem.name}: {first[0].how} and {second.how} end {difference:.1g} apart, in nominal values of the states: "
        "the motion is chaotic or grazes, and no end state can be compared. Choose a shorter run (--until)."
    )
