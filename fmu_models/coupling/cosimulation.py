"""Co-simulation of several units by a master of variable step and order.

    expect    inputs over the next step: polynomials of degree k through their values at the points accepted so far, and
              through their slopes where the units tell those of their outputs
    step      every unit follows them as well as it can (see ``unit``), to the end or to the first event of any
    exchange  all values at the point reached, loops by Newton's method
    control   how far the inputs are off there, weighed by what it does (see ``control``): accept, or put back and try
              a shorter step. Where a unit cannot be put back, the step is kept and the next one is shorter
    event     what a unit tells behind it belongs to no polynomial: event mode, exchange, and a new history of one point
              with its slopes. One that is found by a long step is approached by two more, so that lines have no bend on
              the last; an event without a word, as of FMI 2, is a jump that no shorter step makes smaller

The order of the units is irrelevant to the result.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.errors import StickslipError
from fmu_models.coupling.bonds import PowerBonds
from fmu_models.coupling.control import SHRINK, StepControl
from fmu_models.coupling.histories import SLOPE_AT_END, History, Matrix, Vector
from fmu_models.coupling.outcome import Halts, Outcome, Tell
from fmu_models.coupling.points import CommunicationPoints
from fmu_models.coupling.recording import recording
from fmu_models.importer import request
from fmu_models.importer.motion_error import MotionError
from fmu_models.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from fmu_models.coupling.system import CoupledSystem

TOLERANCE = 1e-6
SHORTEST = 1e-13  # of the run
RENEWED = 20  # steps for which responses of the units serve
APPROACH = 0.02  # of the way to an event: what is left for the last step
PRECISE = 100.0  # of the tolerance, in times of the fastest unit: how long a step with bends may be that finds an event
JUMP = 100.0  # of the tolerance: a signal that is off by more has jumped
MERGED = 3.0  # times as long: two events that undo one another
BENT = 0.1  # of the tolerance: lines that do not bend more reach an event at once
DISCARDS = 12  # in a row
STUBBORN = 3  # misses in a row that a shorter step does not lessen: a jump


def co_simulate(
    system: CoupledSystem,
    *,
    output_times: ArrayLike | None = None,
    progress: Callable[[float], None] | None = None,
    tell: Tell | None = None,
) -> Trajectory:
    """Step the units of ``system``; see ``couple``. MotionError: a unit fails; StickslipError: a unit cannot do what
    the settings ask for. tell: called with the name of a unit before it steps, and with what was recorded since."""
    for name, unit in system.units.items():
        if unit.fmu.description.coSimulation is None:
            raise StickslipError(
                f"The unit '{name}' has no Co-Simulation, which 'co-simulation' needs. "
                "Where all units have Model Exchange, choose the solver 'auto'."
            )
    times = None
    if output_times is not None:
        times = request.output_times(output_times, system.start_time, system.stop_time)
    # sums and pivots depend on the order of terms
    arranged = system.changed(
        units=dict(sorted(system.units.items())),
        connections=sorted(system.connections, key=lambda c: (c.target, c.source)),
    )
    master = Master(arranged, list(system.units), times, tell)
    try:
        return master.run(progress)
    except MotionError as error:
        raise error.after(master.trajectory()) from error
    finally:
        if master.pool:
            master.pool.shutdown()
        master.points.composite.close()


class Master(Outcome):
    """A run of a co-simulation.

    Args:
        names: of the units in the order in which they are recorded.
        times: when to record, s; None: at the communication points.
        tell: as of ``co_simulate``.
    """

    def __init__(self, system: CoupledSystem, names: list[str], times: Vector | None, tell: Tell | None = None) -> None:
        self.system, self.points, self.tell = system, CommunicationPoints(system), tell
        self.units = self.points.units
        fixed = [unit.name for unit in self.units if not unit.puts_back]
        if system.rollback and fixed:
            raise StickslipError(
                f"The unit '{fixed[0]}' cannot be put back (canGetAndSetFMUState), so that no step can be repeated. "
                "Leave 'rollback' out."
            )
        rigid = [unit.name for unit in self.units if not unit.any_step]
        if rigid and not system.step:
            raise StickslipError(f"The unit '{rigid[0]}' takes steps of one length only. Choose a step.")
        self.saves = not fixed and system.rollback is not False
        self.repeats = self.saves and (not system.step or system.rollback is True)
        threads = system.parallel and self.saves and tell is None
        self.pool = ThreadPoolExecutor(len(self.units)) if threads else None
        self.step, self.span = system.step, system.stop_time - system.start_time
        self.tolerance = system.tolerance or TOLERANCE
        signals = self.points.signals
        self.history = History(signals.size)
        followed = [self.points.composite.wires[i] for i in signals]
        self.bonds = PowerBonds(system.fmus, followed)
        stated = [system.fmus[wire.target[0]].variables[wire.target[1]].nominal for wire in followed]
        nominal = np.array([abs(float(value)) if value else 1.0 for value in stated])
        lines, polygons = np.zeros(signals.size, dtype=bool), np.zeros(signals.size, dtype=bool)
        for unit, places in zip(self.units, self.points.places, strict=True):
            continuous = unit.continuous[: places.size]
            lines[places], polygons[places] = (unit.degree < 2) & ~continuous, (unit.degree < 2) & continuous
        self.control = StepControl(self.tolerance, self.span, nominal, lines, polygons)
        self.degree, self.reached = 0, 0
        self.steps = self.retries = self.missed = self._age = 0
        # forces of bodies that stick to what they follow bend with its rate, which no unit knows ahead
        self._smooth = not any(unit.continuous.any() for unit in self.units)
        self.h, self._limit = 0.0, np.inf  # of the next step alone
        self._before: Vector | None = None  # what was read before the last event
        self._halts = Halts(self.span)
        recorded, self.output, self.watch = recording(self.points, names, times, fixed=bool(self.step))
        variables = self.points.composite.fmu.variables
        self.measured_in = {name: str(variables[name].unit or "1") for name in recorded}
        # those that may return early go first: where nothing can be put back, they are the ones that others wait for
        self._order = sorted(range(len(self.units)), key=lambda i: (not self.units[i].stops, not self.units[i].events))

    def _is_short(self, length: float) -> bool:
        """Whether an event is known well enough that lies in a step of such a length."""
        return length * max(self.control.rate, 1.0 / self.span) <= PRECISE * self.tolerance

    def run(self, progress: Callable[[float], None] | None = None) -> Trajectory:
        """From start to stop. MotionError: a unit fails, or refuses every step."""
        system, points = self.system, self.points
        points.begin(self.tolerance)
        points.refuse_rates_of_values()
        self._restart()
        while points.time < system.stop_time and not any(unit.ended for unit in self.units):
            self._advance()
            if self.tell:
                self.tell(self.news())
            if progress:
                progress((points.time - system.start_time) / self.span)
        self.output.finish(points.time)
        for unit in self.units:
            unit.terminate()
        return self.trajectory()

    def _restart(self) -> None:
        """Behind the start, an event or a jump: a history of this point alone."""
        points = self.points
        points.jump(JUMP * self.tolerance * self.control.size)
        points.exchange()
        values = points.u[points.signals]
        self.control.see(values)
        self._renew()
        slopes = points.slopes()
        self.history.restart(points.time, values, slopes)
        points.exchange()
        self.degree = self.history.known - 1
        if self.repeats or not self.step:
            self.h = self.control.first(slopes) * (1.0 if self.repeats else 0.3)
        self.output.point(points.time, self.degree, self.output.read())

    def _renew(self) -> None:
        self.control.answers(self.system.stop_time - self.points.time, *self.points.responses())
        self._age = 0

    def _end(self) -> tuple[float, bool]:
        """Where the next step shall end, and whether an input from outside jumps there."""
        time, stop = self.points.time, self.system.stop_time
        if self.step:
            count = np.floor((time - self.system.start_time) / self.step + 1e-9) + 1.0
            stop = min(stop, self.system.start_time + count * self.step)
        end = stop
        if self.repeats or not self.step:
            remaining = stop - time
            # two of equal length rather than a short last one
            end = time + (0.5 * remaining if self.h < remaining < 1.5 * self.h else self.h)
        end = stop if end > stop - 1e-9 * (end - time) else end
        bend, jumps = self.points.next_bend()
        return (bend, jumps) if bend <= end + 1e-9 * (end - time) else (end, False)

    def _advance(self) -> None:
        """One accepted step, however often it is tried."""
        if self.saves:
            for unit in self.units:
                unit.save()
        start, noted, before = self.points.time, len(self.points.events), self.points.u.copy()
        h, stubborn, last, discards = self.h, 0, np.inf, 0
        first = self.output.last
        proposed = h
        if self._limit < h:
            h = self._limit
        self._limit = np.inf
        while True:
            self.h = h
            end, jumps = self._end()
            try:
                reached, series = self._move(end)
            except MotionError as error:
                discards += 1
                if error.kind != "discard" or not self.repeats:
                    raise
                if discards > DISCARDS:
                    text = f"{error} It has refused {DISCARDS} longer ones before. End the run there, or mend the unit."
                    raise MotionError(text, error.kind, start) from error
                self._put_back(start, noted, before)
                h = 0.25 * (end - start)
                continue
            at_start = reached - start <= SHORTEST * self.span
            if any(unit.pending for unit in self.units) and (at_start or not self._is_void(reached, series)):
                shorter = self._approach(start, reached, end, series)
                if shorter:
                    self._put_back(start, noted, before)
                    h, self._limit = shorter, 2.0 * (reached - start - shorter)
                    continue
                self._finish(reached, first, noted)
                return
            self._look(reached, series)
            row = self.output.read()
            self.watch.count(first, row)
            if switched := self.watch.switched(first, row):
                if self.repeats and not self._is_short(reached - start):
                    self._put_back(start, noted, before)
                    h = self._limit = 0.5 * (reached - start)
                    continue
                self.points.note(reached, switched)
                self.output.point(reached, self.degree, row)
                self._finish(reached, first, noted)
                return
            values = self.points.u[self.points.signals]
            defects = self.history.defects(reached, values)
            length = reached - start
            error = float(self.control.errors(defects[self.degree : self.degree + 1], self.degree)[0])
            bent = max(self.control.feed_error(length, series[2]), self.output.error(reached, row) / self.tolerance)
            if max(error, bent) <= 1.0 or not self.repeats:
                self.missed += max(error, bent) > 1.0
                self.h = max(h, proposed) if self._limit < np.inf or h < proposed else h
                self._accept(reached, row, values, defects, bent, cut=length < 0.99 * self.h, jumps=jumps)
                return
            stubborn = stubborn + 1 if error > 0.5 * last else 0
            last = error
            once = stubborn >= STUBBORN and self.control.happens_once(length, defects[self.degree])
            if once or length <= SHORTEST * self.span:
                jumped = self.points.signals[int(np.argmax(np.abs(defects[self.degree]) / self.control.size))]
                self.points.note(reached, self.points.composite.wires[jumped].source[0])
                self.missed += not once
                self.output.point(reached, self.degree, row)
                self._finish(reached, first, len(self.points.events))
                return
            self.retries += 1
            degree, factor = self.control.choose(defects, self.degree)
            self._put_back(start, noted, before)
            self.degree, self._limit = degree, np.inf
            h = proposed = length * max(SHRINK, min(factor, 0.8 * max(bent, 1e-9) ** -0.25, 0.7))

    def _put_back(self, time: float, noted: int, values: Vector) -> None:
        for unit in self.units:
            unit.put_back()
        self.points.time = time
        self.points.u[:] = values
        del self.points.events[noted:]

    def _move(self, end: float) -> tuple[float, Matrix]:
        """All units to ``end``, or to the first event; the time reached, and what the signals were expected to be."""
        series, fed = self._expect(end)
        done: list[int] = []
        target, noted = end, len(self.points.events)
        ahead = self.points.step_abreast(self.pool, end, fed) if self.pool else []
        for i in self._order:
            unit = self.units[i]
            if self.tell:
                self.tell(unit.name)
            stop = unit.stops and (not done or (all(self.units[k].puts_back for k in done) and self.saves))
            if ahead and end == target:
                reached = ahead[i].result()
            else:
                if ahead:
                    unit.put_back()
                reached = unit.step(end, self.points.unit_inputs(i, fed, end), stop)
            if unit.ended and unit.time < end:
                end = unit.time
            elif reached < end:
                end = reached
                if reached == self.points.time:  # an event where the others stand
                    for k in range(len(self.units)) if ahead else done:
                        if k != i:
                            self.units[k].put_back()
                    return end, np.zeros_like(series)
                series, fed = self._expect(end)
                for k in done:
                    self.units[k].put_back()
                    self.units[k].step(end, self.points.unit_inputs(k, fed, end), self.units[k].stops)
            done.append(i)
        self.points.order_events(noted, end)
        return end, series

    def _expect(self, end: float) -> tuple[Matrix, Matrix]:
        """What the signals are expected to be, and what units are fed that take lines."""
        series = self.history.series(end, self.degree)
        return series, self.control.straightened(end - self.history.time, series)

    def _is_void(self, time: float, series: Matrix) -> bool:
        """Whether an event changes nothing, as where a body sticks for a moment because lines have bends."""
        h, unknown = time - self.points.time, any(u.pending and u.name not in self.watch.owners for u in self.units)
        if unknown or not self.control.happens_once(h, series[2]):
            return False
        if not self.watch.is_void(self.output.last, self.output.read(), h):
            return False
        self.points.handle_events()
        while self.points.events and self.points.events[-1].time == time:
            self.points.events.pop()
        return True

    def _approach(self, start: float, event: float, end: float, series: Matrix) -> float:
        """Length of a step that ends just before an event; 0: it may be taken as it was found."""
        length = event - start
        if not self.repeats or length <= 1e-12 * max(self.span, abs(event)):
            return 0.0
        bend = np.abs(self.history.series(end, self.degree)[2]) if end > event else np.abs(series[2])
        # a line misses the rate by much more, on which a body that sticks depends
        straight = bool((bend <= BENT * self.tolerance * self.control.size).all())
        exact = straight and (not bend.any() or self._is_short(max(end - start, length)))
        if exact and not self.output.inside(start, event):
            return 0.0
        return length * (1.0 - APPROACH)

    def _look(self, time: float, series: Matrix) -> None:
        """The values at the point reached."""
        points = self.points
        h = time - points.time
        points.time = time
        points.drive()
        points.expect_rates((SLOPE_AT_END @ series) / h)
        points.exchange()

    def _accept(
        self, time: float, row: Vector, values: Vector, defects: Matrix, bent: float, *, cut: bool, jumps: bool
    ) -> None:
        h = time - self.history.time
        used = self.degree
        self.steps += 1
        self.reached = max(self.reached, used)
        proposed = self.h
        self.degree, factor = self.control.choose(defects, used)
        longer = h * min(factor, 0.8 * max(bent, 1e-9) ** -0.25)
        self.h = max(proposed, longer) if cut else longer
        self.history.accept(time, values, defects)
        self.bonds.add(h, values, defects[used])
        if self._smooth and (slopes := self.points.slopes()) is not None:
            self.history.accept_slopes(slopes)
            self.points.exchange()
        self.control.see(values, h)
        self._age += 1
        if self._age >= RENEWED:
            self._renew()
        self.output.point(time, used, row)
        if jumps:
            self.output.event(time)
            self.points.drive(jump=True)
            self.points.exchange()
            self._restart()

    def _finish(self, time: float, before: Vector, noted: int) -> None:
        """A step that ends at an event; before: what was read at its start, where ``noted`` events were known.
        MotionError: events follow one another without end."""
        self.steps += 1
        points = self.points
        self._halts.add(time, points.events[-1].name if points.events else "a unit")
        start, points.time = self.history.time, time
        self.output.event(time)
        points.handle_events()
        points.drive()
        points.exchange()
        self._restart()
        events = points.events
        if not all(event.name in self.watch.owners for event in events[noted:]):
            self._before = None
        elif self.watch.is_void(before, self.output.last, time - start):
            del events[noted:]
        else:
            self._merge(before)

    def _merge(self, before: Vector) -> None:
        """Forget two events, one right behind the other, that leave everything as it was."""
        events = self.points.events
        if len(events) > 1 and events[-1].name == events[-2].name and self._before is not None:
            adjacent = self._is_short((events[-1].time - events[-2].time) / MERGED)
            if adjacent and self.watch.same(self._before, self.output.last):
                del events[-2:]
                before = self.output.last
        self._before = before
