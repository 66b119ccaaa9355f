"""A rig log: what the bench recorded, raw, with the constants of the rig and the calibration of its instruments.

A log is a CSV file plus its entry in ``datapackage.json`` beside it (Frictionless data package, a ``unit`` for every
column). Raw volts, counts and edge times are kept; `rig_io.sensors` turns them into angles and speeds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown, Tabular, span
from rig_io.logs.arrangement import Arrangement
from rig_io.logs.beam import BEAMS

if TYPE_CHECKING:
    import pandas

Kind = Literal["stick-slip", "free-decay"]
GAP = 5.0  # sample intervals: across a longer step nothing may be filtered or simulated


@dataclass(frozen=True)
class StatedQuantity:
    """A number, its unit, and its standard uncertainty (one standard deviation, in the same unit; None: not known)."""

    value: float
    unit: str
    standard_uncertainty: float | None = None

    def __str__(self) -> str:
        uncertainty = "unknown" if self.standard_uncertainty is None else f"{self.standard_uncertainty:g}"
        return f"{self.value:g} {self.unit} +- {uncertainty}"


@dataclass(frozen=True)
class RigConstants(Shown):
    """Constants of the rig in SI units; None where nobody measured them.

    J kg*m^2: moment of inertia of the disc; k N*m/rad: rotational stiffness; c N*m*s/rad: damping; R m: radius of the
    disc; r m: radius of the driving discs; N0, N1 N: normal force of each driving disc.
    """

    J: StatedQuantity | None = None
    k: StatedQuantity | None = None
    c: StatedQuantity | None = None
    R: StatedQuantity | None = None
    r: StatedQuantity | None = None
    N0: StatedQuantity | None = None
    N1: StatedQuantity | None = None

    def value(self, name: str) -> float:
        """Value of one constant in its SI unit.

        Raises:
            StickslipError: no such constant, or it is not given in this log.
        """
        return self.quantity(name).value

    def quantity(self, name: str) -> StatedQuantity:
        """One constant with unit and uncertainty; errors as in `value`."""
        names = [f.name for f in fields(self)]
        refuse_unknown(name, names, f"The rig has no constant '{name}'.")
        constant = getattr(self, name)
        if constant is None:
            unit = RIG_UNITS[name]
            raise StickslipError(
                f"The rig constant {name} [{unit}] is needed but not given. State it: stickslip describe FILES --set "
                f"'{name}=VALUE ± UNCERTAINTY {unit}'."
            )
        return constant


RIG_UNITS: Mapping[str, str] = MappingProxyType(
    {"J": "kg*m^2", "k": "N*m/rad", "c": "N*m*s/rad", "R": "m", "r": "m", "N0": "N", "N1": "N"}
)


@dataclass(frozen=True)
class LaserCalibration:
    """Laser telemeter: d = gain*(laser - zero) = R (f(angle + tilt) - f(tilt)), seen ``latency`` ago.

    gain: m/V (1 where the telemeter writes lengths; V then stands for m); zero: V; latency: s; noise: m rms; lowest,
    highest: V, the range within which the reading is valid; gain_deviation: relative standard deviation of the gain,
    None where it is not known; beam: its f, of `BEAMS`; tilt: of the beam off the square with the arm at rest, rad.
    """

    gain: float
    zero: float = 0.0
    latency: float = 0.0
    noise: float = 0.0
    lowest: float = -float("inf")
    highest: float = float("inf")
    gain_deviation: float | None = None
    beam: str = "sine"
    tilt: float = 0.0

    def shown(self, angle: np.ndarray) -> np.ndarray:
        """d/R (n,) at the angles (n,), rad."""
        return BEAMS[self.beam].shows(angle + self.tilt) - BEAMS[self.beam].shows(np.array(self.tilt))

    def angle(self, shown: np.ndarray) -> np.ndarray:
        """Angles (n,), rad, at which it shows d/R (n,); NaN where it shows more than it can."""
        with np.errstate(invalid="ignore"):
            return BEAMS[self.beam].angle(shown + BEAMS[self.beam].shows(np.array(self.tilt))) - self.tilt

    def bent(self, square: float, cubic: float) -> str:
        """Words on the beam or tilt that would show square angle^2 + cubic angle^3 more over R, near rest; nothing
        where that is none of them."""
        more = {name: beam.cubic - BEAMS[self.beam].cubic for name, beam in BEAMS.items()}
        nearest = min(more, key=lambda name: abs(more[name] - cubic))
        seen = BEAMS[nearest]
        if nearest != self.beam:
            return f"{cubic:+.2g} angle^3 is that of d = {seen.formula}: describe the log with laser_beam={nearest}"
        if not seen.turning:
            return ""
        tilt = np.degrees(self.tilt + np.arctan(2 * square / seen.turning))
        return f"{square:+.2g} angle^2 is that of a tilt: describe the log with laser_beam='{nearest} {tilt:.2g} deg'"

    @property
    def words(self) -> str:
        """What it is taken to look at."""
        tilted = f", its beam {np.degrees(self.tilt):.3g} degrees off the square" if self.tilt else ""
        return f"the laser sees {BEAMS[self.beam].words}, d = {BEAMS[self.beam].formula}{tilted}"


@dataclass(frozen=True)
class EncoderCalibration:
    """Incremental encoder: an edge is a ``pitch`` from the next.

    pulses_per_revolution: of one track; quadrature: whether all four edges of the two tracks are counted; clock: s,
    resolution of the edge times; counter_bits: width of the counter, after which it begins anew (None: it does not, or
    the width is to be found from the counts); ratio: its turns in one turn of the disc, where it sits on the motor's
    side of a gear or belt; creep: share by which a belt under load turns the disc less than that; creep_deviation: its
    standard deviation, None where it is not known, 0 of a gear.
    """

    pulses_per_revolution: int
    quadrature: bool = False
    clock: float = 1e-6
    counter_bits: int | None = None
    ratio: float = 1.0
    creep: float = 0.0
    creep_deviation: float | None = None

    @property
    def edges_per_revolution(self) -> int:
        """Counted edges in one revolution of the encoder."""
        return self.pulses_per_revolution * (4 if self.quadrature else 1)

    @property
    def pitch(self) -> float:
        """Angle of the disc between counted edges, rad."""
        return 2.0 * 3.141592653589793 / (self.edges_per_revolution * self.ratio) * (1 - self.creep)

    @property
    def may_creep(self) -> bool:
        """Whether a belt may stand between it and the disc."""
        return self.ratio != 1 and self.creep_deviation != 0


@dataclass(frozen=True)
class LoadCalibration:
    """Load cell of a driving disc. gain_deviation: relative standard deviation of its gain, None where it is not
    known."""

    gain_deviation: float | None = None


@dataclass(frozen=True)
class InstrumentCalibrations(Shown):
    """Calibration of each instrument in the log; None where the rig has none."""

    laser: LaserCalibration | None = None
    encoder: EncoderCalibration | None = None
    drive0: EncoderCalibration | None = None
    drive1: EncoderCalibration | None = None
    load0: LoadCalibration | None = None
    load1: LoadCalibration | None = None

    def need(self, instrument: str) -> Any:
        """Calibration of one instrument.

        Raises:
            StickslipError: the log states none.
        """
        entry = getattr(self, instrument)
        if entry is None:
            example = "GAIN ± UNCERTAINTY m/V, ZERO V" if instrument == "laser" else "LINES_PER_REVOLUTION"
            raise StickslipError(
                f"The log has a column of '{instrument}' but no calibration for it. State it: stickslip describe FILES "
                f"--set '{instrument}={example}'."
            )
        return entry


@dataclass(frozen=True)
class Experiment(Shown):
    """What was done: kind, discs in contact, their materials and nominal speeds (rad/s), with the standard uncertainty
    of these where it is known (it counts where the log does not record how the drives turned).

    arrangement of two discs: both touch always ("together", class b of the disc_rig paper), disc 0 below and disc 1
    from an angle on ("sequential", class c), or with angles at which both touch ("overlapping", class d).
    ``emulation`` holds the truth behind an emulated log (friction law, seed ...) for comparison; no estimator reads it.
    """

    kind: Kind = "stick-slip"
    contacts: tuple[str, ...] = ("disc0",)
    materials: tuple[str, ...] = ()
    drive_speed: tuple[float, ...] = ()
    arrangement: Arrangement = "together"
    drive_speed_uncertainty: tuple[float, ...] = ()
    emulation: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class RigLog(Tabular):
    """One log.

    time: (n_samples,) s, increasing. columns: raw columns by name, each (n_samples,) float64, without ``time``; names
    and units as in `rig_io.logs.columns`; NaN where the file has no number. units: unit of each column (and of time).
    breaks: samples at which a further recording begins, or before which edges were lost; warnings: what was mended when
    it was read; clock_deviation: s, standard deviation of the clock of a second recorder against the first's (0: one
    recorder).
    """

    name: str
    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rig: RigConstants
    calibration: InstrumentCalibrations
    experiment: Experiment
    path: Path | None = None
    breaks: tuple[int, ...] = ()
    warnings: tuple[str, ...] = ()
    clock_deviation: float = 0.0

    @property
    def frame(self) -> pandas.DataFrame:
        """The raw columns as a table indexed by time (s)."""
        import pandas

        table = pandas.DataFrame(dict(self.columns), index=pandas.Index(self.time, name="time"))
        table.attrs["units"] = dict(self.units)
        return table

    def _heading(self) -> str:
        return f"RigLog '{self.name}': {self.kind}, {len(self.time)} samples of {self.duration:g} s"

    def _contents(self) -> dict[str, object]:
        columns = {name: span(data, self.units[name]) for name, data in self.columns.items()}
        return {"contacts": self.contacts, "drive_speed": self.experiment.drive_speed, **columns}

    @property
    def kind(self) -> Kind:
        """ "stick-slip" or "free-decay"."""
        return self.experiment.kind

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the discs in contact."""
        return self.experiment.contacts

    @property
    def duration(self) -> float:
        """Seconds between the first and the last sample."""
        return float(self.time[-1] - self.time[0])

    def has(self, column: str) -> bool:
        """Whether the log holds this column."""
        return column in self.columns

    def column(self, name: str) -> np.ndarray:
        """One raw column, (n_samples,).

        Raises:
            StickslipError: the log has no such column.
        """
        refuse_unknown(name, self.columns, f"Log '{self.name}' has no column '{name}'.")
        return self.columns[name]

    def pieces(self) -> tuple[RigLog, ...]:
        """The log in parts across which nothing may be filtered or simulated: split at `breaks` and at gaps in time.

        The first keeps the log's name, the others are 'name, part 2' and on; times stay as they are.
        """
        begins = sorted({*self.breaks, *(int(at) for at in gaps(self.time))})
        if not begins:
            return (self,)
        return tuple(
            replace(
                self,
                name=self.name if number == 1 else f"{self.name}, part {number}",
                time=self.time[first:last],
                columns={name: values[first:last] for name, values in self.columns.items()},
                breaks=(),
            )
            for number, (first, last) in enumerate(pairwise([0, *begins, len(self.time)]), 1)
        )


def stretches(mask: np.ndarray) -> np.ndarray:
    """First and past-the-last index (m, 2) of each run of true values in (n,)."""
    return np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))).reshape(-1, 2)


def gaps(time: np.ndarray) -> np.ndarray:
    """Samples (m,) before which a rising clock (n,) leaps by more than `GAP` of its usual intervals."""
    steps = np.diff(time)
    return np.flatnonzero(steps > GAP * np.median(steps)) + 1 if len(steps) else np.zeros(0, dtype=np.int64)
