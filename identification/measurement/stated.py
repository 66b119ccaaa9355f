"""What the logs of a pool state of the rig and its sensors, and how well."""

from collections.abc import Sequence

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.adjustment import ConstantReading
from identification.inference.problem import Prior
from identification.measurement.disc_motion import angle_sensor, nominal_drives
from identification.measurement.free_decay import FreeDecay
from identification.measurement.motion import DiscMotion, SensorFit
from identification.measurement.pooled import speed_name
from rig_io.logs.log import RIG_UNITS, RigLog, StatedQuantity


def stated_priors(logs: Sequence[RigLog], contacts: Sequence[str], free_decay: FreeDecay | None) -> tuple[Prior, ...]:
    # a log of one disc may leave out the force of the other
    log = next(log for log in logs if len(log.contacts) == len(contacts))
    forces = {"N": f"N{contacts[0][-1]}"} if len(contacts) == 1 else {"N0": "N0", "N1": "N1"}
    names = {"J": "J", "k": "k", "c": "c", "R": "R", "r": "r", **forces}
    ratios: list[Prior] = []
    if free_decay is not None:
        source = {
            name: "set" if name in free_decay.stated else f"free decay '{free_decay.log}'" for name in ("k/J", "c/J")
        }
        del names["k"], names["c"]
        ratios = [
            Prior(name, value, unit, deviation or 0.0, source[name], deviation is not None)
            for name, value, unit, deviation in (
                ("k/J", free_decay.stiffness_ratio, "1/s^2", free_decay.stiffness_ratio_deviation),
                ("c/J", free_decay.damping_ratio, "1/s", free_decay.damping_ratio_deviation),
            )
        ]
    elif log.rig.k is None or log.rig.c is None:
        absent = [name for name in ("k", "c") if getattr(log.rig, name) is None]
        missing, options = " and ".join(absent), " ".join(f"--set {name}=VALUE" for name in absent)
        raise StickslipError(
            f"Log '{log.name}' does not state {missing}, and there is no free decay among the logs. Record one (the "
            'disc let go with no driving disc in contact, "kind": "free-decay"), from which k/J and c/J follow, or '
            f"state {missing}: stickslip describe FILES {options}."
        )
    stated = []
    for name, entry in names.items():
        quantity = _stated(log, entry)
        if not quantity.value > 0:
            raise StickslipError(
                f"The rig constant {entry} is {quantity.value:g} {quantity.unit}; a fit needs it positive. Give "
                f"another: --set {entry}=VALUE, or in datapackage.json."
            )
        deviation = quantity.standard_uncertainty
        source = "log" if deviation is not None else "log, uncertainty unknown"
        stated.append(Prior(name, quantity.value, quantity.unit, deviation or 0.0, source, deviation is not None))
    return (*stated, *ratios)


def zero_prior(motions: Sequence[DiscMotion], decay: FreeDecay | None) -> Prior | None:
    """What is known of the zero of an encoder that alone shows the angle."""
    counted = [motion.log for motion in motions if motion.passes is not None]
    if not counted:
        return None
    if decay is not None and decay.sensor == "encoder":
        return Prior("zero", 0.0, "rad", decay.rest_deviation, f"free decay '{decay.log}'")
    # even over the pitch
    deviation = float(counted[0].calibration.need("encoder").pitch / np.sqrt(12))
    return Prior("zero", 0.0, "rad", deviation, "counter set to 0 at rest")


def speed_priors(motions: Sequence[DiscMotion]) -> tuple[Prior, ...]:
    """Speed of the drives over the nominal one, of each log that does not record it."""
    priors = []
    for number, motion in enumerate(motions):
        done = motion.log.experiment
        if not nominal_drives(motion.log):
            continue
        sds = [sd / abs(speed) for sd, speed in zip(done.drive_speed_uncertainty, done.drive_speed, strict=False)]
        source = f"nominal speed of '{motion.log.name}'" + ("" if sds else ", uncertainty unknown")
        priors.append(Prior(speed_name(number), 1.0, "1", max(sds, default=0.0), source, bool(sds)))
    return tuple(priors)


def _stated(log: RigLog, entry: str) -> StatedQuantity:
    """A constant as a log states it; a normal force that is not stated as its load cell shows it."""
    cell = entry.replace("N", "load")
    if getattr(log.rig, entry) is None and log.has(cell):
        return StatedQuantity(float(np.nanmean(log.column(cell))), RIG_UNITS[entry])
    return log.rig.quantity(entry)


def weighed(motions: Sequence[DiscMotion]) -> bool:
    """Whether load cells show the normal forces in all logs."""
    return all(motion.loads is not None for motion in motions)


def by_cells(prior: Prior, motions: Sequence[DiscMotion], contacts: Sequence[str]) -> Prior:
    """A normal force as its load cell shows it, on average over the logs; what a cell does not show stays."""
    disc = {"N": contacts[0], "N0": "disc0", "N1": "disc1"}.get(prior.name)
    if disc is None or not weighed(motions):
        return prior
    rows = [m.loads[m.log.contacts.index(disc)] for m in motions if m.loads is not None and disc in m.log.contacts]
    force = float(np.mean(np.concatenate(rows)))
    cells = [getattr(motion.log.calibration, f"load{disc[-1]}") for motion in motions if disc in motion.log.contacts]
    deviation = None if cells[0] is None else cells[0].gain_deviation
    source = "load cell" + (", uncertainty unknown" if deviation is None else "")
    return Prior(prior.name, force, "N", (deviation or 0.0) * force, source, deviation is not None)


def gain_prior(motions: Sequence[DiscMotion], sensors: SensorFit) -> tuple[Prior, ...]:
    """The laser's gain over the stated one, where no encoder shows it."""
    calibrations = [m.log.calibration.need("laser") for m in motions if angle_sensor(m.log) == "laser"]
    if sensors.lines or not calibrations:
        return ()
    deviation = calibrations[0].gain_deviation  # the logs of a pool share it
    source = "calibration of the laser" + (", uncertainty unknown" if deviation is None else "")
    return (Prior("laser", 1.0, "1", deviation or 0.0, source, deviation is not None),)


def stated_readings(logs: Sequence[RigLog]) -> tuple[ConstantReading, ...]:
    """k and c as stated, where a free decay gives k/J and c/J: with these, two more readings of J."""
    stated = [(name, getattr(logs[0].rig, name)) for name in ("k", "c")]
    return tuple(
        ConstantReading(name, {"J": 1, f"{name}/J": 1}, quantity.value, quantity.standard_uncertainty / quantity.value)
        for name, quantity in stated
        if quantity is not None and quantity.value > 0 and quantity.standard_uncertainty
    )
