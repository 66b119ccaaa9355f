"""Spectra: lines of periodic motions without leakage, and Welch's estimate with its error for all others.

    periodic   x(t) = sum of c_k exp(i k w t),   c_k = 1/T * integral over a period of x exp(-i k w t)
               by Gauss's rule on the smooth pieces between events, so that no line leaks into another
    otherwise  mean of the periodograms of overlapping windowed segments; their number says, by the chi-squared
               distribution, between which bounds the density lies

Source: Welch, IEEE Transactions on Audio and Electroacoustics 15 (1967).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.signal import welch
from scipy.stats import chi2

from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.declaration import WATCHED, Analysis, Option
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.families.jobs import Jobs
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.trajectory import Trajectory

NODES = 24  # of Gauss's rule on a panel
PANELS = 0.25  # of the period of the highest line: longest panel
CONFIDENCE = 0.95
# independent segments that one is worth which overlaps its neighbours by half, with Hann's window: 1/(1 + 2/36)
WORTH = 0.947
LONGEST = 24  # period that is looked for
SAMPLES = 64  # of a period of the forcing, of a motion without one


@dataclass(frozen=True, eq=False)
class Spectrum(Pictured):
    """The spectrum of one variable.

    Attributes:
        of, unit: its name and unit.
        frequency: (n,) Hz.
        amplitude: (n,) one-sided amplitudes of lines, in that unit; or a density, unit^2/Hz.
        low, high: (n,) bounds of a density, 95 %; equal to it for lines, which are exact.
        phase: (n,) rad, of the cosine of each line; nan of a density.
        mean_square: of the variable, in unit^2.
        lines: these are lines of a periodic motion.
        period: steps of the section after which the motion repeats itself; 0 of a density.
        how: of ``SectionSystem``, of lines.
        model: its name.
    """

    COLUMNS: ClassVar = ("[frequency]=frequency", "{measure}=amplitude", "low", "high", "phase")
    RECORD: ClassVar = (
        *("model", "of", "lines", "period", "mean_square", "frequency", "amplitude", "low", "high", "how"),
    )

    of: str
    unit: str
    frequency: Vector
    amplitude: Vector
    low: Vector
    high: Vector
    phase: Vector
    mean_square: float
    lines: bool
    period: int
    how: str = ""
    model: str = ""

    @property
    def measure(self) -> str:
        """The meaning of the amplitudes: of lines, or a density."""
        return "amplitude" if self.lines else "density"

    def _heading(self) -> str:
        return f"Spectrum of {self.of}: {'lines' if self.lines else 'density'}"

    def _contents(self) -> Mapping[str, Any]:
        shown = {"frequency": self.frequency, "amplitude": self.amplitude, "mean square": self.mean_square}
        return {**shown, "how": self.how or None}


def line_spectrum(system: Strobe, motion: PeriodicMotion, of: str | None = None, *, lines: int = 8) -> Spectrum:
    """The lines of a periodic motion of a forced oscillator.

    Args:
        system: its strobe, with the parameters of the motion.
        motion: of it.
        of: a state or output; the first state if left out.
        lines: harmonics of the forcing; so many times the period of the motion are computed, and the mean.

    Raises:
        StickslipError: no such variable, or fewer than one line.
    """
    name = of or system.fmu.states[0]
    refuse_unknown(name, (*system.fmu.states, *system.fmu.outputs), f"There is no variable '{name}'.")
    if lines < 1:
        raise StickslipError(f"At least one line is computed, found {lines}.")
    count = lines * motion.period * system.every
    point = motion.points[0]
    events = system.trajectory(point, np.array([motion.time])).events
    edges = np.unique([0.0, motion.time, *(e.time for e in events if 0.0 < e.time < motion.time)])
    times, weights = _nodes(edges, motion.time / count * PANELS)
    values = system.trajectory(point, np.append(times, motion.time))[name][:-1]
    turns = np.exp(-2j * np.pi * np.outer(np.arange(count + 1), times / motion.time))
    coefficients = (turns * weights) @ values / motion.time
    amplitude = np.abs(coefficients) * np.where(np.arange(count + 1) > 0, 2.0, 1.0)
    unit, frequency = str(system.fmu.variables[name].unit or "1"), np.arange(count + 1) / motion.time
    columns = amplitude, amplitude, amplitude, np.angle(coefficients)
    mean_square = float(weights @ values**2 / motion.time)
    return Spectrum(name, unit, frequency, *columns, mean_square, True, motion.period, system.how)


def _nodes(edges: Vector, longest: float) -> tuple[Vector, Vector]:
    """Places and weights of Gauss's rule on the panels of every piece, narrower towards its ends: a force that begins
    with a root makes the motion smooth there to a few orders only."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    places, weights = [], []
    for first, end in pairwise(edges):
        count = max(4, int(np.ceil((end - first) / longest)))
        inner = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count + 1)))
        ticks = first + (end - first) * inner
        middle, half = 0.5 * (ticks[1:] + ticks[:-1]), 0.5 * np.diff(ticks)
        places.append((middle[:, None] + half[:, None] * x).ravel())
        weights.append((half[:, None] * w).ravel())
    return np.concatenate(places), np.concatenate(weights)


def density_spectrum(trajectory: Trajectory, of: str | None = None, *, segments: int = 16) -> Spectrum:
    """The density of a motion without period.

    Args:
        trajectory: sampled evenly.
        of: a variable of it; the first state if left out.
        segments: into which it is cut, overlapping by half.

    Raises:
        StickslipError: no such variable, samples that are not even, or too few.
    """
    name = of or next(n for n in trajectory.values if f"der({n})" in trajectory.values)
    refuse_unknown(name, trajectory.values, f"There is no variable '{name}'.")
    steps = np.diff(trajectory.time)
    if len(steps) < 16 * segments or steps.max() - steps.min() > 1e-6 * steps.mean():
        raise StickslipError(
            f"A spectrum of {segments} segments needs at least {16 * segments} even samples, found {len(steps) + 1} "
            f"with steps from {steps.min():g} to {steps.max():g} s. Give even output_times."
        )
    values = trajectory[name]
    length = 2 * len(values) // (segments + 1)
    frequency, density = welch(values, 1.0 / float(steps.mean()), "hann", length, detrend="constant")
    freedom = max(2.0, 2.0 * WORTH * (2 * len(values) // length - 1))
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = freedom / chi2.ppf([1.0 - tail, tail], freedom)
    nothing = np.full(frequency.size, np.nan)
    unit = str(trajectory.units.get(name, "1"))
    mean_square = float(np.mean(values**2))
    return Spectrum(name, unit, frequency, density, low * density, high * density, nothing, mean_square, False, 0)


def spectrum(
    what: Trajectory | PeriodicMotion, of: str | None = None, *, system: Strobe | None = None, **options: Any
) -> Spectrum:
    """The spectrum of a trajectory (``density_spectrum``), or of a periodic motion of ``system`` (``line_spectrum``).

    Raises:
        StickslipError: a periodic motion without its system; else as the two.
    """
    if isinstance(what, Trajectory):
        return density_spectrum(what, of, **options)
    if not isinstance(system, Strobe):
        raise StickslipError("A periodic motion has lines by the oscillator it is of: say its strobe, as system=...")
    return line_spectrum(system, what, of, **options)


def motion_spectrum(
    system: SectionSystem,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    of: Annotated[str | None, Option("State or output.", default="the first state")] = None,
    transient: Annotated[int, Option("Periods before that.", minimum=0)] = 1000,
    lines: Annotated[int, Option("Harmonics of the forcing, of a periodic motion.", minimum=1)] = 8,
    periods: Annotated[int, Option("Periods of the forcing, of another motion.", minimum=32)] = 1024,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Spectrum:
    """Compute the lines of a periodic motion, or the density of one that is not.

    Raises:
        StickslipError: a map, an unknown variable, or a motion that ends before it is settled.
    """
    if not isinstance(system, Strobe):
        raise StickslipError(f"'{system.name}' is a map, whose steps have no spectrum in Hz. Name an oscillator.")
    point = system.start(start)
    rows = system.make(Jobs(point[None], transient=transient, rows=2 * LONGEST, longest=LONGEST), progress=progress)
    motion = claimed(system, rows, longest=LONGEST).motions[0]
    if motion is not None:
        return replace(line_spectrum(system, motion, of, lines=lines), model=system.name)
    if not rows.filled[0]:
        raise StickslipError(f"The motion ends before it is settled: {next(iter(rows.messages.values()), 'lost')}.")
    length = float(system.periods({}, 1)[0])
    times = np.arange(periods * SAMPLES, dtype=float) * (length / SAMPLES)
    return replace(density_spectrum(system.trajectory(rows.ends[0], times), of), model=system.name)


def _numbers(result: Spectrum) -> dict[str, float]:
    if not result.lines:
        raise StickslipError(
            f"The motion has no lines: it does not repeat itself within {LONGEST} periods. Run longer, or ask "
            "'stickslip spectrum' for its density."
        )
    lines = {f"line{k}": float(amplitude) for k, amplitude in enumerate(result.amplitude)}
    return {"period": 1.0 / float(result.frequency[1]), "mean_square": result.mean_square, **lines}


ANALYSIS = Analysis(
    function=motion_spectrum,
    numbers=_numbers,
    results="`line0`, `line1` and so on, of the first state, `mean_square`, `period`",
    example="hinge_clearance --forcing f --set f=0.408 --figure lines.png",
    label="settling",
    without=("every", *WATCHED, "stepper"),
    page=False,
    forced=True,
    of_run=lambda count: {"transient": count},
)
