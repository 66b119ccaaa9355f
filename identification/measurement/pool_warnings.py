"""What is said of logs that are pooled."""

from collections.abc import Sequence

from identification.inference.problem import Prior
from identification.measurement.disc_motion import angle_sensor, by_encoder, nominal_drives
from identification.measurement.free_decay import FreeDecay
from identification.measurement.motion import LINE_ERROR, DiscMotion, SensorFit
from identification.measurement.pooled import RigValues
from identification.measurement.slip_segments import SlipSegment
from rig_io.logs.log import RigLog

REST_SUSPECT = 1e-3  # rad at rest, beyond which the zero of the angle sensor is worth a word


def zero_unseen(
    motions: Sequence[DiscMotion], segments: Sequence[SlipSegment], rig: RigValues, free_decay: FreeDecay | None
) -> tuple[str, ...]:
    """Warnings where one disc always slips one way and nothing shows the zero of the angle."""
    one_way = len({segment.sign for segment in segments}) == 1 and len(rig.forces) == 1
    if free_decay is not None or not one_way or any(motion.passes is not None for motion in motions):
        return ()
    return (
        "No free decay shows the zero of the angle, and all drives turn one way: a zero that is off by 1 mrad moves "
        f"every friction coefficient by {1e-3 * rig.spring:.2g}, which no interval holds. Add one log with the drive "
        "reversed, or a free decay.",
    )


def pool_warnings(
    logs: Sequence[RigLog], sensors: SensorFit, priors: Sequence[Prior], free_decay: FreeDecay | None
) -> tuple[str, ...]:
    warnings = []
    unknown = [prior.name for prior in priors if not prior.stated]
    if unknown:
        warnings.append(
            f"How well {', '.join(unknown)} {'is' if len(unknown) == 1 else 'are'} known is not stated: intervals are "
            f"at least as wide as shown. State it: --uncertainty {unknown[0]}=0.5%, or in datapackage.json."
        )
    by_laser = [log for log in logs if angle_sensor(log) == "laser"]
    if sensors.lines == 0 and any(log.calibration.need("laser").gain_deviation is None for log in by_laser):
        warnings.append(
            "The laser's gain was taken as stated (no encoder in the logs, or too few of its lines passed): an error "
            "of it passes to the friction coefficients one to one and is not in their standard deviations."
        )
    if any(by_encoder(log) for log in logs):
        zero = (
            "its zero is that of the free decay"
            if free_decay is not None and free_decay.sensor == "encoder"
            else "its zero is known within half a pitch, for a counter set to 0 at rest (a free decay would show it)"
        )
        warnings.append(
            f"Nothing but the encoder shows the angle: {zero}, its lines are taken to be misplaced by up to "
            f"{LINE_ERROR:.0%} of the pitch, and micro-slip in stick cannot be seen. A laser beside it would tell more."
        )
    cells = [log.name for log in logs if any(log.has(f"load{contact[-1]}") for contact in log.contacts)]
    if cells and not all(prior.source.startswith("load cell") for prior in priors if prior.name in ("N", "N0", "N1")):
        warnings.append(
            f"The load cell is not in all logs, or not on each disc in contact (it is in {' and '.join(cells)}): the "
            "normal force was taken as stated, and constant."
        )
    elif cells and any(len(log.contacts) > 1 for log in logs):
        warnings.append(
            "Of two discs the mean of each load cell was taken as its normal force: how it changes is followed with "
            "one disc alone."
        )
    nominal = [log.name for log in logs if nominal_drives(log)]
    if nominal:
        warnings.append(
            f"How the drives turned is not recorded in {' and '.join(nominal)}: the nominal speeds were taken. Their "
            "uncertainty is added, their unevenness is told by the slips alone, and micro-slip in stick cannot be "
            "seen. An encoder on each drive would tell more."
        )
    if len(logs) == 1 and len(logs[0].contacts) == 1:
        warnings.append("One drive speed leaves mu_k and p nearly collinear: pool logs at three speeds or more.")
    elif len(logs) == 1:
        warnings.append(
            "One pair of drive speeds hardly tells the laws of two discs apart: pool logs at three pairs or more, now "
            "one disc and now the other the faster, or add logs of one disc alone."
        )
    if free_decay is not None:
        warnings += free_decay.warnings
        if abs(free_decay.rest) > REST_SUSPECT:
            warnings.append(
                f"In the free decay the disc comes to rest at {free_decay.rest:.2g} rad: the sensor's zero is off. All "
                "angles were shifted by it."
            )
        k, J = logs[0].rig.k, logs[0].rig.J
        # where both are known to something, they are adjusted to the decay with the fit
        if k is not None and J is not None and not (k.standard_uncertainty and J.standard_uncertainty):
            stated = k.value / J.value
            if abs(free_decay.stiffness_ratio / stated - 1) > 0.02:
                warnings.append(
                    f"The free decay gives k/J = {free_decay.stiffness_ratio:.5g} 1/s^2, the log's constants "
                    f"{stated:.5g}; the free decay was used, with the stated J."
                )
    return tuple(warnings)
