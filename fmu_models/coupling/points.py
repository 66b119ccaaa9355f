"""The communication points of a co-simulation: values that pass between its units, and inputs from outside."""

from __future__ import annotations

from concurrent.futures import Executor, Future, wait
from ctypes import byref
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.composite import Composite, library
from fmu_models.coupling.control import joined
from fmu_models.coupling.histories import POINTS, Matrix, Vector
from fmu_models.coupling.order import discrete
from fmu_models.coupling.unit import SteppedUnit
from fmu_models.coupling.wiring import split
from fmu_models.importer import request
from fmu_models.importer.instance import STATUS, F
from fmu_models.importer.motion_error import MotionError
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import ForeignEvent

if TYPE_CHECKING:
    from fmu_models.coupling.system import CoupledSystem

UNIT_TOLERANCE = 1e-2  # of a unit's own integration, of what is asked for
ROUNDS = 20  # of values at events until they stay
SWEEPS = 8  # until slopes of signals through feed-through stay


class CommunicationPoints:
    """The units, and what passes between them at a point.

    Attributes:
        units: in the order of their names, on which nothing depends.
        u: (n_wires,) values at the targets of the wires.
        signals: places in ``u`` of the n signals: continuous inputs that are expected ahead. The rate of another input
            is none, as the unit is fed by that rate.
        places: of every unit, the places of its inputs among the signals.
        events: so far.
    """

    def __init__(self, system: CoupledSystem) -> None:
        self.system = system
        self.composite = Composite(system, co_simulation=True)
        self.events: list[ForeignEvent] = []
        self.time = system.start_time
        span = system.start_time, system.stop_time
        fmu, fmus, wires = self.composite.fmu, system.fmus, self.composite.wires
        values = signals_of(fmu, system.values("inputs"), *span)
        self._constant = {name: value for name, value in values.items() if not isinstance(value, Signal)}
        moving = {name: value for name, value in values.items() if isinstance(value, Signal)}
        self.driven = request.table(fmu, moving, *span)
        driven_names = [split(fmus, name, system.name) for name in self.driven.inputs.names]
        self.discrete = np.array([discrete(fmus[w.target[0]], w.target[1]) for w in wires], dtype=bool)
        inputs = {wire.target for wire in wires} | set(driven_names)
        followed = np.array([not self._is_rate(wire.target, inputs) for wire in wires], dtype=bool)
        self.signals = np.flatnonzero(~self.discrete & followed)
        targets = [wires[i].target for i in self.signals]
        rates = {wire.target: i for i, wire in enumerate(wires)}
        pairs = [(i, rates.get((unit, f"{name}_rate"))) for i, (unit, name) in enumerate(targets)]
        self._rates_fed = [(signal, rate) for signal, rate in pairs if rate is not None]
        looped = {wire.target for stage in self.composite.stages if stage.loop for wire in stage.wires}
        columns = [
            i for i, (unit, name) in enumerate(driven_names)
            if not discrete(fmus[unit], name) and not self._is_rate((unit, name), inputs)
        ]  # fmt: skip
        self.places = [np.array([i for i, (u, _) in enumerate(targets) if u == unit], dtype=int) for unit in fmus]
        self._columns = [np.array([i for i in columns if driven_names[i][0] == unit], dtype=int) for unit in fmus]
        ports = self.composite.ports
        continuous = [i for i, (unit, name) in enumerate(ports) if not discrete(fmus[unit], name)]
        self._ports = [np.array([i for i in continuous if ports[i][0] == unit], dtype=int) for unit in fmus]
        self.units = []
        for i, (unit, unit_instance) in enumerate(zip(fmus, self.composite.instances, strict=True)):
            names = [*(targets[k][1] for k in self.places[i]), *(driven_names[k][1] for k in self._columns[i])]
            outputs = [ports[k][1] for k in self._ports[i]]
            jumping = {name for u, name in looped if u == unit}
            self.units.append(SteppedUnit(unit, unit_instance, names, outputs, jumping, self.note))
        self._hold()
        n, arrays = len(wires), self.composite.arrays
        self.u, self.y = arrays["inputs"][:n], arrays["outputs"][: len(ports)]
        self.source, self.factor, self.offset = (arrays[name][:n] for name in ("source", "factor", "offset"))
        self._feeds = [
            [
                (int(np.flatnonzero(own == self.source[k])[0]), signal, float(self.factor[k]))
                for signal, k in enumerate(self.signals)
                if self.source[k] in own
            ]
            for own in self._ports
        ]
        self._discrete_groups()

    def _is_rate(self, port: tuple[str, str], inputs: set[tuple[str, str]]) -> bool:
        """Whether an input is the rate of another one that is fed or driven too."""
        unit, name = port
        return name.endswith("_rate") and (unit, name.removesuffix("_rate")) in inputs

    def _hold(self) -> None:
        """Inputs that never jump are not written at points, where their units have moved them themselves."""
        moved = {
            (unit.name, name)
            for unit in self.units
            for name, continuous in zip(unit.inputs, unit.continuous, strict=True)
            if continuous
        }
        self.composite.hold(moved)
        fed = {self.composite.wires[self.signals[signal]].target for signal, _ in self._rates_fed}
        self._steady = bool(moved - fed)
        names = self.driven.inputs.names
        self._free = [i for i, name in enumerate(names) if split(self.system.fmus, name, "") not in moved]
        self._written = request.Selection.of(self.composite.fmu, [names[i] for i in self._free])

    def _discrete_groups(self) -> None:
        """Of every unit: discrete outputs with their places in y, discrete inputs with their places in u."""
        fmus, self._reads, self._writes = self.system.fmus, [], []
        ports, wires = self.composite.ports, self.composite.wires
        for unit in self.units:
            fmu = fmus[unit.name]
            outputs = [i for i, (name, y) in enumerate(ports) if name == unit.name and discrete(fmu, y)]
            inputs = [i for i in np.flatnonzero(self.discrete) if wires[i].target[0] == unit.name]
            if outputs:
                selection = request.Selection.of(fmu, [ports[i][1] for i in outputs])
                self._reads.append((unit, selection, np.array(outputs), np.zeros(len(outputs))))
            if inputs:
                selection = request.Selection.of(fmu, [wires[i].target[1] for i in inputs])
                self._writes.append((unit, selection, np.array(inputs), np.zeros(len(inputs))))

    def note(self, time: float, name: str, kind: str = "state") -> None:
        self.events.append(ForeignEvent(time, kind, -1, name, 0.0, 0.0, (), ()))

    def check(self, status: int, action: str) -> None:
        if status >= STATUS.DISCARD:
            text = f"{action} fails at t = {self.time:.9g} s: {self.composite.message()}"
            raise MotionError(text, "fmi error", self.time)

    def begin(self, tolerance: float) -> None:
        """Initialize the units. MotionError: one fails, or values find no solution."""
        system, c = self.system, self.composite.c
        c.tolerance = max(UNIT_TOLERANCE * tolerance, 1e-13)
        c.start, c.stop = system.start_time, system.stop_time
        values_by_name = system.values("parameters") | system.values("start") | self._constant
        values_by_name |= dict(zip(self.driven.inputs.names, self.driven.values[0].tolist(), strict=True))
        chosen = request.Selection.of(self.composite.fmu, list(values_by_name))
        values = np.array(list(values_by_name.values()), dtype=float)
        calls = byref(self.composite.calls)
        self.check(library().fmi_write(calls, byref(chosen.c), values.ctypes.data), "setting its values")
        for function in (F.ENTER_INITIALIZATION, F.EXIT_INITIALIZATION):
            self.check(library().fmi_plain(calls, function), "initialization")
        for unit in self.units:
            unit.begin(system.start_time)
        self.exchange()

    def exchange(self) -> bool:
        """Pass all values; discrete ones by events of the units that take them. Whether one of these changed."""
        changed = False
        for _ in range(ROUNDS):
            self.check(library().coupling_exchange(byref(self.composite.c), 0), "the exchange of values")
            if not self._writes or not self._pass_discrete():
                return changed
            changed = True
        raise MotionError(
            f"values that change at events only go on changing at t = {self.time:.9g} s; units "
            f"{', '.join(unit.name for unit, *_ in self._writes)} feed one another. Break the ring of their discrete "
            "variables.",
            "event iteration",
            self.time,
        )

    def _pass_discrete(self) -> bool:
        for unit, selection, places, values in self._reads:
            status = library().fmi_read(byref(unit.instance.calls), byref(selection.c), values.ctypes.data)
            self.check(status, "reading outputs")
            self.y[places] = values
        changed = False
        for unit, selection, places, values in self._writes:
            values[:] = self.factor[places] * self.y[self.source[places]] + self.offset[places]
            if (values != self.u[places]).any():
                calls, chosen, data = byref(unit.instance.calls), byref(selection.c), values.ctypes.data
                unit.event(lambda calls=calls, chosen=chosen, data=data: library().fmi_write(calls, chosen, data))
                self.u[places] = values
                self.note(self.time, unit.name, "input")
                changed = True
        return changed

    def handle_events(self) -> None:
        """Event mode of the units that stand at an event."""
        for unit in self.units:
            if unit.pending:
                unit.event()

    def drive(self, *, jump: bool = False) -> None:
        """Inputs from outside as they are at this point; with ``jump`` also those that else never jump."""
        table = self.driven
        if not table.inputs.names or not (jump or self._free):
            return
        row = int(np.searchsorted(table.times, self.time, side="right")) - 1
        values = table.values[row] + table.slopes[row] * (self.time - table.times[row])
        chosen, free = (table.inputs, slice(None)) if jump else (self._written, self._free)
        written = np.ascontiguousarray(values[free])
        status = library().fmi_write(byref(self.composite.calls), byref(chosen.c), written.ctypes.data)
        self.check(status, "setting its inputs")
        if jump:
            for unit in self.units:
                unit.read_inputs()

    def jump(self, limits: Vector) -> None:
        """Signals (n,) that have jumped by more than ``limits`` reach also the inputs that else never jump."""
        values = self.u[self.signals]
        for unit, places in zip(self.units, self.places, strict=True):
            unit.jump(values[places], limits[places])

    def next_bend(self) -> tuple[float, bool]:
        """The next time at which a line from outside ends, and whether it jumps there."""
        row = int(np.searchsorted(self.driven.times, self.time, side="right"))
        if row >= self.driven.times.size:
            return np.inf, False
        return float(self.driven.times[row]), bool(self.driven.jumps[row] == request.JUMP)

    def unit_inputs(self, unit: int, series: Matrix, end: float) -> Matrix:
        """(7, n_inputs) what a unit is to follow to ``end``: its signals of ``series`` (7, n), lines from outside."""
        places, columns = self.places[unit], self._columns[unit]
        inputs = series[:, places]
        if not columns.size:
            return inputs
        table, h = self.driven, end - self.time
        row = int(np.searchsorted(table.times, self.time, side="right")) - 1
        lines = np.zeros((POINTS, columns.size))
        slopes = table.slopes[row, columns]
        lines[0] = table.values[row, columns] + slopes * (self.time - table.times[row] + 0.5 * h)
        lines[1] = 0.5 * h * slopes
        return np.hstack([inputs, lines])

    def step_abreast(self, pool: Executor, end: float, fed: Matrix) -> list[Future[float]]:
        """All units at once to ``end``, each in a thread, or to its first event; fed: (7, n) of the signals."""
        steps = [
            pool.submit(unit.step, end, self.unit_inputs(i, fed, end), unit.stops) for i, unit in enumerate(self.units)
        ]
        wait(steps)  # an error of one must not find another at work
        return steps

    def order_events(self, noted: int, end: float) -> None:
        """Keep each event behind the first ``noted`` ones once, up to ``end``: units may have gone beyond it."""
        events = {(event.time, event.name): event for event in self.events[noted:] if event.time <= end}
        self.events[noted:] = [event for _, event in sorted(events.items(), key=lambda item: item[0])]

    def slopes(self) -> Vector | None:
        """(n,) rates of the signals; None where a unit does not tell them."""
        previous = np.zeros(self.signals.size)
        for sweep in range(SWEEPS):
            self._set_rates(previous)
            rates = np.zeros(self.y.size)
            for unit, ports in zip(self.units, self._ports, strict=True):
                values = unit.slopes()
                if values is None:
                    return None
                rates[ports] = values
            slopes = self.factor[self.signals] * rates[self.source[self.signals]]
            size = np.abs(slopes).max(initial=0.0)
            if sweep and np.abs(slopes - previous).max(initial=0.0) <= 1e-6 * size:
                return slopes
            previous = slopes
        return None

    def _set_rates(self, rates: Vector) -> None:
        """Rates (n,) of the signals; one that is fed itself stays as it is fed."""
        rates = rates.copy()
        for signal, rate in self._rates_fed:
            rates[signal] = self.u[rate]
        for i, unit in enumerate(self.units):
            if unit.inputs:
                columns = self._columns[i]
                row = int(np.searchsorted(self.driven.times, self.time, side="right")) - 1
                unit.set_rates(np.concatenate([rates[self.places[i]], self.driven.slopes[row, columns]]))

    def expect_rates(self, rates: Vector) -> None:
        """Rates (n,) of the inputs that never jump, on which a body in contact may depend."""
        if self._steady:
            self._set_rates(rates)

    def responses(self) -> tuple[Matrix, Matrix, Matrix, Matrix, NDArray[np.bool_]]:
        """How the signals answer one another, as ``StepControl.answers`` takes it."""
        return joined([unit.response() for unit in self.units], self.places, self._feeds, self.signals.size)

    def refuse_rates_of_values(self) -> None:
        """StickslipError: the rate of an input is fed by what is not the rate of what feeds that input."""
        slopes = self.slopes()
        if slopes is None:
            return
        for signal, k in self._rates_fed:
            unit, name = self.composite.wires[self.signals[signal]].target
            if abs(self.u[k] - slopes[signal]) > 1e-3 * max(abs(self.u[k]), abs(slopes[signal])):
                wire = self.composite.wires[k]
                raise StickslipError(
                    f"'{unit}.{name}_rate' is fed by '{'.'.join(wire.source)}', which is {self.u[k]:g} at the start, "
                    f"where '{unit}.{name}' rises by {slopes[signal]:g} per second. Feed it by the rate of what feeds "
                    f"'{name}', or leave it out."
                )
