"""Simulate any FMU by the compiled master: methods of integration with events for Model Exchange, or Co-Simulation."""

from __future__ import annotations

import ctypes
import math
import os
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.codegen.c_structures import declarations
from fmu_models.fmu.elements import owner
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import instance, request, structure, text_calls, texts
from fmu_models.importer.batch import Batch, begun
from fmu_models.importer.clocks import Clocks, check_event_mode, merged
from fmu_models.importer.motion_error import RUN, ZENO, MotionError, indicator_name, motion_error
from fmu_models.importer.words import note, nothing_to_record
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.trajectory import ForeignEvent, Trajectory

_C = declarations("importer/c/master.h")
METHODS = {n.lower().replace("_", "-"): k for n, k in vars(_C.constants("MethodChoice", "METHOD_")).items()}
CO_SIMULATION, SCHEDULED = "co-simulation", "scheduled"
EVENT_KINDS = {number: name.lower() for name, number in vars(_C.constants("EventKind", "EVENT_")).items()}
ON_ZENO = {name.lower(): number for name, number in vars(ZENO).items()}
EVENT_CAPACITY, EVENT_NUMBERS = 4096, 1 << 20  # between two calls of the master; states of them, each twice
ALLOWANCE = 20000  # steps per call: how long an interrupt from the keyboard waits
TOLERANCES = (1e-14, 0.1)


class Driver(Shown):
    """An FMU that is loaded once and run many times.

    Args:
        fmu: an opened FMU or its file.
        method: "dopri5", "dop853" (explicit), "stiff", "auto" (begins explicit, changes to stiff where stability limits
            the steps) for Model Exchange; "co-simulation"; "scheduled" (execution). By "auto" an FMU without Model
            Exchange is co-simulated, and one without either is scheduled.
        tolerance: relative error of a step; the absolute one is this times the nominal value of the state.
        record: names of variables to record beside the states; None: inputs, derivatives of states, outputs. Texts and
            bytes among them are read at both ends of a run.
        max_step: s, longest step of a method of integration, which sees an FMU at its steps' nodes only: what lasts
            less than a quarter of a step may be missed. Default: the step of the FMU's own experiment, or a 500th of
            it, where it states one, and no less than a ten thousandth of the run; ``math.inf`` for no bound.
        structural_parameters: values of those on which sizes of arrays depend (FMI 3).
        on_zeno: where infinitely many events accumulate: "stop" (an error with the limit time), "hold" (the states stay
            as they are there, if nothing else moves), "continue" (whatever the FMU does then).

    Raises:
        StickslipError: unknown method or variable, tolerance out of range, an FMU without the interface or the library.
    """

    def __init__(
        self,
        fmu: Fmu | str | os.PathLike[str],
        *,
        method: str = "auto",
        tolerance: float = 1e-8,
        record: Sequence[str] | None = None,
        on_zeno: str = "stop",
        max_step: float | None = None,
        structural_parameters: Mapping[str, float] | None = None,
    ) -> None:
        refuse_unknown(method, METHODS, f"There is no method '{method}'.")
        least, largest = TOLERANCES
        if not (math.isfinite(tolerance) and least <= tolerance <= largest):
            raise StickslipError(f"The tolerance must lie between {least:g} and {largest:g}, found {tolerance:g}.")
        if on_zeno not in ON_ZENO:
            raise StickslipError(f"Where events accumulate a run can {', '.join(ON_ZENO)}; found '{on_zeno}'.")
        self._opened = fmu if isinstance(fmu, Fmu) else Fmu.open(fmu)
        self._structure = dict(structural_parameters or {})
        self.fmu = structure.configured(self._opened, self._structure)
        if method == "auto" and self.fmu.description.modelExchange is None:
            method = CO_SIMULATION if self.fmu.description.coSimulation else SCHEDULED
        integrates = method not in (CO_SIMULATION, SCHEDULED)
        if not integrates and on_zeno == "hold":
            raise StickslipError(f"'hold' where events accumulate belongs to methods of integration, found {method}.")
        if max_step is not None and not integrates:
            raise StickslipError(
                f"A longest step belongs to methods of integration, found {method}, which has communication steps."
            )
        self._max_step = None if max_step is None else request.checked_step("longest", max_step, endless=True)
        if method == CO_SIMULATION and self.fmu.ours:
            on_zeno = "continue"  # its contacts come to rest
        if record is not None:
            request.check_recorded(self.fmu, record)
        self.method, self.tolerance, self._integrates = method, float(tolerance), integrates
        if method == CO_SIMULATION and self.fmu.description.coSimulation:
            check_event_mode(self.fmu, offered=bool(self.fmu.description.coSimulation.hasEventMode))
        self._instance = self._load()
        if method == CO_SIMULATION and not self._instance.calls.event_mode:
            try:
                check_event_mode(self.fmu, offered=False)
            except StickslipError:
                self._instance.close()
                raise
        self._states = self._instance.states if integrates else []
        names = list(record) if record is not None else request.recordable(self.fmu)
        self._texts = (
            [n for n in names if texts.is_text(self.fmu, n)] if record is not None else texts.outputs(self.fmu)
        )
        names = [name for name in names if name not in self._texts]
        if not integrates:
            owners = dict.fromkeys(owner(name, self.fmu.variables) for name in self._instance.states)
            names = [*(name for name in owners if name in self.fmu.variables and name not in names), *names]
        state_owners = {owner(name, self.fmu.variables) for name in self._states}
        names_left = [name for name in names if name not in state_owners]
        self.clocks = Clocks(self.fmu, names_left)
        clocked = set(self.clocks.recorded.names)
        unclocked = [name for name in names_left if not (self.clocks.all and self.fmu.variables[name].clocks)]
        self._recorded = request.Selection.of(self.fmu, unclocked)
        if not (self._states or self._recorded.names or clocked):
            self._instance.close()
            raise StickslipError(nothing_to_record(self.fmu))
        shapes = {name: v.shape for name, v in self.fmu.variables.items() if v.shape}
        self._arrays = {n: shapes[n] for n in (*state_owners, *names) if n in shapes}
        self._library = instance.master_library()
        self._master = self._library.master_new(
            ctypes.byref(self._instance.calls),
            len(request.Selection.of(self.fmu, request.inputs_of(self.fmu)).names),
            max(len(self._recorded.names), len(self.clocks.recorded.names)),
        )
        if not self._master:
            self._instance.close()
            raise StickslipError(f"There is not enough memory for the {len(self._states)} states of '{self.fmu.path}'.")
        self._finalizer = weakref.finalize(self, _close, self._library.master_free, self._master, self._instance)
        self._gradient = np.zeros(max(1, len(self._states)))
        self._indicators = [indicator_name(self.fmu, i) for i in range(self._instance.calls.n_indicators)]
        # of many states fewer at a time, but what may come at one instant
        capacity = max(min(EVENT_CAPACITY, EVENT_NUMBERS // max(1, len(self._states))), len(self._indicators) + 16)
        self._events = np.empty(capacity, dtype=instance.EVENT)
        self._event_states = np.empty((capacity, 2, len(self._states)))
        numbers = {name: k for k, name in enumerate(self._instance.derivatives)}
        self._rates = np.array([numbers.get(name, -1) for name in (*self._recorded.names, "")], dtype=np.int32)
        self._starts: dict[tuple[str, ...], request.Selection] = {}
        self._units: dict[str, str] = {}
        # what all runs have in common
        self._blank = instance.Run(
            tolerance=self.tolerance,
            method=METHODS[method],
            recorded=self._recorded.c,
            recorded_rates=request.address(self._rates),
            n_clocks=len(self.clocks.all),
            clocked=self.clocks.recorded.c,
            event_capacity=self._events.size,
            on_zeno=ON_ZENO[on_zeno],
            events=request.address(self._events),
            event_states=request.address(self._event_states),
            allowance=ALLOWANCE,
            report_gradient=request.address(self._gradient),
        )

    def _load(self) -> instance.Instance:
        by = {"co_simulation": self.method == CO_SIMULATION, "scheduled": self.method == SCHEDULED}
        return instance.Instance(self.fmu, structure=self._structure, **by)

    def _contents(self) -> dict[str, object]:
        return {"model": self.fmu.description.modelName, "method": self.method, "tolerance": self.tolerance}

    def __enter__(self) -> Driver:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the FMU; the driver cannot run it any more."""
        self._finalizer()

    def run(
        self,
        stop_time: float,
        *,
        start_time: float = 0.0,
        parameters: Mapping[str, float | str | bytes] | None = None,
        start: Mapping[str, float | str | bytes] | None = None,
        inputs: Mapping[str, Any] | None = None,
        output_times: ArrayLike | None = None,
        communication_step: float | None = None,
        first_step: float | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Trajectory:
        """Run from ``start_time`` to ``stop_time`` (s), from the FMU's own start values but for those given.

        Args:
            parameters, start: values of parameters, and of other variables that have a start value, in the FMU's units.
                A String takes text, a Binary bytes, hex text ``0x00ff`` or a file ``@path``.
            inputs: as for ``simulate``; jumps are events, bends end steps. Texts are constant.
            output_times: (n,) s, ascending, within the run; default 1001 equally spaced, or the communication points.
            communication_step: s, of a co-simulation; default: what the FMU recommends, or a thousandth of the run.
            first_step: s, of a method of integration; chosen by error control where not given.
            progress: called with the fraction of output times done.

        Returns:
            The trajectory; it ends early where the FMU ends the run by itself.

        Raises:
            MotionError: the run cannot be continued; says when and why (chattering, Zeno, an error of the FMU, ...).
            StickslipError: unknown name, value out of range, times out of order.
        """
        times = request.output_times(output_times, start_time, stop_time)
        words, (parameters, start, inputs) = texts.settings(self.fmu, parameters or {}, start or {}, inputs or {})
        initial = request.start_values(self.fmu, parameters, start)
        ticking, others = self.clocks.split(signals_of(self.fmu, inputs, start_time, stop_time), start_time)
        table = request.table(self.fmu, others, start_time, stop_time)
        between = table
        if self.method == CO_SIMULATION:
            length = request.communication_step(self.fmu, communication_step, start_time, stop_time)
            requested = times if output_times is not None else None
            points = request.communication_points(self.fmu, length, start_time, stop_time, requested, table)
            times, table = points if requested is None else requested, request.at_points(table, points)
        elif communication_step is not None:
            raise StickslipError(f"A communication step belongs to the method 'co-simulation', not to '{self.method}'.")
        prepared = self._prepare(times, initial, table, start_time, stop_time, ticking)
        prepared.c.n_shown, prepared.c.shown_times = between.times.size, request.address(between.times)
        prepared.c.shown_values, prepared.c.shown_rates = map(request.address, (between.values, between.slopes))
        prepared.c.first_step = request.checked_step("first", first_step) if first_step is not None else 0.0
        if words:
            self._check_open()
            text_calls.write(self._instance, words)
        events: list[ForeignEvent] = []
        first: dict[str, str | bytes] = {}
        prepared.c.allowance = 0 if self._texts else ALLOWANCE
        status = RUN.MORE
        while status == RUN.MORE:
            status = self._call(prepared)
            if not prepared.c.allowance and status in (RUN.MORE, RUN.DONE, RUN.TERMINATED):
                first, prepared.c.allowance = text_calls.read(self._instance, self._texts), ALLOWANCE
            events += self._take_events(prepared)
            prepared.c.n_events = prepared.c.n_ticks = 0
            if progress:
                progress(prepared.c.next_time / max(1, times.size))
        if status not in (RUN.DONE, RUN.TERMINATED):
            error = self._error(status, prepared.c)
            raise error.after(self._trajectory(prepared, times, tuple(events), status, first))
        return self._trajectory(prepared, times, tuple(events), status, first)

    def batch(
        self,
        stop_time: float,
        names: tuple[str, ...],
        *,
        start_time: float = 0.0,
        inputs: Mapping[str, Any] | None = None,
        output_times: ArrayLike | None = None,
    ) -> Batch:
        """What many runs over values of ``names`` have in common. Output times default to the end alone.
        StickslipError: as for ``run``; a co-simulation; values are looked at when runs are made."""
        if self.method in (CO_SIMULATION, SCHEDULED):
            raise StickslipError("A batch needs a method of integration; run a co-simulation once per value.")
        if self.clocks.recorded.names:
            raise StickslipError(
                f"A batch records no variables that have clocks, as '{self.clocks.recorded.names[0]}'. Run once per "
                "value."
            )
        times = request.output_times([stop_time] if output_times is None else output_times, start_time, stop_time)
        table = request.table(
            self.fmu, signals_of(self.fmu, inputs or {}, start_time, stop_time), start_time, stop_time
        )
        first = begun(self.fmu, names)
        prepared = self._prepare(times, first, table, start_time, stop_time)
        prepared.c.event_capacity = 0
        recorded = (*self._states, *self._recorded.names)
        return Batch(self.fmu, names, first, times, recorded, len(self._states), prepared, self._call, self._reason)

    def _reason(self, status: int, c: ctypes.Structure) -> str:
        """Why a run ended early."""
        return self._end(c) if status == RUN.TERMINATED else str(self._error(status, c))

    def _prepare(
        self,
        times: NDArray[np.float64],
        initial: Mapping[str, float],
        table: request.InputTable,
        start_time: float,
        stop_time: float,
        ticking: Mapping[str, NDArray[np.float64]] | None = None,
    ) -> _Prepared:
        key = tuple(initial)
        if key not in self._starts:
            self._starts[key] = request.Selection.of(self.fmu, key)
        starts = self._starts[key]
        start_values = np.array(list(initial.values()), dtype=float)
        states = np.empty((times.size, len(self._states)))
        values = np.empty((times.size, len(self._recorded.names)))
        c = instance.Run.from_buffer_copy(self._blank)
        c.start, c.stop, c.n_times = start_time, stop_time, times.size
        bound = request.StepBound.of(self.fmu, self._max_step, start_time, stop_time)
        c.longest_step = bound.longest if self._integrates else 0.0
        c.starts, c.start_values = starts.c, request.address(start_values)
        c.times, c.states, c.values = map(request.address, (times, states, values))
        c.inputs, c.n_knots = table.inputs.c, table.times.size
        c.knot_times, c.knot_values = request.address(table.times), request.address(table.values)
        c.knot_rates, c.knot_jumps = request.address(table.slopes), request.address(table.jumps)
        clocks, kept_values, ticks = self.clocks.c(ticking or {})
        clocked = np.empty((times.size, len(self.clocks.recorded.names)))
        c.clocks, c.kept, c.clocked_values = (
            ctypes.addressof(clocks),
            ctypes.addressof(kept_values),
            request.address(clocked),
        )
        c.ticks, c.tick_capacity = request.address(ticks), ticks.size
        flags = np.zeros(len(table.inputs.names), dtype=np.int32)
        if self.method == CO_SIMULATION:
            owners = [self.fmu.variables[owner(name, self.fmu.variables)] for name in table.inputs.names]
            flags[:] = [self._instance.shows(v) for v in owners]
        c.shown_inputs = request.address(flags)
        used = starts, table, times, ticking, kept_values, flags
        return _Prepared(c, start_values, states, values, clocked, clocks, ticks, used)

    def _check_open(self) -> None:
        if not self._finalizer.alive:
            raise StickslipError("The driver is closed. Make a new one.")

    def _call(self, prepared: _Prepared) -> int:
        self._check_open()
        if not prepared.c.begun:
            self._instance.log.count = 0
            self._instance.log.message = b""
            if self._instance.calls.resets:
                self._instance.log.warnings = 0
                self._instance.renew()
        status = self._library.master_run(self._master, ctypes.byref(prepared.c))
        # from now on there is a run behind the instance
        self._instance.calls.resets = 1
        return status

    def _take_events(self, prepared: _Prepared) -> Iterator[ForeignEvent]:
        n, names = prepared.c.n_events, self.clocks.names
        ticks: dict[float, list[str]] = {}
        for time, clock in prepared.ticks[: prepared.c.n_ticks].tolist():
            ticks.setdefault(time, []).append(names[clock])
        yield from merged(self._events_of(n), ticks) if ticks else self._events_of(n)

    def _events_of(self, n: int) -> Iterator[ForeignEvent]:
        if not n:
            return
        rows = zip(self._events[:n].tolist(), self._event_states[:n].tolist(), strict=True)
        for (time, kind, i, before, after), (old, new) in rows:
            name = self._indicators[i] if i >= 0 else ""
            yield ForeignEvent(time, EVENT_KINDS[kind], i, name, before, after, tuple(old), tuple(new))

    def _error(self, status: int, c: ctypes.Structure) -> MotionError:
        return motion_error(self.fmu, status, c, self._states, self._gradient, self._instance.message())

    def _end(self, c: ctypes.Structure) -> str:
        message = self._instance.message()
        return f"the FMU ended the run at t = {c.report_time:.9g} s" + (f": {message}" if message else "")

    def _trajectory(
        self,
        prepared: _Prepared,
        times: NDArray[np.float64],
        events: tuple[ForeignEvent, ...],
        status: int,
        first: Mapping[str, str | bytes],
    ) -> Trajectory:
        n = prepared.c.next_time
        variables = self.fmu.variables
        values: dict[str, NDArray] = {}
        for k, name in enumerate(self._states):
            values[name] = np.ascontiguousarray(prepared.states[:n, k])
        for selection, table in ((self._recorded, prepared.values), (self.clocks.recorded, prepared.clocked)):
            for name, kind, column in zip(selection.names, selection.types.tolist(), table[:n].T, strict=True):
                values[name] = column.astype(np.int64) if kind not in instance.FLOATS else np.ascontiguousarray(column)
        if not self._units:
            owners = {name: variables.get(owner(name, variables)) for name in values}
            self._units |= {name: str((v and v.unit) or "1") for name, v in owners.items()}
        method = note(self.method, prepared.c)
        if self._integrates:
            method += request.StepBound.of(self.fmu, self._max_step, prepared.c.start, prepared.c.stop).words
        if prepared.c.jacobians and self._instance.calls.directional:
            method += ", Jacobians by the FMU's directional derivatives"
        if remark := self._instance.remark:
            method += f", {remark}"
        if silent := self.clocks.silent(prepared.clocks):
            method += f"; {silent}"
        if status == RUN.TERMINATED:
            method += f"; {self._end(prepared.c)}"
        last = text_calls.read(self._instance, self._texts)
        method += texts.untold(self.fmu, self._texts, {*first} & {*last})
        pairs = {name: (first[name], value) for name, value in last.items() if name in first}
        steps, evaluations = prepared.c.steps, prepared.c.evaluations
        return Trajectory(
            times[:n], values, self._units, events, steps, evaluations, method, arrays=self._arrays, texts=pairs
        )


@dataclass(frozen=True, eq=False)
class _Prepared:
    """A request for the master, and the arrays it points into."""

    c: Any
    start_values: NDArray[np.float64]
    states: NDArray[np.float64]
    values: NDArray[np.float64]
    clocked: NDArray[np.float64]
    clocks: Any
    ticks: NDArray[Any]
    kept: tuple[object, ...]


def _close(free: Callable[[int], None], master: int, instance: instance.Instance) -> None:
    free(master)
    instance.close()
