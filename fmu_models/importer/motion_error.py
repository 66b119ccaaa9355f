"""Why a run of a foreign FMU ended early, in words."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.c_structures import declarations
from fmu_models.importer import fmi1, instance
from fmu_models.importer.clocks import clocks_of

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.simulation.trajectory import Trajectory

RUN = declarations("importer/c/master.h").constants("RunStatus", "RUN_")
METHOD = declarations("importer/c/master.h").constants("MethodChoice", "METHOD_")
PATTERN = declarations("importer/c/master.h").constants("PatternKind", "PATTERN_")
ZENO = declarations("importer/c/master.h").constants("ZenoChoice", "ZENO_")
KINDS = {number: name.lower().replace("_", " ") for name, number in vars(RUN).items()}


class MotionError(StickslipError):
    """A run that cannot be continued.

    Attributes:
        kind: a value of KINDS.
        time: s; of a Zeno motion the time at which its events accumulate.
        indicator: index of the event indicator concerned, or None.
        concerned: variables that it depends on; of a co-simulation the unit.
        so_far: the run up to there, where there is any.
    """

    so_far: Trajectory | None = None

    def __init__(
        self, text: str, kind: str, time: float, indicator: int | None = None, concerned: Sequence[str] = ()
    ) -> None:
        super().__init__(text)
        self.kind, self.time, self.indicator, self.concerned = kind, time, indicator, concerned

    def __reduce__(self) -> tuple[object, ...]:
        return MotionError, (str(self), self.kind, self.time), vars(self)

    def with_advice(self, advice: str) -> MotionError:
        """The error, with one more thing to do."""
        error = MotionError(f"{self} {advice}", self.kind, self.time)
        vars(error).update(vars(self))
        return error

    def after(self, trajectory: Trajectory) -> MotionError:
        """The error, with the run up to there."""
        self.so_far = trajectory if trajectory.time.size else None
        return self


def indicator_name(fmu: Fmu, index: int) -> str:
    """Name of the variable that is the indicator, which FMI 3 alone tells."""
    unknowns = fmu.description.eventIndicators
    variable = unknowns[index].variable if 0 <= index < len(unknowns) else None
    return str(variable.name) if variable else ""


def dependencies(fmu: Fmu, index: int, states: Sequence[str], gradient: NDArray[np.float64]) -> list[str]:
    """Variables an indicator depends on: as the FMU declares them (FMI 3), or the states that move it."""
    unknowns = fmu.description.eventIndicators
    declared = unknowns[index].dependencies if 0 <= index < len(unknowns) else None
    if declared:
        return [str(variable.name) for variable in declared if variable]
    largest = np.abs(gradient).max(initial=0.0)
    return [name for name, g in zip(states, gradient[: len(states)], strict=True) if abs(g) > 1e-9 * largest > 0]


def motion_error(
    fmu: Fmu, status: int, report: ctypes.Structure, states: Sequence[str], gradient: NDArray[np.float64], message: str
) -> MotionError:
    """The error for a status of the master; ``message`` is what the FMU logged last."""
    time, index = report.report_time, report.report_index
    chatters = RUN.CHATTERING, RUN.CHATTERING_OF_TWO, RUN.CHATTERING_OF_MANY
    about = status in (*chatters, RUN.ZENO, RUN.BAD_INDICATOR)
    indicator = index if about else None
    text = _text(fmu, status, report, states, gradient)
    statuses = (RUN.FMI_ERROR, RUN.NOT_FINITE, RUN.STEP_TOO_SMALL, RUN.EVENT_ITERATION, RUN.STALLS, RUN.DISCARD)
    if message and status in statuses:
        text += f" The FMU says: {message}"
    concerned = () if indicator is None else dependencies(fmu, indicator, states, gradient)
    return MotionError(f"{fmu.description.modelName}: {text}", KINDS[status], time, indicator, concerned)


def _named(fmu: Fmu, index: int, states: Sequence[str], gradient: NDArray[np.float64]) -> str:
    if index < 0:
        return "the FMU"
    name = indicator_name(fmu, index)
    variables = dependencies(fmu, index, states, gradient)
    return (
        f"event indicator {index}"
        + (f" '{name}'" if name else "")
        + (f" (it depends on {', '.join(variables)})" if variables else "")
    )


def _held(report: ctypes.Structure, states: Sequence[str]) -> str:
    """What the user can ask for, or why it was not done."""
    if report.method == METHOD.CO_SIMULATION:
        return "The run can go on as the FMU does: on_zeno, --on-zeno continue."
    if report.on_zeno != ZENO.HOLD:
        return "The run can be held there, or go on as the FMU does: on_zeno, --on-zeno hold or continue."
    if report.report_other >= 0:
        return f"It cannot be held there: the state '{states[report.report_other]}' goes on."
    return "It cannot be held there: inputs change afterwards, or a time event comes."


OWN_STATE = "Give the model a state of its own (a stick mode) for this motion, or a hysteresis."
_SLIDES = "{indicator} chatters at {at} while the motion slides along "
_TEXTS = {
    RUN.NOT_FINITE: "the derivative of the state '{state}' is not a finite number at {at}. Check parameters and start "
    "values.",
    RUN.STEP_TOO_SMALL: "the steps become shorter than the rounding of time at {at}: the motion has a singularity "
    "there, or a jump that no event indicator announces. Stop the run before it, or loosen the tolerance.",
    RUN.TOO_LARGE: "an implicit method needs systems of equations for {index} states at {at}, with more numbers that "
    "may differ from zero than there is room for (3.4e7). Choose the method 'dop853' or 'dopri5', or split the FMU.",
    RUN.RATES_DIFFER: "two calls at {at} with the same states and inputs give derivatives of the state '{state}' that "
    "differ by {value:.3g}: steps of any sensible length cannot keep the tolerance. Mend the FMU, or loosen the "
    "tolerance.",
    RUN.EVENT_ITERATION: "the FMU asks for ever more updates of its discrete states at {at}; after {value:.0f} the run "
    "is stopped.",
    RUN.BAD_INDICATOR: "event indicator {index} is not a finite number at {at}. Check parameters and start values.",
    RUN.BAD_EVENT_TIME: "the FMU gives nextEventTime, the time of its next event, the value {value:g} at {at}; "
    "expected a time. Mend the FMU, or end the run before it.",
    RUN.STALLS: "doStep returns at {at} without progress, {value:.0f} times in a row. Choose another step.",
    RUN.DISCARD: "doStep discards the communication step of {value:.9g} s at {at}{far}. Choose a shorter one.",
    RUN.EVENTS_PILE_UP: "{value:.0f} events follow one another at {at} without progress; the FMU does not go on from "
    "there.",
    RUN.ZENO: "infinitely many events of {indicator} accumulate at {at}; each interval is {value:.4g} of the one "
    "before. The motion comes to rest there, but the FMU has no state of rest: end the run before that time, or give "
    "the model a condition that ends the sequence.",
    RUN.CHATTERING_OF_TWO: _SLIDES + "the surface of {second}, and the motion along both cannot be computed: the FMU "
    "does not lead there from all sides, or does not choose its equations by the sides alone. Give the model a state "
    "of its own for one of them.",
    RUN.CHATTERING_OF_MANY: _SLIDES + "{value:.0f} surfaces, and that many at once are computed. Give the model a "
    "state of its own for one of them.",
    RUN.CHATTERING: "events of {indicator} follow one another without end at {at} (chattering), and the motion along "
    "its surface cannot be computed: the FMU does not lead there from both sides, or moves its states, or does not "
    "choose its equations by the side. " + OWN_STATE,
}


def _text(fmu: Fmu, status: int, report: ctypes.Structure, states: Sequence[str], gradient: NDArray[np.float64]) -> str:
    time, index, value = report.report_time, report.report_index, report.report_value
    at = f"t = {time:.9g} s"
    if status == RUN.BAD_CLOCK:
        clock, quantity = clocks_of(fmu)[index], "shift" if report.report_other else "interval"
        least = "a positive number" if clock.is_periodic and not report.report_other else "zero or more"
        return f"the clock '{clock.name}' has the {quantity} {value:g} s; expected {least}, and finite."
    if status == RUN.FMI_ERROR:
        name = instance.FUNCTIONS[index][fmu.fmi - 2] or instance.FUNCTIONS[index][3 - fmu.fmi]
        refusal = {"Set": "refuses a value", "Get": "gives no value (discard)"}.get(str(name)[:3], "discards the call")
        failure = refusal if value == 2 else "fails" if value < 4 else "fails for good"
        return f"{fmi1.called(fmu, str(name))} {failure} at {at}."
    if status == RUN.NOT_FINITE and not math.isfinite(value):
        return f"the FMU gives the state '{states[index]}' the value {value:g} in its event at {at}."
    if status == RUN.TOO_MANY_STEPS:
        stiff = "" if index else ", or it is stiff (try the method 'stiff')"
        return (
            f"the steps are {value:.2g} s long at {at}, and the run would not end in hours: its equations jump there "
            f"without an event indicator{stiff}. Loosen the tolerance, or give the model an event there."
        )
    names = {"state": states[index] if 0 <= index < len(states) else "", "second": "", "far": ""}
    if time < report.report_reached < time + value:
        names["far"] = f", of which it made {report.report_reached - time:.9g} s"
    if status == RUN.CHATTERING_OF_TWO:
        names["second"] = _named(fmu, report.report_other, states, np.zeros(len(states)))
    indicator = _named(fmu, index, states, gradient)
    text = _TEXTS[status].format(at=at, index=index, value=value, indicator=indicator, **names)
    return f"{text} {_held(report, states)}" if status == RUN.ZENO else text
