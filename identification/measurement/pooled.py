"""Logs of one rig that have been made ready for a fit, and the constants of the rig."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.shown import Shown
from identification.inference.adjustment import ConstantReading
from identification.inference.problem import Prior
from identification.measurement.disc_motion import angle_sensor, corrected, zeroed
from identification.measurement.free_decay import FreeDecay
from identification.measurement.motion import DiscMotion, SensorFit
from identification.measurement.slip_segments import SlipSegment, long_enough
from rig_io.logs.arrangement import Arrangement

_ASSUMED: dict[Arrangement, str] = {
    "together": "both discs touch at every angle",
    "sequential": "one disc touches at a time: disc 0 below the angle theta_s, disc 1 from there on",
    "overlapping": "disc 0 touches up to the angle alpha, disc 1 from -alpha on",
}
LASER = frozenset({"gain", "laser", "delay"})
SENSED = LASER | {"zero", "lines"}  # what moves the angle
SPEED = "w_"  # before the number of a log: speed of its drives over the nominal one
DRAWS = 24
CHANGES = 2.0  # K, of a temperature whose effect on friction is sought: thermometers are off by a tenth of it


@dataclass(frozen=True)
class RigValues:
    """Constants of the rig in one fit, SI: J kg*m^2, k N*m/rad, c N*m*s/rad, R m, r m, forces N (normal force of each
    driving disc, in the order of the pool's contacts)."""

    J: float
    k: float
    c: float
    R: float
    r: float
    forces: tuple[float, ...]

    @property
    def N(self) -> float:
        """Normal force of the driving disc, or of the first of two."""
        return self.forces[0]

    @property
    def spring(self) -> float:
        """Friction coefficient that holds the spring where the body has turned by a radian, k/(R N)."""
        return self.k / (self.R * self.N)

    @property
    def natural_period(self) -> float:
        """2 pi sqrt(J/k), s."""
        return float(2 * np.pi * np.sqrt(self.J / self.k))


@dataclass(frozen=True, eq=False)
class Pool(Shown):
    """Logs ready for a fit. contacts: names of the driving discs in any of the logs, each with its material in
    ``materials`` (if stated); arrangement: of logs with two discs; segments of all logs, in order of motions and
    time; readings: what else is known of the constants in ``priors``; zero: what is known of that of an
    encoder, where nothing else shows the angle; decay: a free one of the rig, where there is one; temperature: K, its
    mean over the logs, where all record it."""

    motions: tuple[DiscMotion, ...]
    segments: tuple[SlipSegment, ...]
    sensors: SensorFit
    priors: tuple[Prior, ...]
    contacts: tuple[str, ...]
    materials: tuple[str, ...]
    arrangement: Arrangement
    threshold: float
    warnings: tuple[str, ...]
    readings: tuple[ConstantReading, ...] = ()
    zero: Prior | None = None
    decay: FreeDecay | None = None
    temperature: float | None = None

    @property
    def warms(self) -> bool:
        """Whether a temperature is recorded that changes enough to show its effect on friction."""
        rows = [motion.warmer for motion in self.motions if motion.warmer is not None]
        return bool(rows) and float(np.ptp(np.concatenate(rows))) >= CHANGES

    @property
    def values(self) -> RigValues:
        """Constants at their stated values."""
        return rig_of(self.priors)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Sentences on what the laser sees, and on how two discs touch."""
        lasers = (m.log.calibration.laser for m in self.motions if angle_sensor(m.log) == "laser")
        seen = dict.fromkeys(laser.words for laser in lasers if laser)
        touch = (_ASSUMED[self.arrangement], "each disc has a law of its own") if len(self.contacts) > 1 else ()
        return (*seen, *touch)

    @property
    def natural_period(self) -> float:
        """2 pi sqrt(J/k), s."""
        return self.values.natural_period

    def with_constants(self, values: Mapping[str, float]) -> Pool:
        """The same logs of a rig with other constants, by name; those that are not named stay."""
        return replace(
            self, priors=tuple(replace(prior, value=values.get(prior.name, prior.value)) for prior in self.priors)
        )

    def loosened(self, deviations: Mapping[str, float]) -> Pool:
        """The same logs, of whose constants and laser's gain some are known to these relative deviations only."""
        priors = tuple(
            replace(prior, standard_uncertainty=deviations[prior.name] * prior.value, stated=True)
            if prior.name in deviations
            else prior
            for prior in self.priors
        )
        if "gain" not in deviations:
            return replace(self, priors=priors)
        covariance = self.sensors.covariance + np.diag([deviations["gain"] ** 2, 0.0])
        return replace(self, priors=priors, sensors=replace(self.sensors, covariance=covariance))

    def moved(self, moved: Mapping[str, float], window: float) -> tuple[list[SlipSegment], list[int], RigValues]:
        """Segments that hold ``window`` s, the number of the log of each, and the rig, where what is taken as given is
        moved: constants by a share of themselves, the laser by "gain" (relative) and "delay" (s), the zero of an
        encoder by "zero" (rad), its lines as draw number "lines" has them."""
        values = {prior.name: prior.value * (1 + moved.get(prior.name, 0.0)) for prior in self.priors}
        segments = self.segments
        if "R" in moved and self.laser_alone:
            # a laser alone measures R sin(angle)
            moved = {**moved, "gain": (1 + moved.get("gain", 0.0)) / (1 + moved["R"]) - 1}
        if any(name in SENSED or name.startswith(SPEED) for name in moved):
            segments = self.with_sensors(moved)
        long = long_enough(segments, window)
        return long, [self.log_number(segment) for segment in long], rig_values(values)

    def with_sensors(self, moved: Mapping[str, float]) -> tuple[SlipSegment, ...]:
        """The same segments with the angle moved, see `moved`."""
        motions = {id(motion): self._sensed(number, motion, moved) for number, motion in enumerate(self.motions)}
        return tuple(replace(segment, motion=motions[id(segment.motion)]) for segment in self.segments)

    def _sensed(self, number: int, motion: DiscMotion, moved: Mapping[str, float]) -> DiscMotion:
        if not LASER.isdisjoint(moved):
            gain = (1 + moved.get("gain", 0.0)) * (1 + moved.get("laser", 0.0)) - 1
            motion = corrected(motion, gain, moved.get("delay", 0.0))
        if speed_name(number) in moved:
            motion = replace(motion, drives=motion.drives * (1 + moved[speed_name(number)]))
        if "zero" in moved:
            motion = zeroed(motion, moved["zero"])
        if "lines" in moved and motion.passes is not None:
            ruling = np.random.default_rng(int(moved["lines"])).standard_normal(int(motion.passes.line.max()) + 1)
            passes = motion.passes.turned(self.sensors.rms * ruling[motion.passes.line])
            motion = replace(motion, passes=passes, angle=passes.between(motion.time))
        return motion

    @property
    def laser_alone(self) -> bool:
        """Whether a laser shows the angle and no encoder its gain."""
        return self.sensors.lines == 0 and any(angle_sensor(motion.log) == "laser" for motion in self.motions)

    @property
    def slips_both_ways(self) -> bool:
        """Whether discs slip forward in some of the slips and backward in others."""
        return len({segment.sign for segment in self.segments}) > 1

    @property
    def drawn(self) -> int:
        """How many draws of the misplacement of an encoder's lines stand for it; 0 where it does not show the angle."""
        return DRAWS if any(motion.passes is not None for motion in self.motions) else 0

    def log_number(self, segment: SlipSegment) -> int:
        """Place of the segment's log among ``motions``, whose sensors may have been moved."""
        return next(i for i, motion in enumerate(self.motions) if motion.log is segment.motion.log)


def speed_name(number: int) -> str:
    """The name of the ratio of actual to nominal drive speed in a log, by the log's number."""
    return f"{SPEED}{number + 1}"


def rig_of(constants: Iterable[Prior]) -> RigValues:
    """The rig with these constants."""
    return rig_values({constant.name: constant.value for constant in constants})


def rig_values(values: dict[str, float]) -> RigValues:
    """Constants from priors: k and c as they are, or from k/J and c/J of a free decay and J; N, or N0 and N1."""
    J = values["J"]
    k = values["k"] if "k" in values else J * values["k/J"]
    c = values["c"] if "c" in values else J * values["c/J"]
    forces = tuple(values[name] for name in ("N", "N0", "N1") if name in values)
    return RigValues(J, k, c, values["R"], values["r"], forces)
