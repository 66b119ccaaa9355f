"""Co-simulation of several units: each integrates itself over a step, values pass at communication points.

    at a point:   exchange of all values, stage by stage (loops by Newton's method)
    step of h:    inputs of the units, held over the step at what they are expected to be in its middle,
                      u + (u - u_before) h / (2 h_before)
                  an input whose rate is fed too keeps its value; the unit itself follows the rate
    jacobi:       all units from these inputs
    gauss-seidel: one after another; what earlier ones have reached is known, so that the middle is a mean of two ends
    event inside: the unit handles it and goes on; the others learn of it at the next point. The step after holds inputs
    control:      one step of h and two of h/2 are compared, so that points gather at events; every unit must be able
                  to put itself back

The error of a run falls like h**2 where the motion is smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import byref
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.composite import Composite, library
from fmu_models.coupling.stepper import UnitStepper
from fmu_models.coupling.wiring import split
from fmu_models.importer import instance, request
from fmu_models.importer.instance import STATUS, F
from fmu_models.importer.motion_error import MotionError
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import ForeignEvent, Trajectory

if TYPE_CHECKING:
    from fmu_models.coupling.system import CoupledSystem

CONTROL_TOLERANCE = 1e-4  # a method of second order needs too many steps for much less
UNIT_TOLERANCE = 1e-8  # of the units' own integration: well below what the exchange costs
SHORTEST = 1e-9  # of the run: a jump is stepped over rather than resolved further


def co_simulate(
    system: CoupledSystem,
    solver: str,
    *,
    output_times: ArrayLike | None = None,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Step the units of ``system`` by "jacobi" or "gauss-seidel"; see ``couple``. MotionError: a unit fails;
    StickslipError: steps are to be controlled, but a unit cannot be put back."""
    for name, unit in system.units.items():
        if unit.fmu.description.coSimulation is None:
            raise StickslipError(
                f"The unit '{name}' has no Co-Simulation, which '{solver}' needs. "
                "Where all units have Model Exchange, choose the solver 'auto'."
            )
    run = _CoSimulation(system, solver)
    try:
        times = (
            None if output_times is None else request.output_times(output_times, system.start_time, system.stop_time)
        )
        return run.made(times, progress)
    finally:
        run.composite.close()


class _CoSimulation:
    """The units between two communication points, and what has been recorded."""

    def __init__(self, system: CoupledSystem, solver: str) -> None:
        self.system, self.sequential = system, solver == "gauss-seidel"
        self.composite = Composite(system, co_simulation=True)
        self.events: list[ForeignEvent] = []
        instances = zip(self.composite.names, self.composite.instances, strict=True)
        self.steppers = [UnitStepper(name, unit_instance, self._note) for name, unit_instance in instances]
        self.fixed = [stepper.name for stepper in self.steppers if not stepper.puts_back]
        if system.adaptive and self.fixed:
            raise StickslipError(
                f"Steps are controlled by trying them, but the unit '{self.fixed[0]}' cannot be put back "
                "(canGetAndSetFMUState). Leave 'adaptive' out and choose a step."
            )
        stiff = [stepper.name for stepper in self.steppers if not stepper.any_step]
        if system.adaptive and stiff:
            raise StickslipError(f"The unit '{stiff[0]}' takes steps of one length only. Leave 'adaptive' out.")
        self.adaptive = system.adaptive if system.adaptive is not None else not (self.fixed or stiff or system.step)
        arrays, wires = self.composite.arrays, self.composite.wires
        n = len(wires)
        self.u, self.y = arrays["inputs"][:n], arrays["outputs"][: len(self.composite.ports)]
        self.source, self.factor, self.offset = (arrays[name][:n] for name in ("source", "factor", "offset"))
        fed = {wire.target for wire in wires}
        self.extrapolated = np.array(
            [(unit, f"{name}_rate") not in fed for unit, name in (w.target for w in wires)], bool
        )
        self.before, self.last = self.u.copy(), 0.0
        self.groups = [
            (int(g["unit"]), int(g["first"]), int(g["n"]), bool(g["discrete"])) for g in arrays["writes"] if g["n"]
        ]
        self.reads = [(int(g["unit"]), int(g["first"]), int(g["n"])) for g in arrays["reads"] if g["n"]]
        self.discrete = np.zeros(n, dtype=bool)
        for _, first, length, discrete in self.groups:
            self.discrete[first : first + length] = discrete
        self.expected = self.extrapolated & ~self.discrete
        self.own_groups: list[list[tuple[int, int]]] = [[] for _ in self.steppers]
        for unit, first, length, discrete in self.groups:
            if not discrete:
                self.own_groups[unit].append((first, length))
        self.own_reads: list[list[tuple[int, int]]] = [[] for _ in self.steppers]
        for unit, first, length in self.reads:
            self.own_reads[unit].append((first, length))
        self.passed: dict[tuple[str, int], tuple[Any, ...]] = {}
        self.fed = self._fed([wire.source[0] for wire in wires])
        fmu = self.composite.fmu
        states = [name for name in self.composite.states if name in fmu.variables]
        names = list(system.outputs) or list(dict.fromkeys([*states, *request.recordable(fmu)]))
        self.recorded = request.Selection.of(fmu, names)
        self.controlled = request.Selection.of(fmu, states)
        self.nominal = np.array([self._nominal(name) for name in states])
        self.largest = np.zeros(len(states) + self.y.size)
        self.steps = self.rejected = self.forced = 0
        span = system.start_time, system.stop_time
        self.inputs = signals_of(fmu, system.values("inputs"), *span)
        moving = {name: signal for name, signal in self.inputs.items() if isinstance(signal, Signal)}
        self.driven = request.table(fmu, moving, *span)
        # an input whose rate is given too: the unit itself follows it
        names = self.driven.inputs.names
        self.follows = np.array([f"{name}_rate" in names for name in names], dtype=bool)

    def _fed(self, sources: list[str]) -> list[NDArray[np.int_]]:
        """The inputs that each unit feeds and that are expected ahead, by their places."""
        unit_index = {name: unit for unit, name in enumerate(self.composite.names)}
        fed_inputs: list[list[int]] = [[] for _ in self.steppers]
        for i, source in enumerate(sources):
            if self.expected[i]:
                fed_inputs[unit_index[source]].append(i)
        return [np.array(places, dtype=int) for places in fed_inputs]

    def _nominal(self, name: str) -> float:
        unit, variable = split(self.system.fmus, name, self.system.name)
        stated = self.system.units[unit].fmu.variables[variable].nominal
        return abs(float(stated)) if stated else 1.0

    def _note(self, time: float, kind: str, name: str) -> None:
        self.events.append(ForeignEvent(time, kind, -1, name, 0.0, 0.0, (), ()))

    def _initialize(self) -> None:
        system, c = self.system, self.composite.c
        c.tolerance, c.start, c.stop = UNIT_TOLERANCE, system.start_time, system.stop_time
        values_by_name = system.values("parameters") | system.values("start")
        values_by_name |= self.inputs | dict(zip(self.driven.inputs.names, self.driven.values[0].tolist(), strict=True))
        chosen = request.Selection.of(self.composite.fmu, list(values_by_name))
        values = np.array(list(values_by_name.values()), dtype=float)
        calls = byref(self.composite.calls)
        self._checked(library().fmi_write(calls, byref(chosen.c), values.ctypes.data), "setting its values")
        for function in (F.ENTER_INITIALIZATION, F.EXIT_INITIALIZATION):
            self._checked(library().fmi_plain(calls, function), "initialization")
        for stepper in self.steppers:
            stepper.begin(system.start_time)
        self.time = system.start_time
        self._exchange()
        self.before = self.u.copy()

    def _checked(self, status: int, action: str) -> None:
        if status >= STATUS.DISCARD:
            time = getattr(self, "time", self.system.start_time)
            raise MotionError(f"{action} fails at t = {time:.9g} s: {self.composite.message()}", "fmi error", time)

    def _exchange(self) -> None:
        """All values at a communication point; discrete ones by events of the units that take them."""
        earlier = self.u.copy()
        self._checked(library().coupling_exchange(byref(self.composite.c), 0), "the exchange of values")
        if not any(discrete for *_, discrete in self.groups):
            return
        for unit, first, n in self.reads:
            self._read(unit, first, n)
        self.u[:] = np.where(self.discrete, self.factor * self.y[self.source] + self.offset, self.u)
        for unit, first, n, discrete in self.groups:
            if discrete and (self.u[first : first + n] != earlier[first : first + n]).any():
                self.steppers[unit].event(self.time, lambda unit=unit, first=first, n=n: self._write(unit, first, n))
                self._note(self.time, "input", self.composite.names[unit])
        self._checked(library().coupling_exchange(byref(self.composite.c), 0), "the exchange of values")

    def _write(self, unit: int, first: int, n: int) -> int:
        return self._pass(library().fmi_write, unit, first, n, "input", self.u)

    def _read(self, unit: int, first: int, n: int) -> None:
        self._checked(self._pass(library().fmi_read, unit, first, n, "output", self.y), "reading outputs")

    def _pass(
        self, call: Callable[..., int], unit: int, first: int, n: int, kind: str, values: NDArray[np.float64]
    ) -> int:
        if (kind, first) not in self.passed:
            types, references = (self.composite.arrays[f"{kind}_{suffix}"] for suffix in ("types", "references"))
            at = instance.Variables(n, types[first:].ctypes.data, references[first:].ctypes.data)
            self.passed[kind, first] = byref(self.steppers[unit].calls), byref(at), values[first:].ctypes.data
        return call(*self.passed[kind, first])

    def _drive(self, ahead: float = 0.0) -> None:
        """Inputs from outside as they are ``ahead`` s from here, without a jump between."""
        table = self.driven
        if table.inputs.names:
            row = int(np.searchsorted(table.times, self.time, side="right")) - 1
            passed = self.time - table.times[row] + np.where(self.follows, 0.0, ahead)
            values = np.ascontiguousarray(table.values[row] + table.slopes[row] * passed)
            calls, chosen = byref(self.composite.calls), table.inputs.c
            self._checked(library().fmi_write(calls, byref(chosen), values.ctypes.data), "setting its inputs")

    def _jump(self, latest: float) -> float:
        """The next time at which an input from outside jumps, or ``latest``."""
        jumps = self.driven.times[self.driven.jumps == request.JUMP]
        return float(min(jumps[jumps > self.time].min(initial=latest), latest))

    def _step(self, end: float) -> None:
        """All units from here to ``end``, with the exchange there."""
        h, start, noted = end - self.time, self.u.copy(), len(self.events)
        slope = (start - self.before) * (0.5 * h / self.last) if self.last > 0.0 else np.zeros_like(start)
        self.u[:] = start + np.where(self.expected, slope, 0.0)
        self._drive(0.5 * h)
        for unit, stepper in enumerate(self.steppers):
            for first, n in self.own_groups[unit]:
                self._checked(self._write(unit, first, n), f"setting the inputs of unit '{stepper.name}'")
            stepper.step(self.time, end)
            if self.sequential:
                for first, n in self.own_reads[unit]:
                    self._read(unit, first, n)
                fed = self.fed[unit]
                reached = self.factor[fed] * self.y[self.source[fed]] + self.offset[fed]
                self.u[fed] = 0.5 * (start[fed] + reached)
        self.time, self.last = end, h
        self.u[:] = start
        self._drive()
        self._exchange()
        self.before = start
        self.steps += 1
        if len(self.events) > noted:
            # a slope across an event expects nothing of what follows it
            self.last = 0.0

    @contextmanager
    def _saved(self) -> Iterator[Callable[[], None]]:
        """The function that puts all units back to here."""
        states = [(stepper, stepper.save(self.time)) for stepper in self.steppers]
        point = self.time, self.last, self.u.copy(), self.before.copy(), self.y.copy(), len(self.events)

        def put_back() -> None:
            for stepper, state in states:
                stepper.put_back(state, self.time)
                stepper.ended = False
            self.time, self.last = point[0], point[1]
            self.u[:], self.before, self.y[:] = point[2], point[3].copy(), point[4]
            del self.events[point[5] :]

        try:
            yield put_back
        finally:
            for stepper, state in states:
                stepper.free(state)

    def _selected(self, selection: request.Selection, action: str) -> NDArray[np.float64]:
        """Present values of a selection of variables."""
        values = np.zeros(len(selection.names))
        calls = byref(self.composite.calls)
        self._checked(library().fmi_read(calls, byref(selection.c), values.ctypes.data), action)
        return values

    def _observed(self) -> NDArray[np.float64]:
        return np.concatenate([self._selected(self.controlled, "reading states"), self.y])

    def _control(self, h: float, latest: float, shortest: float) -> float:
        """One accepted pair of steps of h/2 or less; the length to try next."""
        tolerance = self.system.tolerance or CONTROL_TOLERANCE
        with self._saved() as put_back:
            while True:
                start = self.time
                end = latest if start + h * (1 + 1e-9) >= latest else start + h
                h = end - start
                self._step(end)
                single = self._observed()
                put_back()
                self._step(start + 0.5 * h)
                self._step(end)
                halves = self._observed()
                self.largest = np.maximum(self.largest, np.abs(halves))
                nominal = np.concatenate([self.nominal, np.zeros(self.y.size)])
                scale = np.maximum(nominal + np.abs(halves), np.maximum(self.largest, 1e-12))
                error = float(np.max(np.abs(single - halves) / scale, initial=0.0)) / (3.0 * tolerance)
                factor = min(3.0, max(0.2, 0.9 * max(error, 1e-12) ** (-1.0 / 3.0)))
                if error <= 1.0 or h <= shortest:
                    self.forced += error > 1.0
                    return max(h * factor, shortest)
                self.rejected += 1
                put_back()
                h = max(h * min(factor, 0.5), shortest)

    def made(self, times: NDArray[np.float64] | None, progress: Callable[[float], None] | None) -> Trajectory:
        system = self.system
        span = system.stop_time - system.start_time
        h = system.step or span / 1000
        self._initialize()
        points, rows = [], []
        index, next_output = 1, 0
        while True:
            due = times is None
            while times is not None and next_output < times.size and times[next_output] <= self.time:
                due, next_output = True, next_output + 1
                points.append(times[next_output - 1])
                rows.append(self._record())
            if times is None and due:
                points.append(self.time)
                rows.append(self._record())
            if self.time >= system.stop_time or any(stepper.ended for stepper in self.steppers):
                break
            latest = (
                system.stop_time
                if times is None or next_output >= times.size
                else min(times[next_output], system.stop_time)
            )
            latest = self._jump(latest)
            if self.adaptive:
                cut = latest - self.time < h
                proposed = self._control(h, latest, SHORTEST * span)
                h = max(h, proposed) if cut else proposed
            else:
                grid = system.start_time + index * h
                while grid <= self.time + 1e-9 * h:
                    index += 1
                    grid = system.start_time + index * h
                end = latest if grid > latest - 1e-9 * h else grid
                self._step(end)
            if progress:
                progress((self.time - system.start_time) / span)
        for stepper in self.steppers:
            library().fmi_plain(byref(stepper.calls), F.TERMINATE)
        return self._trajectory(np.array(points), np.array(rows).reshape(len(points), -1))

    def _record(self) -> NDArray[np.float64]:
        return self._selected(self.recorded, "reading values")

    def _trajectory(self, times: NDArray[np.float64], rows: NDArray[np.float64]) -> Trajectory:
        variables = self.composite.fmu.variables
        values = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(self.recorded.names)}
        units = {name: str(variables[name].unit or "1") for name in values}
        note = f"co-simulation of {len(self.steppers)} units by {'Gauss-Seidel' if self.sequential else 'Jacobi'}"
        note += ", steps controlled" if self.adaptive else ", fixed step"
        if self.fixed:
            note += f", because {', '.join(self.fixed)} cannot be put back"
        if self.forced:
            note += f"; {self.forced} steps of the shortest length missed the tolerance"
        remarks = {stepper.name: stepper.instance.remark for stepper in self.steppers if stepper.instance.remark}
        note += "".join(f"; unit '{name}' {remark}" for name, remark in remarks.items())
        ended = [stepper.name for stepper in self.steppers if stepper.ended]
        if ended:
            note += f"; unit '{ended[0]}' ended the run at t = {self.time:.9g} s"
        return Trajectory(times, values, units, tuple(self.events), self.steps, self.rejected, note)
