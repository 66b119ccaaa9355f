"""A Model Exchange importer with the habits of importers less careful than they should be."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field

import numpy as np
from faces import Face, face

from fmu_models.fmu.fmu import Fmu


@dataclass(frozen=True)
class Habits:
    """What an importer does at its steps and events.

    Attributes:
        step: its length, s.
        method: "rk4", "euler" or "adams", which extrapolates by the rates of the step before.
        locates: events are located by bisection, else taken at the end of the step.
        restarts: at events the method starts anew "always", only when "told" that values changed, or "never".
        completes: completedIntegratorStep is called after each step.
        probes: rates and indicators are asked for at trial states far beyond the step.
        rolls_back: every step is made, undone by the FMU's state, and made again.
    """

    step: float = 1 / 256
    method: str = "rk4"
    locates: bool = True
    restarts: str = "always"
    completes: bool = False
    probes: bool = False
    rolls_back: bool = False


@dataclass
class Importer:
    """One run; ``rows`` holds the states at the ends of the steps."""

    fmu: Fmu
    habits: Habits
    rows: list[np.ndarray] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    told: int = 0
    events: int = 0

    def run(self, stop: float, values: dict[str, float] | None = None) -> np.ndarray:
        """(n_steps + 1, n_states) at every multiple of the step up to ``stop``.

        Raises:
            Exception: what fmpy raises where a call is refused; ``messages`` holds what the FMU says.
        """
        with face(self.fmu, co_simulation=False) as f:
            self.messages = f.messages
            if values:
                f.set(values)
            f.initialize()
            self.time, self.before, self.rate_before = 0.0, 0.0, None
            self._leave_event_mode(f)
            self.x = self._states(f)
            self.rows = [self.x]
            for n in range(round(stop / self.habits.step)):
                self._advance(f, (n + 1) * self.habits.step)
                self.rows.append(self.x)
            return np.array(self.rows)

    def _advance(self, f: Face, end: float) -> None:
        while self.time < end:
            if self.habits.rolls_back:
                kept = f.get_state()
                self._trial(f, end)
                f.set_state(kept)
                f.free_state(kept)
            begin, x, signs = self.time, self.x, self._indicators(f) > 0.0
            rate = f.derivatives()
            if self.habits.probes:
                self._place(f, end + 3.0 * (end - begin), x + 10.0 * (end - begin) * rate)
                f.derivatives()
                self._indicators(f)
                self._place(f, begin, x)
            reached, there = end, self._trial(f, end)
            changed = (self._indicators(f) > 0.0) != signs
            if changed.any() and self.habits.locates:
                reached, there = self._located(f, begin, end, signs)
            self.before, self.rate_before = reached - begin, rate
            self.time, self.x = reached, there
            self._place(f, reached, there)
            if self.habits.completes:
                f.api.completedIntegratorStep()
            if changed.any():
                self._event(f)

    def _located(self, f: Face, low: float, high: float, signs: np.ndarray) -> tuple[float, np.ndarray]:
        """The first instant, to rounding, after which an indicator has another sign, and the states there."""
        while (middle := 0.5 * (low + high)) not in (low, high):
            self._trial(f, middle)
            if ((self._indicators(f) > 0.0) != signs).any():
                high = middle
            else:
                low = middle
        return high, self._trial(f, high)

    def _trial(self, f: Face, end: float) -> np.ndarray:
        """States at ``end`` by one step from the present ones; the FMU stands there afterwards."""
        h, x, t = end - self.time, self.x, self.time
        first = self._rate(f, t, x)
        match self.habits.method:
            case "euler":
                there = x + h * first
            case "adams" if self.rate_before is not None:
                there = x + h * first + 0.5 * h * h / self.before * (first - self.rate_before)
            case "adams":
                there = x + h * self._rate(f, t + 0.5 * h, x + 0.5 * h * first)
            case _:
                second = self._rate(f, t + 0.5 * h, x + 0.5 * h * first)
                third = self._rate(f, t + 0.5 * h, x + 0.5 * h * second)
                there = x + h / 6.0 * (first + 2.0 * second + 2.0 * third + self._rate(f, end, x + h * third))
        self._place(f, end, there)
        return there

    def _rate(self, f: Face, time: float, x: np.ndarray) -> np.ndarray:
        self._place(f, time, x)
        return f.derivatives()

    def _place(self, f: Face, time: float, x: np.ndarray) -> None:
        f.api.setTime(time)
        f.set_states(x)

    def _event(self, f: Face) -> None:
        self.events += 1
        f.api.enterEventMode()
        told = self._leave_event_mode(f)
        self.told += told
        self.x = self._states(f)
        if self.habits.restarts == "always" or (self.habits.restarts == "told" and told):
            self.rate_before = None

    def _leave_event_mode(self, f: Face) -> bool:
        needed, told = True, False
        while needed:
            needed, _, _, changed, *_ = f.update()
            told |= bool(changed)
        f.api.enterContinuousTimeMode()
        return told

    def _states(self, f: Face) -> np.ndarray:
        x = np.zeros(len(self.fmu.states))
        f.api.getContinuousStates(x.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), x.size)
        return x

    def _indicators(self, f: Face) -> np.ndarray:
        count = f.fmu.description.numberOfEventIndicators
        z = np.zeros(count)
        f.api.getEventIndicators(z.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), z.size)
        return z
