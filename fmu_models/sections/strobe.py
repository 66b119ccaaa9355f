"""The strobe of an oscillator: its states after each period of the forcing."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.flow import Flow
from fmu_models.sections.importer import ImporterBackend
from fmu_models.sections.oscillator import FmuSection
from fmu_models.sections.point import Begin, Vector
from fmu_models.simulation.divergence import keeps_volumes, volume_change
from fmu_models.simulation.ensemble import KINDS, Where
from fmu_models.simulation.field import VectorField, is_forced
from fmu_models.simulation.run import simulate

# times of change over which a motion is looked at, and how often; how often these are made four times longer
CHANGES, SAMPLES, LONGER = 64.0, 512, 12
DRIFTS = 8.0  # of the time of change of a state: one that has not turned by then drifts
SLOW = 1e-8  # of the fastest: what is slower stands still
ROUNDING = 1e-12  # of the size of a state: what varies less does not move


HOW = ("every", "period", "forcing", "autonomous")  # what tells strobes of one model apart


class Strobe(FmuSection):
    """The states after each period.

    Args:
        every: periods of the forcing in one step.
        autonomous: nothing forces the motion, ``period`` is how often it is looked at. Without ``period`` both are
            found, and ``estimated``: half of the time in which the motion from the default start changes by its size.
        others: of ``FmuSection``.
    """

    strobes = True

    def __init__(self, fmu: Fmu, *, every: int = 1, autonomous: bool = False, **others: Any) -> None:
        super().__init__(fmu, **others)
        self.every, self.autonomous = every, autonomous
        self.estimated = not self.forced and self.unforced
        if self.estimated:
            self.autonomous, self.period = True, 0.5 * time_of_change(fmu, self.values)
        if not self.forced or every < 1:
            raise StickslipError(
                f"A strobe of '{self.name}' needs a period, and takes at least one a step. Name the parameter that is "
                "the frequency of its forcing (--forcing, forcing=), or give the period in s (--period, period=)."
            )
        if autonomous and (forcing := self.forcing or next(iter(fmu.signals), None)) is not None:
            raise StickslipError(f"'{forcing}' forces the motion: it is not autonomous. Leave autonomous out.")

    def folded(self, times: int) -> Strobe:
        """So many steps of this one as one."""
        return strobe_of(self, **{name: getattr(self, name) for name in HOW} | {"every": self.every * times})

    @property
    def unforced(self) -> bool:
        """Whether nothing forces the motion, as far as its rates at the default start tell."""
        if self.forcing is not None or not self.fmu.ours:
            return self.autonomous
        states = np.array([self.fmu.start_of(name) for name in self.fmu.states])
        return self.autonomous or not is_forced(VectorField(self.fmu, self.values), states)

    def log_volumes(self, points: Vector) -> Vector | None:
        """Logarithms of volumes from the divergence of the rates, where no event changes volumes."""
        if not keeps_volumes(self.fmu):
            return None
        length = self.every * float(self.periods({}, 1)[0])
        return np.array([volume_change(self.fmu, length, **self.as_run(point)) for point in points])

    def flow(self, point: Vector) -> Flow:
        """The step of a third-party FMU from a point (n,), with its events and misses.

        Raises:
            StickslipError: it cannot be made.
        """
        assert isinstance(self.backend, ImporterBackend)
        departure = self.begin(point, self.values, float(self.periods({}, 1)[0]))
        return self.backend.flow(point, departure, events=True)

    def _phase(self, index: int) -> list[tuple[str, int]]:
        return []

    def repeats(self, periods: Vector) -> Vector:
        return self.every * periods

    def where(self) -> Where:
        return Where(KINDS.STROBE)

    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        return Begin(values, 0.0, self.every * period)


def strobe_of(section: FmuSection, **how: Any) -> Strobe:
    """The motions of another section by a strobe. how: ``every``, ``autonomous``, ``forcing`` and ``period`` of it."""
    settings = {"parameters": section.values, "tolerance": section.tolerance, "stepper": section.stepper}
    return Strobe(section.fmu, **settings, **how)


def time_of_change(fmu: Fmu, values: Mapping[str, float]) -> float:
    """s, std(x)/rms(x') of the slowest state that does not drift, along the motion from the default start; where that
    rests, of the fastest of small motions about it."""
    field, states = VectorField(fmu, values), np.array([fmu.start_of(name) for name in fmu.states])
    sizes = np.array([fmu.size_of(name) for name in fmu.states])
    fastest = np.abs(np.linalg.eigvals(field.slopes(states, ()))).max()
    time = 1.0 / (max(fastest, np.abs(field.at(states).rates / sizes).max()) or 1.0)
    length = time
    with suppress(StickslipError):  # a motion that cannot be continued
        for _ in range(LONGER):
            motion = simulate(fmu, length, output_times=np.linspace(0.0, length, SAMPLES), **fmu.settings(values))
            x, rates = (np.stack([motion[n.format(name)] for name in fmu.states]) for n in ("{}", "der({})"))
            moves = x.std(axis=1) > ROUNDING * np.abs(x).max(axis=1)
            if not moves.any():
                break
            with np.errstate(divide="ignore"):  # what jumps alone has no rate
                times = x[moves].std(axis=1) / np.sqrt((rates[moves] ** 2).mean(axis=1))
            time = times[times < length / DRIFTS].max(initial=0.0) or time
            rates_here = np.abs(np.linalg.eigvals(field.slopes(x[:, -1], ())))
            slowest = rates_here[rates_here > SLOW * rates_here.max()].min(initial=np.inf)
            if length > max(CHANGES * time, 1.0 / slowest):  # a slow phase is not all of it
                break
            length *= 4.0
    return time
