"""What is calibrated: an FMU that is run over stretches of logs, with the derivatives of what it shows.

An FMU of this suite carries exact tangents through its events (fmu_models.simulation.sensitivity). Of any other one
whole runs are differenced,

    dy/dp = (y(p + h) - y(p - h))/(2 h),    h = `STEP` max(|p|, size of p),

at a tolerance tight enough that the steps' own errors cancel: at 1e-8 the same step loses five digits. Where one of the
halves holds a jump, as of a sample that an impact passes, the other half is the derivative.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.language.contact_kinds import TOUCHING
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.run import KeptRun
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Event, Trajectory

Vector = NDArray[np.float64]
Inputs = Mapping[str, float | Signal]

TOLERANCE = 1e-10  # of runs that are differenced
STEP, STEP_OF_SOLVER = 1e-4, 1e-2  # relative, of a difference: of a method of integration, of an FMU's own
JUMP = 0.5  # relative: halves of a difference that differ by more have a jump, or nothing but rounding
KINEMATIC = 1e-9  # relative: so near to the rate of a state another one is that rate
SOLVER = "The FMU is co-simulated: model and solver are identified together."


@dataclass(frozen=True, eq=False)
class Stretch:
    """A run to be made. times: (n,) s of output; values: parameters; start: states; inputs: constant or Signal."""

    start_time: float
    times: Vector
    values: Mapping[str, float]
    start: Mapping[str, float]
    inputs: Inputs

    @property
    def begin(self) -> dict[str, Any]:
        """Where and with what the run begins, as runs of all kinds take it."""
        return {
            "start_time": self.start_time,
            "parameters": self.values,
            "start": self.start,
            "inputs": self.inputs,
        }


@dataclass(frozen=True, eq=False)
class Response:
    """A run with its derivatives. values: (n, k) of what is recorded; slopes: (n, k, m) by the unknowns; met: contacts
    that had an event; hits: by contact, (h,) s, times at which it began to touch or to slip, with (h, m) slopes."""

    values: Vector
    slopes: Vector
    met: frozenset[str] = frozenset()
    hits: Mapping[str, tuple[Vector, Vector]] = field(default_factory=dict)


class Subject(ABC):
    """An FMU whose runs are compared with logs.

    fmu: it; by: parameters, then start states, by which is differentiated; recorded: states, then measured
    variables; timed: contacts whose events are.
    """

    note = ""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        self.fmu, self.states, self.contacts = fmu, tuple(fmu.states), ()
        self.timed = tuple(name for name in measured if name in fmu.contacts)
        measured = [name for name in measured if name not in self.timed]
        self.parameters = tuple(parameters)
        self.by = (*self.parameters, *self.states)
        self.recorded = tuple(dict.fromkeys((*self.states, *measured)))

    @abstractmethod
    def trajectory(self, stretch: Stretch) -> Trajectory:
        """The run alone.

        Raises:
            StickslipError: it cannot be made.
        """

    @abstractmethod
    def respond(self, stretch: Stretch) -> Response:
        """The run with its derivatives by ``by``; errors as in `trajectory`."""

    def closed(self, stretch: Stretch) -> bool:
        """Whether the motion cannot begin here without a memory: in a stop, or behind a wall."""
        return False

    def values(self, stretch: Stretch) -> Vector:
        """(n, k) of what is recorded."""
        return self.observed(stretch)[0]

    def observed(self, stretch: Stretch) -> tuple[Vector, dict[str, Vector]]:
        """(n, k) of what is recorded, and the times s of the hits of each contact that is timed."""
        run = self.trajectory(stretch)
        hits = {
            name: np.array([event.time for event in run.events if event.contact == name and is_hit(event)])
            for name in self.timed
        }
        values = np.column_stack([run[name] for name in self.recorded])
        if len(values) < len(stretch.times) or not np.isfinite(values).all():
            raise StickslipError(f"The run of '{self.fmu.description.modelName}' ended early.")
        return values, hits

    def shown(self, stretch: Stretch) -> Response:
        """The run without derivatives; errors as in `trajectory`."""
        values, hits = self.observed(stretch)
        none = np.empty((0, 0, 0))
        return Response(values, none, hits={name: (times, none) for name, times in hits.items()})

    def rates(self, stretch: Stretch) -> dict[str, str]:
        """Which states are rates of others, seen in a run: the position's name -> the speed's."""
        run = self.trajectory(stretch)
        found = {}
        for name in self.states:
            rate = run.values.get(f"der({name})")
            size = 0.0 if rate is None else float(np.max(np.abs(rate), initial=0.0))
            for other in self.states:
                if rate is not None and size > 0 and np.max(np.abs(run[other] - rate)) <= KINEMATIC * size:
                    found[name] = other
        return found


class OwnSubject(Subject):
    """An FMU of this suite, by its own engine."""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        self.contacts = tuple(fmu.contacts)
        self._kept, self._field = KeptRun(fmu), VectorField(fmu, {})
        self._sensitive = SensitiveRun(fmu, by=self.by, recorded=self.recorded)
        compliant = set(fmu.contacts) - set(fmu.impacts)
        self._stops = [place for place, name in enumerate(fmu.contacts) if name in compliant]

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._kept(float(stretch.times[-1]), output_times=stretch.times, **stretch.begin)

    def respond(self, stretch: Stretch) -> Response:
        run = self._sensitive.run(stretch.times, **stretch.begin)
        hits = {}
        for contact in self.timed:
            rows = [place for place, event in enumerate(run.events) if event.contact == contact and is_hit(event)]
            hits[contact] = np.array([run.events[row].time for row in rows]), run.event_derivative[rows]
        return Response(run.values, run.derivative, frozenset(event.contact for event in run.events), hits)

    def closed(self, stretch: Stretch) -> bool:
        values = dict(stretch.values)
        for name, value in stretch.inputs.items():
            at = np.array([stretch.start_time])
            values[name] = float(value.piece(at)[0][0]) if isinstance(value, Signal) else value
        try:
            there = self._field.at([stretch.start[name] for name in self.states], values, stretch.start_time)
        except StickslipError:
            return True
        return any(there.contacts[place] == TOUCHING for place in self._stops)


class ForeignSubject(Subject):
    """Any other FMU, by the master; whole runs are differenced."""

    def __init__(self, fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> None:
        super().__init__(fmu, parameters, measured)
        if self.timed:
            raise StickslipError(
                f"Times of events are compared with models of this suite only; found '{self.timed[0]}'."
            )
        rates = [f"der({name})" for name in self.states if f"der({name})" in fmu.variables]
        exchange = fmu.description.modelExchange is not None
        record = [name for name in dict.fromkeys((*measured, *rates)) if name not in self.states]
        # where events accumulate a guess is followed as far as it goes, and stays there
        self._driver = Driver(fmu, tolerance=TOLERANCE, record=record, on_zeno="hold" if exchange else "stop")
        self._step = STEP if exchange else STEP_OF_SOLVER
        if not exchange:
            self.note, self.states = SOLVER, ()
            self.by, self.recorded = self.parameters, tuple(measured)

    def trajectory(self, stretch: Stretch) -> Trajectory:
        return self._driver.run(float(stretch.times[-1]), output_times=stretch.times, **stretch.begin)

    def respond(self, stretch: Stretch) -> Response:
        given = {**stretch.values, **stretch.start}
        sizes = {name: abs(given[name]) or float(self.fmu.variables[name].nominal or 1.0) for name in self.by}
        steps = np.array([self._step * sizes[name] for name in self.by])
        rows = {name: np.full(1 + 2 * len(steps), value) for name, value in given.items()}
        for place, (name, step) in enumerate(zip(self.by, steps, strict=True)):
            rows[name][1 + 2 * place : 3 + 2 * place] += -step, step
        values = self._swept(stretch, rows) if self.states else self._each(stretch, rows)
        below, above = (values[0] - values[1::2]), (values[2::2] - values[0])
        smaller = np.where(np.abs(below) < np.abs(above), below, above)
        jumps = np.abs(above - below) > JUMP * np.maximum(np.abs(above), np.abs(below))
        slopes = np.where(jumps, smaller, (above + below) / 2) / steps[:, None, None]
        return Response(values[0], np.moveaxis(slopes, 0, -1))

    def _swept(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        """(runs, n, k) of what is recorded, of runs of a method of integration."""
        sweep = self._driver.sweep(
            float(stretch.times[-1]),
            rows,
            start_time=stretch.start_time,
            inputs=stretch.inputs,
            output_times=stretch.times,
        )
        if sweep.failures:
            raise StickslipError(next(iter(sweep.failures.values())))
        return np.stack([sweep[name] for name in self.recorded], axis=2)

    def _each(self, stretch: Stretch, rows: Mapping[str, Vector]) -> Vector:
        """The same of co-simulations, one after the other."""
        runs = range(len(next(iter(rows.values()))))
        return np.array(
            [
                self.values(replace(stretch, values={name: float(rows[name][run]) for name in stretch.values}))
                for run in runs
            ]
        )


def is_hit(event: Event) -> bool:
    """Whether a contact begins to touch or to slip: what is heard of it."""
    return event.clock in ("impact", "slip")


def subject_of(fmu: Fmu, parameters: Sequence[str], measured: Sequence[str]) -> Subject:
    """The FMU with what is asked of it."""
    return (OwnSubject if fmu.ours else ForeignSubject)(fmu, parameters, measured)
