"""The bench, emulated: the oscillator (its FMU), driven unevenly, seen through imperfect instruments, written as a log.

    drive speeds with ripple -> FMU of disc_rig -> angle, speed at 5 kHz -> laser, encoder, drive encoders -> RigLog

A seed fixes the specimens of the instruments (line errors, gain error, phases), and with the log's number all noise:
one seed gives one bench, and logs of one bench share its faults.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.shown import Shown
from rig_io.bench.disturbances import Disturbances, disturbed_oscillator
from rig_io.bench.drive import Ripple, held_duration, with_holds
from rig_io.logs.arrangement import CHANGEOVER, MODELS, Arrangement
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.log import (
    Calibration,
    Experiment,
    LaserCalibration,
    Quantity,
    RigConstants,
    RigLog,
)
from rig_io.packages.datapackage import check_target, write_package
from rig_io.repair.table import SHORTEST
from rig_io.sensors.encoder import Encoder
from rig_io.sensors.laser import Laser
from rig_io.sensors.load_cell import LoadCell
from rig_io.sensors.motion import Motion, integrated
from rig_io.sensors.speed_sensor import SpeedSensor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.scene import Scene
    from fmu_models.simulation.signal import Signal

TRUTH_RATE = 5000.0  # Hz, at which the motion is sampled before the instruments see it
LONGEST = 1000.0  # s of transient and log; 5 million samples of the truth
LOAD_STEP = 5e-3  # s between knots of a disturbed normal force: its second harmonic bends by 1e-5 of itself between
FASTEST = 100.0  # rad/s, of a drive; those of the rig reach 2.7
CONTI = "conti"


@dataclass(frozen=True)
class Material:
    """A friction pair, and the parameters of its law, in SI: mu_s, mu_k, p of Conti's, or those of another one that is
    declared (its name, file or module)."""

    name: str
    values: Mapping[str, float]
    law: str = CONTI


# the paper's Table 1
MATERIALS: Mapping[str, Material] = {
    m.name: m
    for m in (
        Material("paper/paper", {"mu_s": 0.35, "mu_k": 0.25, "p": 15.0}),
        Material("liner/rubber", {"mu_s": 0.50, "mu_k": 0.33, "p": 20.0}),
        Material("paper/rubber", {"mu_s": 0.65, "mu_k": 0.35, "p": 15.0}),
    )
}

# drive speeds (rad/s) that tell the three parameters apart and still show stick at the standard normal force: the
# largest brings the slip speed to 2/p and beyond (paper/rubber 2.7/p, liner/rubber 2.1/p; paper/paper, which loses
# stick above 0.54 rad/s, gets no further than 0.95/p, and below 0.1 rad/s its slips are too short)
STANDARD_SPEEDS: Mapping[str, tuple[float, ...]] = {
    "paper/paper": (0.13, 0.35, 0.52),
    "liner/rubber": (0.2, 0.41, 0.83),
    "paper/rubber": (0.41, 0.83, 1.4),
}

# the paper's appendix; uncertainties and normal forces (0.5 kg of dead weight) are assumed
RIG = RigConstants(
    J=Quantity(0.0548, "kg*m^2", 0.0003),
    k=Quantity(2.62, "N*m/rad", 0.015),
    c=Quantity(0.055, "N*m*s/rad", 0.001),
    R=Quantity(0.125, "m", 0.00005),
    r=Quantity(0.06, "m", 0.00005),
    N0=Quantity(4.905, "N", 0.005),
    N1=Quantity(4.905, "N", 0.005),
)


def material(name: str) -> Material:
    """A friction pair of Table 1 by name.

    Raises:
        StickslipError: unknown name.
    """
    if name not in MATERIALS:
        raise StickslipError(f"There is no material '{name}'.{nearest(name, MATERIALS)}")
    return MATERIALS[name]


@dataclass(frozen=True)
class Disc:
    """A driving disc in contact: its friction pair and its nominal speed, rad/s."""

    material: Material = MATERIALS["paper/rubber"]
    drive_speed: float = 0.83


@dataclass(frozen=True)
class MicroSlip:
    """Elastic contact below gross slip (LuGre); stiffness N/m (2e4 to 5e4 with rubber, 5e5 without), damping N s/m."""

    stiffness: float = 5e4
    damping: float = 100.0


@dataclass(frozen=True)
class Emulation(Shown):
    """One log to be emulated. Times in s, rates in Hz, angles in rad.

    discs: none for a free decay from ``start_angle``, one, or two. laser, encoder, drive_encoder, ripple and micro_slip
    may be None: not fitted, or ideal. speed_deviation: of the drives from their nominal speeds, relative, drawn for
    each log. arrangement: of two discs; changeover: the angle from which on disc 1 is touched
    instead of disc 0 (sequential), or up to which on either side both are (overlapping). scene: has the oscillator and
    its start in place of a rig at rest. disturbances: of a bench as it is, with disc 0 alone or none. load_cell:
    of each driving disc. speed_sensor: a tachometer or vibrometer of the disc. at_rest: the disc is let go at
    ``start_angle``, not carried along by disc 0. holds: s each, for which the drives stop one after the other
    (drive.py).
    """

    name: str
    discs: tuple[Disc, ...] = (Disc(),)
    rig: RigConstants = RIG
    arrangement: Arrangement = "together"
    changeover: float = 0.0
    duration: float = 20.0
    transient: float = 5.0
    sampling_rate: float = 1000.0
    start_angle: float = 0.0
    at_rest: bool = False
    laser: Laser | None = field(default_factory=Laser)
    encoder: Encoder | None = field(default_factory=Encoder)
    drive_encoder: Encoder | None = field(default_factory=Encoder)
    ripple: Ripple | None = field(default_factory=Ripple)
    speed_deviation: float = 0.0
    load_cell: LoadCell | None = None
    speed_sensor: SpeedSensor | None = None
    micro_slip: MicroSlip | None = None
    scene: Scene | None = None
    disturbances: Disturbances | None = None
    holds: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raises StickslipError: more than two discs, no angle sensor, a time, rate or speed out of range."""
        if len(self.discs) > 2:
            raise StickslipError(f"'{self.name}': the rig has places for two driving discs, not {len(self.discs)}.")
        if self.arrangement not in MODELS:
            raise StickslipError(
                f"'{self.name}': there is no arrangement '{self.arrangement}'.{nearest(self.arrangement, MODELS)}"
            )
        if self.arrangement != "together" and len(self.discs) != 2:
            raise StickslipError(
                f"'{self.name}': discs arranged '{self.arrangement}' are two, not {len(self.discs)}. Give both."
            )
        if self.disturbances is not None and (len(self.discs) > 1 or self.scene is not None):
            raise StickslipError(f"'{self.name}': disturbances are emulated of the rig with one disc, without a scene.")
        if any(not hold > 0 for hold in self.holds) or (self.holds and not self.discs):
            raise StickslipError(f"'{self.name}': holds are of a disc's drive and last longer than 0 s.")
        if self.holds and self.duration < held_duration(self.holds):
            raise StickslipError(
                f"'{self.name}': {self.duration:g} s have no room for {len(self.holds)} holds. Let the log last "
                f"{held_duration(self.holds):g} s."
            )
        if self.micro_slip is not None and any(disc.material.law != CONTI for disc in self.discs):
            raise StickslipError(f"'{self.name}': micro-slip is emulated before Conti's law. Leave out one of the two.")
        if self.laser is None and self.encoder is None:
            raise StickslipError(f"'{self.name}': no sensor sees the disc. Fit the laser or the encoder.")
        if not (self.duration > 0 and self.transient >= 0 and self.duration + self.transient <= LONGEST):
            raise StickslipError(
                f"'{self.name}': a duration of {self.duration:g} s after a transient of {self.transient:g} s cannot be "
                f"emulated. Choose a positive duration, a transient not negative, together up to {LONGEST:g} s."
            )
        if not (self.sampling_rate * self.duration >= SHORTEST and self.sampling_rate <= 2.0 * TRUTH_RATE):
            raise StickslipError(
                f"'{self.name}': {self.sampling_rate:g} Hz over {self.duration:g} s is no log. Take at least "
                f"{SHORTEST} samples, at up to {2.0 * TRUTH_RATE:g} Hz."
            )
        for disc in self.discs:
            if not abs(disc.drive_speed) <= FASTEST:
                raise StickslipError(
                    f"'{self.name}': a drive speed of {disc.drive_speed:g} rad/s is out of range. The rig's drives "
                    f"reach 2.7 rad/s; up to {FASTEST:g} is emulated."
                )

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the discs in contact."""
        return tuple(f"disc{i}" for i in range(len(self.discs)))


def free_decay(name: str = "free-decay", start_angle: float = 0.15, **settings: Any) -> Emulation:
    """Settings of a free decay: the disc is let go at ``start_angle`` with the log, no driving disc touches it."""
    return Emulation(name, discs=(), transient=0.0, start_angle=start_angle, **settings)


def emulate(settings: Emulation, seed: int = 0, number: int = 0) -> RigLog:
    """One log. seed: of the bench; number: of the log on that bench (other noise, same instruments).

    Raises:
        StickslipError: settings outside the physical range of the model.
    """
    if seed < 0 or number < 0:
        raise StickslipError(f"The seed {seed} and the number {number} of a log must not be negative.")
    total = settings.transient + settings.duration
    drives = [_drive(settings, i, total, seed, number) for i in range(len(settings.discs))]
    factors = _loads(settings, drives, seed, number)
    motion = _shifted(_simulated(settings, drives, total, factors), settings.transient)
    samples = int(np.floor(settings.duration * settings.sampling_rate + 1e-9)) + 1
    ticks = np.round(np.arange(samples) / settings.sampling_rate, 9)
    columns: dict[str, np.ndarray] = {}
    moved = settings.disturbances
    if moved is not None:
        motion = replace(motion, angle=motion.angle + moved.zero)
    if settings.laser is not None:
        radius = settings.rig.value("R")
        volts = settings.laser.read(motion, ticks, radius, _rng(seed, _LASER), _rng(seed, _LASER, number))
        if moved is not None:
            volts = volts + moved.displacement(ticks, _rng(seed, _DISTURBED, number, 1)) / settings.laser.gain
        columns["laser"] = volts
    if (sensor := settings.speed_sensor) is not None:
        streams = _rng(seed, _SPEED), _rng(seed, _SPEED, number)
        columns[sensor.kind] = sensor.read(motion, ticks, settings.rig.value("R"), *streams)
    shafts = {"encoder": (settings.encoder, motion, _ENCODER)}
    for i, (time, speed, begin) in enumerate(drives):
        turned = _shifted(integrated(time, speed), settings.transient)
        if moved is not None:  # the counter runs on from log to log
            turned = replace(turned, angle=turned.angle + begin)
        shafts[f"drive{i}"] = (settings.drive_encoder, turned, _DRIVES[i])
    calibrations: dict[str, Any] = {}
    for i in range(len(settings.discs) if settings.load_cell is not None else 0):
        assert settings.load_cell is not None
        factor = factors.get(f"load{i}")
        over = np.ones(samples) if factor is None else np.interp(ticks + settings.transient, factor.time, factor.value)
        streams = _rng(seed, _LOADS[i]), _rng(seed, _LOADS[i], number)
        columns[f"load{i}"] = settings.load_cell.read(settings.rig.value(f"N{i}") * over, *streams)
        calibrations[f"load{i}"] = settings.load_cell.calibration
    for shaft, (encoder, turning, stream) in shafts.items():
        if encoder is not None:
            count, edge_time = encoder.ruled(_rng(seed, stream)).read(turning, ticks)
            columns |= {f"{shaft}_count": count, f"{shaft}_edge_time": edge_time}
            calibrations[shaft] = encoder.calibration
    return RigLog(
        name=settings.name,
        time=ticks,
        columns=columns,
        units={name: COLUMNS[name].unit for name in (TIME.name, *columns)},
        rig=settings.rig if len(settings.discs) == 2 else replace(settings.rig, N1=None),
        calibration=Calibration(laser=_laser_calibration(settings), **calibrations),
        experiment=_experiment(settings, seed, number),
    )


def _laser_calibration(settings: Emulation) -> LaserCalibration | None:
    """What the user knows of the laser; without an encoder that would show its gain also what its maker says of it."""
    if settings.laser is None or settings.encoder is not None:
        return settings.laser.calibration if settings.laser else None
    return replace(settings.laser.calibration, gain_deviation=settings.laser.gain_error)


def emulate_set(
    folder: str | os.PathLike[str],
    settings: Sequence[Emulation],
    seed: int = 0,
    *,
    overwrite: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Logs of one bench as a data package, written whole or not at all; returns the folder.

    progress: called with the name of each log before it is emulated.

    Raises:
        StickslipError: as in `emulate` and `rig_io.logs.log.write_package`.
    """
    check_target(Path(folder), [one.name for one in settings], overwrite)
    logs = []
    for number, one in enumerate(settings):
        if progress is not None:
            progress(one.name)
        logs.append(emulate(one, seed, number))
    return write_package(
        folder,
        logs,
        title="Emulated logs of the disc rig",
        description=f"A disc on a spring, rubbed by driven discs; emulated, seed {seed}. See 'experiment'.",
        overwrite=overwrite,
    )


def standard_set(name: str = "paper/rubber", speeds: Sequence[float] | None = None, **settings: Any) -> list[Emulation]:
    """One single-disc log per drive speed (rad/s; `STANDARD_SPEEDS` if None) and a free decay: what a fit needs.

    settings: of `Emulation`, for all logs.

    Raises:
        StickslipError: unknown material.
    """
    pair = material(name)
    stem = name.replace("/", "-")
    decay = {key: value for key, value in settings.items() if key not in ("transient", "start_angle", "micro_slip")}
    runs = [
        Emulation(f"{stem}-{speed:g}", discs=(Disc(pair, speed),), **settings)
        for speed in (STANDARD_SPEEDS[name] if speeds is None else speeds)
    ]
    return [*runs, free_decay(**decay)]


_LASER, _ENCODER, _DRIVES, _DISTURBED, _LOADS, _SPEED = 1, 2, (3, 4), 5, (6, 7), 8  # streams of random numbers


def _rng(seed: int, *stream: int) -> np.random.Generator:
    return np.random.default_rng([seed, *(s + 1 for s in stream)])


Turning = tuple[np.ndarray, np.ndarray, float]
"""Of a drive: knots (n,) in s, speeds (n,) in rad/s, and its angle (rad) at the first."""


def _drive(settings: Emulation, i: int, total: float, seed: int, number: int) -> Turning:
    nominal = settings.discs[i].drive_speed
    if settings.speed_deviation:
        nominal *= 1 + settings.speed_deviation * float(_rng(seed, _DRIVES[i], number, 2).standard_normal())
    time, speed, begin = np.array([0.0, total]), np.array([nominal, nominal]), 0.0
    if settings.ripple is not None:
        specimen, noise = _rng(seed, _DRIVES[i], 0, 0), _rng(seed, _DRIVES[i], number, 1)
        time, speed, begin = settings.ripple.speed(nominal, total, specimen, noise)
    if settings.holds:
        time, speed = with_holds(time, speed, settings.holds, settings.transient)
    return time, speed, begin


def _loads(settings: Emulation, drives: Sequence[Turning], seed: int, number: int) -> dict[str, Signal]:
    """Factors of the normal force over the time of the run; none without disturbances."""
    if settings.disturbances is None or not drives:
        return {}
    from fmu_models.simulation.signal import Signal

    ((time, speed, begin),) = drives
    fine = np.arange(0.0, time[-1], LOAD_STEP)
    fine = np.append(fine, time[-1])
    angle = begin + np.interp(fine, time, integrated(time, speed).angle)
    log = fine - settings.transient
    factor = settings.disturbances.load(log, angle, settings.duration, number, _rng(seed, _DISTURBED))
    return {"load0": Signal(fine, factor)}


def _shifted(motion: Motion, transient: float) -> Motion:
    """The log's clock starts when the transient is over."""
    return replace(motion, time=motion.time - transient)


def _experiment(settings: Emulation, seed: int, number: int) -> Experiment:
    truth: dict[str, Any] = {"seed": seed, "number": number}
    for contact, disc in zip(settings.contacts, settings.discs, strict=True):
        truth[contact] = dict(disc.material.values)
    if settings.arrangement in CHANGEOVER and settings.scene is None:
        truth[CHANGEOVER[settings.arrangement]] = settings.changeover
    laws = {contact: disc.material.law for contact, disc in zip(settings.contacts, settings.discs, strict=True)}
    if set(laws.values()) - {CONTI}:
        truth["laws"] = laws
    if settings.micro_slip is not None:
        truth["micro_slip"] = asdict(settings.micro_slip)
    if settings.disturbances is not None:
        truth["disturbances"] = asdict(settings.disturbances)
    if settings.scene is not None:
        truth["scene"] = {"name": settings.scene.name, "model": settings.scene.model, **settings.scene.parameters}
    return Experiment(
        kind="stick-slip" if settings.discs else "free-decay",
        contacts=settings.contacts,
        materials=tuple(disc.material.name for disc in settings.discs),
        drive_speed=tuple(disc.drive_speed for disc in settings.discs),
        arrangement=settings.arrangement,
        drive_speed_uncertainty=tuple(
            settings.speed_deviation * abs(disc.drive_speed) for disc in settings.discs if settings.speed_deviation
        ),
        emulation=truth,
    )


def _simulated(
    settings: Emulation, drives: Sequence[Turning], total: float, loads: Mapping[str, Signal] = MappingProxyType({})
) -> Motion:
    """The disc's motion at `TRUTH_RATE`; it starts in stick with disc 0, whence one release leads onto the cycle."""
    from fmu_models.simulation.run import simulate
    from fmu_models.simulation.signal import Signal

    fmu, parameters, given = _oscillator(settings)
    rig = settings.rig
    start = {"theta": settings.start_angle, "omega": 0.0}
    if drives and not settings.at_rest:
        start["omega"] = rig.value("r") * float(drives[0][1][0]) / rig.value("R")
    start |= given
    samples = int(np.ceil(total * TRUTH_RATE - 1e-9)) + 1
    trajectory = simulate(
        fmu,
        total,
        parameters=parameters,
        start=start,
        inputs={f"w{i}": Signal(time, speed) for i, (time, speed, _) in enumerate(drives)} | dict(loads),
        output_times=np.linspace(0.0, total, samples),
    )
    return Motion(trajectory.time, trajectory["theta"], trajectory["omega"])


def _oscillator(settings: Emulation) -> tuple[Fmu, Mapping[str, float], Mapping[str, float]]:
    """The FMU, values of its parameters, and start values that are given: those of the scene, if there is one."""
    from fmu_models.fmu.fmu import Fmu

    if settings.scene is not None:
        from fmu_models.scene.reduce import built_scene, unfolded

        scene = unfolded(settings.scene)
        return Fmu.open(built_scene(scene)), scene.free, scene.start
    if settings.disturbances is not None and settings.discs:
        (law,) = _laws(settings).values()
        return disturbed_oscillator(law), _parameters(settings) | settings.disturbances.parameters, {}
    from fmu_models.codegen.package import built

    laws = {contact: law for contact, law in _laws(settings).items() if law != CONTI}
    fmu = Fmu.open(built(MODELS[settings.arrangement], contacts=settings.contacts, laws=laws))
    return fmu, _parameters(settings), {}


def _laws(settings: Emulation) -> dict[str, str]:
    """The law of each contact."""
    laws = (disc.material.law if settings.micro_slip is None else "lugre" for disc in settings.discs)
    return dict(zip(settings.contacts, laws, strict=True))


def _parameters(settings: Emulation) -> dict[str, float]:
    """The parameters of the FMU, by name."""
    named = {name: settings.rig.value(name) for name in ("J", "k", "c", *(("R", "r") if settings.discs else ()))}
    for i, disc in enumerate(settings.discs):
        law = dict(disc.material.values)
        if settings.micro_slip is not None:
            law |= {"sigma0": settings.micro_slip.stiffness, "sigma1": settings.micro_slip.damping}
        named |= {f"{name}{i}": value for name, value in law.items()}
        named[f"N{i}"] = settings.rig.value(f"N{i}")
    if settings.arrangement in CHANGEOVER:
        named[CHANGEOVER[settings.arrangement]] = settings.changeover
    return named
