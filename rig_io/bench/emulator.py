"""The bench, emulated: the oscillator (its FMU), driven unevenly, seen through imperfect instruments, written as a log.

    drive speeds with ripple -> FMU of disc_rig -> angle, speed at 5 kHz -> laser, encoder, drive encoders -> RigLog

A seed fixes the specimens of the instruments (line errors, gain error, phases), and with the log's number all noise:
one seed gives one bench, and logs of one bench share its faults.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.signal import Signal
from rig_io.bench.disturbances import Moment
from rig_io.bench.drive import with_holds
from rig_io.bench.emulation import LOAD_STEP, Disc, Emulation
from rig_io.bench.materials import CONTI, STANDARD_SPEEDS, material
from rig_io.bench.oscillator import Turning, simulated
from rig_io.logs.arrangement import CHANGEOVER
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.log import Experiment, InstrumentCalibrations, LaserCalibration, RigLog
from rig_io.packages.datapackage import check_target, write_package
from rig_io.sensors.motion import Motion, integrated


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
    motion = _shifted(simulated(settings, drives, total, factors), settings.transient)
    samples = int(np.floor(settings.duration * settings.sampling_rate + 1e-9)) + 1
    ticks = np.round(np.arange(samples) / settings.sampling_rate, 9)
    columns: dict[str, np.ndarray] = {}
    moved = settings.disturbances
    if moved is not None:
        motion = replace(motion, angle=motion.angle + moved.size("zero"))

    def added(acts: str, time: np.ndarray, at: np.ndarray) -> np.ndarray | float:
        """What disturbances add to a quantity."""
        return _added(settings, acts, time, at, seed, number)

    if settings.laser is not None:
        radius, seen = settings.rig.value("R"), ticks + added("read", ticks, ticks)
        volts = settings.laser.read(motion, seen, radius, _rng(seed, _LASER), _rng(seed, _LASER, number))
        if moved is not None:
            wrong = moved.displacement(ticks, _rng(seed, _DISTURBED, number, 1))
            volts = volts + (wrong + added("laser", ticks, motion.angle_at(seen))) / settings.laser.gain
        columns["laser"] = volts
    if (sensor := settings.speed_sensor) is not None:
        streams = _rng(seed, _SPEED), _rng(seed, _SPEED, number)
        columns[sensor.kind] = sensor.read(motion, ticks, settings.rig.value("R"), *streams)
    shafts = {"encoder": (settings.encoder, motion, _ENCODER)}
    for i, (time, speed, start) in enumerate(drives):
        turned = _shifted(integrated(time, speed), settings.transient)
        if moved is not None:  # the counter runs on from log to log
            turned = replace(turned, angle=turned.angle + start)
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
            wrong = 0 * turning.time + added(shaft, turning.time, turning.angle)
            turning = Motion(turning.time, turning.angle + wrong, turning.speed + np.gradient(wrong, turning.time))
            count, edge_time = encoder.ruled(_rng(seed, stream)).read(turning, ticks)
            columns[f"{shaft}_count"] = count + added(f"{shaft}_count", ticks, count)
            columns[f"{shaft}_edge_time"] = edge_time + added("edge_time", edge_time, count)
            calibrations[shaft] = encoder.calibration
    return RigLog(
        name=settings.name,
        time=ticks,
        columns=columns,
        units={name: COLUMNS[name].unit for name in (TIME.name, *columns)},
        rig=settings.rig if len(settings.discs) == 2 else replace(settings.rig, N1=None),
        calibration=InstrumentCalibrations(laser=_laser_calibration(settings), **calibrations),
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
    check_target(Path(folder), [emulation.name for emulation in settings], overwrite)
    logs = []
    for number, emulation in enumerate(settings):
        if progress is not None:
            progress(emulation.name)
        logs.append(emulate(emulation, seed, number))
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


def _drive(settings: Emulation, i: int, total: float, seed: int, number: int) -> Turning:
    nominal = settings.discs[i].drive_speed
    if settings.speed_deviation:
        nominal *= 1 + settings.speed_deviation * float(_rng(seed, _DRIVES[i], number, 2).standard_normal())
    time, speed, start = np.array([0.0, total]), np.array([nominal, nominal]), 0.0
    if settings.ripple is not None:
        specimen, noise = _rng(seed, _DRIVES[i], 0, 0), _rng(seed, _DRIVES[i], number, 1)
        time, speed, start = settings.ripple.speed(nominal, total, specimen, noise)
    if settings.holds:
        time, speed = with_holds(time, speed, settings.holds, settings.transient)
    return time, speed, start


def _added(
    settings: Emulation, acts: str, time: np.ndarray, at: np.ndarray, seed: int, number: int
) -> np.ndarray | float:
    if settings.disturbances is None:
        return 0.0
    moment = Moment(time, at, settings.duration, _rng(seed))
    return settings.disturbances.added(acts, moment, lambda kind: _rng(seed, _DISTURBED, number, 2, kind))


def _loads(settings: Emulation, drives: Sequence[Turning], seed: int, number: int) -> dict[str, Signal]:
    """Factors of the normal force, and a torque beside, over the time of the run; none without disturbances."""
    if settings.disturbances is None:
        return {}
    total = settings.transient + settings.duration
    fine = np.append(np.arange(0.0, total, LOAD_STEP), total)
    torque = _added(settings, "torque", fine - settings.transient, fine, seed, number)
    beside = {"torque0": Signal(fine, torque)} if isinstance(torque, np.ndarray) else {}
    if not drives:
        return beside
    ((time, speed, start),) = drives
    angle = start + np.interp(fine, time, integrated(time, speed).angle)
    log = fine - settings.transient
    factor = settings.disturbances.load(log, angle, settings.duration, number, _rng(seed, _DISTURBED))
    return {"load0": Signal(fine, factor), **beside}


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
        truth["disturbances"] = dict(settings.disturbances.sizes)
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
