"""One unit of a co-simulation, as the master sees it: what it can do, and a step.

The interface, which may as well lie over the border of a process:

    begin, event                    after initialization; event mode, with inputs that are written in it
    step(end, inputs, stop)         on to ``end`` or, with ``stop``, to the unit's first event; the time reached
    save, put_back                  the state at one point; taken again after each accepted step
    slopes, set_rates               rates of the outputs at a point; rates of the inputs for them
    response                        how outputs answer inputs that are wrong over a step
    terminate

Inputs of a step come as Legendre coefficients (7, n), see ``histories``. A unit follows them as well as it can:

    polynomials     the projection on its degree
    lines           the line with the same two moments; in a unit with contacts or other events two of half the step,
                    which join without a jump: v, 2 m - (v + p(h)) / 2, p(h), with v the value reached and m the mean
    held values     two of half the step, a_0 -+ 2/3 a_1, with the same two moments
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from ctypes import byref, c_int32, c_size_t, c_void_p
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from fmu_models.coupling.composite import library
from fmu_models.coupling.histories import HIGHEST, Matrix, Vector
from fmu_models.coupling.order import feedthrough
from fmu_models.coupling.response import Response, response
from fmu_models.importer import instance, request
from fmu_models.importer.instance import STATUS, F
from fmu_models.importer.motion_error import MotionError

ITERATIONS = 100  # updates at one event before the unit counts as not converging
STALLS = 1000  # returns in a row without progress
PACE = 0.8  # how fast a unit forgets the length of its long steps, of one step
_SIGNS = (-1.0) ** np.arange(HIGHEST + 1)  # Legendre polynomials at the start of a step
EPSILON = float(np.finfo(float).eps)
# derivatives by 2 s - 1, at the start of a step, of the Legendre polynomials up to a degree: (d + 1, d + 1) each
_JETS = [
    np.array([[legendre.legval(-1.0, legendre.legder(row, order)) for row in np.eye(d + 1)] for order in range(d + 1)])
    for d in range(HIGHEST + 1)
]


class SteppedUnit:
    """A unit that steps by itself.

    Args:
        inputs: names of the continuous inputs that follow signals.
        outputs: names of the continuous outputs that feed others.
        jumping: names of inputs that have to be written at every point, as those of an algebraic loop are.
        note: called with the time and the name at an event.

    Attributes:
        degree: of the inputs that it follows in a step: 0 held, 1 lines, up to 6.
        continuous: (n_inputs,) inputs that never jump: they are written at their rates alone.
        puts_back, stops, any_step: it gives and takes its whole state; stops at events; takes steps of any length.
        events: it declares indicators of events.
        ended: it has ended the run.
        pending: it stands at an event that ``event`` has to handle.
        calls: of doStep so far.
    """

    def __init__(
        self,
        name: str,
        unit_instance: instance.Instance,
        inputs: Sequence[str],
        outputs: Sequence[str],
        jumping: Collection[str],
        note: Callable[[float, str], None],
    ) -> None:
        self.name, self.instance, self._note = name, unit_instance, note
        self.fmi, self._calls, self._fmu = unit_instance.fmu.fmi, byref(unit_instance.calls), unit_instance.fmu
        self._handle = c_void_p(unit_instance.calls.instance)
        self.inputs, self.output_names = list(inputs), list(outputs)
        attributes = self._fmu.interfaces["CoSimulation"]  # whose names differ between the versions of FMI
        word = "FMUstate" if self.fmi == 2 else "FMUState"
        self._get, self._set, self._free = (self._function(f"{verb}{word}") for verb in ("Get", "Set", "Free"))
        self.puts_back = self._is(attributes, f"canGetAndSet{word}") and None not in (self._get, self._set, self._free)
        self.any_step = self._is(attributes, "canHandleVariableCommunicationStepSize")
        self.stops = bool(unit_instance.calls.event_mode) and self._is(attributes, "mightReturnEarlyFromDoStep")
        self._slopes = self._function("GetRealOutputDerivatives" if self.fmi == 2 else "GetOutputDerivatives")
        if int(attributes.get("maxOutputDerivativeOrder", 0)) < 1:
            self._slopes = None
        self.ended = self.pending = False
        self.calls, self.time = 0, 0.0
        self._pace = self._saved_pace = 0.0
        self._state, self._saved_time = c_void_p(), 0.0
        self._stepped = instance.Stepped()
        self._stepped_reference = byref(self._stepped)
        self._derive_inputs = self._function("SetRealInputDerivatives") if self.fmi == 2 else None
        if not self._is(attributes, "canInterpolateInputs"):
            self._derive_inputs = None
        offered = self._is(attributes, "providesDirectionalDerivative" + "s" * (self.fmi == 3))
        unit_instance.calls.directional = offered and bool(unit_instance.calls.function[F.DIRECTIONAL])
        self._feeds(self._degree(), jumping)
        held_inputs = {name for name, rated in zip(self.inputs, self._rated, strict=True) if not rated}
        # rates of outputs that follow an input at once need the rate of that input
        self._unseen = any(feedthrough(self._fmu, name) & held_inputs for name in self.output_names)
        self._output_references = self._references(self.output_names)
        self._ones = np.ones(len(self.output_names), dtype=np.int32)

    @staticmethod
    def _is(attributes: Any, name: str) -> bool:
        return attributes.get(name) in ("true", "1")

    def _function(self, name: str) -> Any:
        function = getattr(self.instance.dll, f"fmi{self.fmi}{name}", None)
        if function is not None:
            function.restype = c_int32
        return function

    def _references(self, names: Sequence[str]) -> NDArray[np.uint32]:
        return np.array([self._fmu.variables[name].valueReference for name in names], dtype=np.uint32)

    def _variables(self, names: Sequence[str]) -> Any:
        selection = request.Selection.of(self._fmu, list(names))
        return selection, byref(selection.c)

    def _degree(self) -> int:
        """The highest degree of inputs that the unit takes."""
        lines = int(any(map(self._has_rate, self.inputs)))
        if self._derive_inputs is None or not self.inputs:
            return lines
        references, zero = self._references(self.inputs[:1]), np.zeros(1)
        for order in range(1, HIGHEST + 1):
            status = self._input_derivatives(references, np.array([order], dtype=np.int32), zero)
            if status >= STATUS.DISCARD:
                # what a refusal may have spoilt
                library().fmi_plain(self._calls, F.RESET)
                self.instance.log.count, self.instance.log.message = 0, b""
                return max(order - 1, lines)
        return HIGHEST

    def _input_derivatives(self, references: NDArray[np.uint32], orders: NDArray[np.int32], values: Vector) -> int:
        pointers = (array.ctypes.data for array in (orders, values))
        n = c_size_t(references.size)
        orders_pointer, values_pointer = map(c_void_p, pointers)
        assert self._derive_inputs is not None
        return self._derive_inputs(self._handle, c_void_p(references.ctypes.data), n, orders_pointer, values_pointer)

    def _has_rate(self, name: str) -> bool:
        """An FMU exported here takes the rate of an input as an input of its own, by which it moves the other."""
        rate = self._fmu.variables.get(f"{name}_rate")
        return rate is not None and rate.causality == "input"

    def _feeds(self, degree: int, jumping: Collection[str]) -> None:
        """What is written to follow the inputs: values of those that may jump, rates of those that have them."""
        n, self.degree = len(self.inputs), degree
        has_rates = np.array([self._has_rate(name) for name in self.inputs], dtype=bool)
        self._by_variables = degree < 2 and bool(has_rates.any())
        self._rated = has_rates if self._by_variables else np.full(n, degree > 0)
        free = np.array([name not in jumping for name in self.inputs], dtype=bool)
        self.events = bool(self._fmu.description.numberOfEventIndicators)
        self.continuous = self._rated & free & self.events
        self._halves = degree < 2 and (bool(self.continuous.any()) or not self._rated.all())
        # an input that is moved by a variable keeps what it has reached; another is written with it
        self._valued = ~self.continuous if self._by_variables else np.ones(n, dtype=bool)
        rates = [f"{name}_rate" for name in self.inputs if self._by_variables and self._has_rate(name)]
        values = [name for name, valued in zip(self.inputs, self._valued, strict=True) if valued]
        self._n_values, self._n_rates = len(values), int(self._rated.sum())
        self._feed, self._rates = self._variables([*values, *rates]), self._variables(rates)
        self._everything = self._variables(self.inputs)
        self._written = np.zeros(len(values) + len(rates))
        self._written_address = self._written.ctypes.data
        self._reached, self._saved_reached = np.zeros(n), np.zeros(n)
        self._input_references = self._references(self.inputs)
        orders = np.arange(1, max(degree, 1) + 1, dtype=np.int32)
        self._derivative_references = np.tile(self._input_references[self._rated], orders.size)
        self._derivative_orders = np.repeat(orders, self._n_rates)

    @property
    def words(self) -> str:
        """What it can do, in words."""
        feed = {0: "held inputs", 1: "lines"}.get(self.degree, f"inputs of degree {self.degree}")
        feed = "no inputs" if not self.inputs else "lines without jumps" if self.continuous.any() else feed
        able = [feed, *["stops at events"] * self.stops, *["can be put back"] * self.puts_back]
        return f"{self.name}: {', '.join(able)}"

    def fail(self, action: str, kind: str = "fmi error") -> MotionError:
        """The error that ends the run."""
        message = self.instance.message()
        text = f"unit '{self.name}': {action} at t = {self.time:.9g} s." + (
            f" The FMU says: {message}" if message else ""
        )
        return MotionError(text, kind, self.time)

    def _check(self, status: int, action: str) -> None:
        if status >= STATUS.DISCARD:
            raise self.fail(f"{action} fails")

    def begin(self, time: float) -> None:
        """After initialization."""
        self.time = time
        if self.instance.calls.event_mode:
            self._iterate()
        self.read_inputs()

    def read_inputs(self) -> None:
        """The inputs as the unit has them, where they were written or moved by itself."""
        if self.inputs:
            status = library().fmi_read(self._calls, self._everything[1], self._reached.ctypes.data)
            self._check(status, "reading its inputs")

    def save(self) -> None:
        """Keep the state of the unit for ``put_back``."""
        self._check(self._get(self._handle, byref(self._state)), "saving its state")
        self._saved_time, self._saved_pace, self._saved_reached[:] = self.time, self._pace, self._reached

    def put_back(self) -> None:
        """Put the unit back to where it was saved."""
        self._check(self._set(self._handle, self._state), "putting back its state")
        self.time, self._pace, self._reached[:] = self._saved_time, self._saved_pace, self._saved_reached
        self.ended = self.pending = False

    def terminate(self) -> None:
        if self._state.value:
            self._free(self._handle, byref(self._state))
        library().fmi_plain(self._calls, F.TERMINATE)

    def event(self, write: Callable[[], int] | None = None) -> None:
        """Event mode, in which ``write`` sets inputs that change at events only."""
        if self.instance.calls.event_mode:
            self._check(library().fmi_plain(self._calls, F.ENTER_EVENT), "entering event mode")
        if write is not None:
            self._check(write(), "setting its inputs")
        if self.instance.calls.event_mode:
            self._iterate()
        self.pending = False

    def _iterate(self) -> None:
        update = instance.Update(again=1)
        for _ in range(ITERATIONS):
            self._check(library().fmi_update(self._calls, byref(update)), "updating its discrete states")
            self.ended |= bool(update.terminate)
            if not update.again or self.ended:
                break
        else:
            raise self.fail("asks for ever more updates of its discrete states", "event iteration")
        if not self.ended:
            self._check(library().fmi_plain(self._calls, F.ENTER_STEP), "entering step mode")

    def step(self, end: float, inputs: Matrix, stop: bool) -> float:
        """Step with ``inputs`` (7, n_inputs) to ``end``; with ``stop`` at most to the first event.

        Returns:
            The time reached, s, which is ``end`` or that of the event.
        """
        start = self.time
        h = end - start
        if not self.inputs:
            self._advance(end, stop)
        elif self.degree > 1:
            self._step_polynomials(end, inputs, stop)
        elif not self._halves:
            self._write(inputs[0] - inputs[1], 2.0 / h * inputs[1])
            self._advance(end, stop)
        else:
            self._step_halves(start + 0.5 * h, end, inputs, stop)
        return self.time

    def _step_halves(self, middle: float, end: float, inputs: Matrix, stop: bool) -> None:
        h = end - self.time
        offset = self._kept_offset(inputs, h)
        mean, bend, last = inputs[0], inputs[1], np.add.reduce(inputs, axis=0) + offset
        knot = 2.0 * (mean + offset) - 0.5 * (self._reached + last)
        moved, rated = self.continuous, self._rated
        for half, (limit, base, goal) in enumerate(((middle, self._reached, knot), (end, knot, last))):
            rates = np.where(moved, goal - base, bend) * (2.0 / h)
            values = np.where(rated, mean if half else mean - bend, mean + (1.0 if half else -1.0) * bend / 1.5)
            start = self.time
            self._write(np.where(moved, self._reached, values), rates)
            self._advance(limit, stop)
            self._reached = np.where(moved, self._reached + rates * (self.time - start), self._reached)
            self._settle_inputs()
            if self.time < limit or self.ended:
                return

    def _kept_offset(self, inputs: Matrix, h: float) -> Vector:
        """What of the distance between the values reached and those expected a short step keeps: to make it up at once
        would be a jump of the rate."""
        share = min(1.0, h / self._pace) if self._pace else 1.0
        self._pace = max(h, PACE * self._pace)
        return (1.0 - share) * (self._reached - _SIGNS @ inputs)

    def _settle_inputs(self) -> None:
        """Inputs as the unit itself has moved them, which differ by rounding; one that has not moved stays computed."""
        if not self._by_variables and self.continuous.any():
            computed = self._reached.copy()
            self.read_inputs()
            settled = np.abs(self._reached - computed) <= 1e-9 * np.abs(computed)
            self._reached = np.where(settled, self._reached, computed)

    def _write(self, values: Vector, rates: Vector) -> None:
        written = self._written
        written[: self._n_values] = values[self._valued]
        if self._by_variables:
            written[self._n_values :] = rates[self._rated]
        self._check(library().fmi_write(self._calls, self._feed[1], self._written_address), "setting its inputs")
        if self.degree and not self._by_variables:
            self._derive(rates)

    def _derive(self, derivatives: Vector) -> None:
        """Derivatives of the inputs (FMI 2), (n_orders * n_inputs,) from the first order on."""
        n = derivatives.size
        status = self._input_derivatives(self._derivative_references[:n], self._derivative_orders[:n], derivatives)
        self._check(status, "setting the derivatives of its inputs")

    def _step_polynomials(self, end: float, inputs: Matrix, stop: bool) -> None:
        """One step with the polynomials of the unit's degree."""
        h, start, degree = end - self.time, self.time, self.degree
        coefficients = inputs[: degree + 1].copy()
        if degree >= 3 and self.continuous.any():
            # the cubic with the same two moments from the value reached to the end expected
            offset = self._kept_offset(inputs, h)
            last = np.add.reduce(inputs, axis=0) + offset
            coefficients[0] += offset
            coefficients[2] = 0.5 * (self._reached + last) - coefficients[0]
            coefficients[3] = 0.5 * (last - self._reached) - inputs[1]
            coefficients[4:] = 0.0
        jet = _JETS[degree] @ coefficients * (2.0 / h) ** np.arange(degree + 1)[:, None]
        jet[0] = np.where(self.continuous, self._reached, jet[0])
        self._write(jet[0], np.ascontiguousarray(jet[1:]).ravel())
        self._advance(end, stop)
        passed = 2.0 * (self.time - start) / h - 1.0
        self._reached = np.where(self.continuous, legendre.legval(passed, coefficients), self._reached)
        self._settle_inputs()

    def set_rates(self, rates: Vector) -> None:
        """Rates of the inputs at this point, (n_inputs,); nothing happens where the unit takes none."""
        if self._n_rates and self._by_variables:
            values = np.ascontiguousarray(rates[self._rated])
            self._check(library().fmi_write(self._calls, self._rates[1], values.ctypes.data), "setting input rates")
        elif self._n_rates:
            self._derive(rates)

    def jump(self, values: Vector, limits: Vector) -> None:
        """Write the first inputs that never jump, where what feeds them has jumped to other ``values`` by more."""
        first = slice(values.size)
        jumped = self.continuous[first] & (np.abs(values - self._reached[first]) > limits)
        if jumped.any():
            self.read_inputs()
            self._reached[first] = np.where(jumped, values, self._reached[first])
            status = library().fmi_write(self._calls, self._everything[1], self._reached.ctypes.data)
            self._check(status, "setting its inputs")

    def _advance(self, end: float, stop: bool) -> None:
        """On to ``end``, through the unit's own events or to the first one."""
        stalled = 0
        while self.time < end and not self.ended:
            time, stepped = self.time, self._stepped
            status = library().fmi_do_step(self._calls, time, end - time, self._stepped_reference)
            self.calls += 1
            if status == STATUS.DISCARD and stepped.terminate:
                self.ended = True
                return
            if status == STATUS.DISCARD:
                advanced = stepped.reached - time
                detail = f", of which it made {advanced:.9g} s," if 0 < advanced < end - time else ""
                raise self.fail(f"discards the communication step of {end - time:.9g} s{detail}", "discard")
            self._check(status, "doStep")
            self.ended |= bool(stepped.terminate)
            # adding up its own steps it may miss the end by rounding
            reached = stepped.reached if stepped.early or stepped.terminate else end
            reached = end if abs(reached - end) <= 1e-12 * (end - time) + 4.0 * EPSILON * abs(end) else reached
            stalled = 0 if reached > time else stalled + 1
            if stalled > STALLS:
                raise self.fail("returns from doStep without any progress", "stalls")
            self.time = reached
            if (stepped.event or stepped.early) and self.instance.calls.event_mode and not self.ended:
                self._note(reached, self.name)
                self.pending = True
                if stop:
                    return
                self.event()

    def slopes(self) -> Vector | None:
        """(n_outputs,) first derivatives of the outputs by time; None where the unit does not tell them."""
        values = np.zeros(self._output_references.size)
        if self._slopes is None or self._unseen:
            return None if values.size else values
        references, n = c_void_p(self._output_references.ctypes.data), c_size_t(values.size)
        arguments = (self._handle, references, n, c_void_p(self._ones.ctypes.data), c_void_p(values.ctypes.data))
        status = self._slopes(*arguments) if self.fmi == 2 else self._slopes(*arguments, n)
        return values if status < STATUS.DISCARD and np.isfinite(values).all() else None

    def response(self) -> Response | None:
        """How the outputs answer the inputs, by directional derivatives; None where the unit has none."""
        return response(self.instance, self.inputs, self.output_names)
