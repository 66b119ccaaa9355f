"""One unit of a co-simulation: steps with its events inside, and puts itself back where it can."""

from collections.abc import Callable
from ctypes import byref, c_int32, c_void_p
from typing import Any

from fmu_models.coupling.composite import library
from fmu_models.importer import instance
from fmu_models.importer.instance import STATUS, F
from fmu_models.importer.motion_error import MotionError

ITERATIONS = 100  # updates at one event before the unit counts as not converging
STALLS = 1000  # returns in a row without progress


class UnitStepper:
    """A unit that steps by itself.

    Attributes:
        puts_back: it gives and takes its whole state.
        any_step: its steps may be of any length.
        ended: it has ended the run.
    """

    def __init__(self, name: str, instance: instance.Instance, note: Callable[[float, str, str], None]) -> None:
        self.name, self.instance, self.calls = name, instance, instance.calls
        self._note = note
        attributes = instance.fmu.elements("CoSimulation")[0]  # whose names differ between the versions of FMI
        capability = "canGetAndSetFMUstate" if instance.fmu.fmi == 2 else "canGetAndSetFMUState"
        self.puts_back = attributes.get(capability) in ("true", "1")
        self.any_step = attributes.get("canHandleVariableCommunicationStepSize") in ("true", "1")
        self.ended = False
        word = "FMUstate" if instance.fmu.fmi == 2 else "FMUState"
        self._get, self._set, self._free = (self._function(f"{verb}{word}") for verb in ("Get", "Set", "Free"))
        self.puts_back = self.puts_back and None not in (self._get, self._set, self._free)

    def _function(self, name: str) -> Any:
        function = getattr(self.instance.dll, f"fmi{self.instance.fmu.fmi}{name}", None)
        if function is not None:
            function.restype = c_int32
        return function

    def fail(self, action: str, time: float, kind: str = "fmi error") -> MotionError:
        """The error that ends the run."""
        message = self.instance.message()
        text = f"unit '{self.name}': {action} at t = {time:.9g} s." + (f" The FMU says: {message}" if message else "")
        return MotionError(text, kind, time)

    def _check(self, status: int, action: str, time: float) -> None:
        if status >= STATUS.DISCARD:
            raise self.fail(f"{action} fails", time)

    def save(self, time: float) -> c_void_p:
        """The state of the unit, to be freed."""
        state = c_void_p()
        self._check(self._get(c_void_p(self.calls.instance), byref(state)), "saving its state", time)
        return state

    def put_back(self, state: c_void_p, time: float) -> None:
        """Put the unit back to a saved ``state``."""
        self._check(self._set(c_void_p(self.calls.instance), state), "putting back its state", time)

    def free(self, state: c_void_p) -> None:
        self._free(c_void_p(self.calls.instance), byref(state))

    def begin(self, time: float) -> None:
        """After initialization."""
        if self.calls.event_mode:
            self._iterate(time)

    def event(self, time: float, write: Callable[[], int]) -> None:
        """Inputs that change at events only."""
        if self.calls.event_mode:
            self._check(library().fmi_plain(byref(self.calls), F.ENTER_EVENT), "entering event mode", time)
        self._check(write(), "setting its inputs", time)
        if self.calls.event_mode:
            self._iterate(time)

    def _iterate(self, time: float) -> None:
        update = instance.Update(again=1)
        for _ in range(ITERATIONS):
            self._check(library().fmi_update(byref(self.calls), byref(update)), "updating its discrete states", time)
            self.ended |= bool(update.terminate)
            if not update.again or self.ended:
                break
        else:
            raise self.fail("asks for ever more updates of its discrete states", time, "event iteration")
        if not self.ended:
            self._check(library().fmi_plain(byref(self.calls), F.ENTER_STEP), "entering step mode", time)

    def step(self, time: float, end: float) -> None:
        """Step to ``end``, through the unit's own events."""
        stalled = 0
        while time < end and not self.ended:
            stepped = instance.Stepped()
            status = library().fmi_do_step(byref(self.calls), time, end - time, byref(stepped))
            if status == STATUS.DISCARD and stepped.terminate:
                self.ended = True
                return
            if status == STATUS.DISCARD:
                raise self.fail(f"discards the communication step of {end - time:.9g} s", time, "discard")
            self._check(status, "doStep", time)
            self.ended |= bool(stepped.terminate)
            # adding up its own steps it may miss the end by rounding
            reached = stepped.reached if stepped.early or stepped.terminate else end
            reached = end if abs(reached - end) <= 1e-12 * max(abs(end), end - time) else reached
            stalled = 0 if reached > time else stalled + 1
            if stalled > STALLS:
                raise self.fail("returns from doStep without any progress", time, "stalls")
            time = reached
            if (stepped.event or stepped.early) and self.calls.event_mode and not self.ended:
                self._note(reached, "state", self.name)
                self._check(library().fmi_plain(byref(self.calls), F.ENTER_EVENT), "entering event mode", time)
                self._iterate(time)
