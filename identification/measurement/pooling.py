"""Several logs of one rig made ready for one fit: constants, motions on a common scale, slip segments.

One drive speed leaves mu_k and p nearly collinear; logs at three speeds pooled separate them. Pooling is the default
path.
"""

from collections.abc import Callable, Container, Sequence
from itertools import combinations
from typing import TypeVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import one_blas_thread
from identification.inference.problem import Prior
from identification.measurement.disc_motion import (
    angle_sensor,
    by_encoder,
    disc_motion,
    fuse,
    nominal_drives,
    with_temperature,
    zeroed,
)
from identification.measurement.free_decay import FreeDecay, fit_free_decay
from identification.measurement.laser_walk import with_walk
from identification.measurement.motion import LINE_ERROR, SMOOTHING, DiscMotion, SensorFit
from identification.measurement.pooled import Pool, RigValues, rig_of
from identification.measurement.seen_beam import beam_words, seen_beam, with_beam
from identification.measurement.sensor_checks import check_stick_speed, drive_warnings
from identification.measurement.slip_segments import THRESHOLD, SlipSegment, slip_segments
from identification.measurement.stated import (
    by_cells,
    gain_prior,
    speed_priors,
    stated_priors,
    stated_readings,
    zero_prior,
)
from rig_io.logs.arrangement import Arrangement
from rig_io.logs.log import RIG_UNITS, RigLog

SAME_SPEED = 0.05  # relative difference of drive speeds
SPEEDS_OF_CREEP = 3  # that tell 1 % of creep from a law; two do not
SAME_RATE = 1e-3  # relative difference of the sample intervals of logs that are pooled

Part = TypeVar("Part")
Made = TypeVar("Made")


@one_blas_thread()
def pool(
    logs: Sequence[RigLog],
    *,
    free_decay: FreeDecay | None = None,
    threshold: float = THRESHOLD,
    allow_no_stick: bool = False,
) -> Pool:
    """Make logs ready for one fit.

    logs: stick-slip logs of one rig, with one driving disc or two; a free-decay log among them serves as ``free_decay``
    if that is not given. threshold: m/s, slip speed below which data are left out. allow_no_stick: see `slip_segments`.

    Raises:
        StickslipError: no logs, logs of different rigs, contacts or arrangements, constants missing, or a log that
            `disc_motion`, `fuse` or `slip_segments` refuses.
    """
    if threshold <= 0:
        raise StickslipError(
            f"The threshold of slip speed is {threshold:g} m/s; it must be positive (usual: {THRESHOLD})."
        )
    sliding, decays = by_kind(logs, "A friction fit needs one, better three.")
    _check_no_copies(sliding)
    contacts, arrangement = _contacts(sliding)
    materials = _materials(sliding, contacts)
    if free_decay is None and decays:
        free_decay = fit_free_decay(decays[0])
    priors = stated_priors(sliding, contacts, free_decay)
    as_seen, raw, split, notes = motions_as_seen(logs, SMOOTHING * rig_of(priors).natural_period)
    if free_decay is not None and as_seen is not logs:
        free_decay = next((free_decay.again(log) for log in as_seen if log.name == free_decay.log), free_decay)
        priors = stated_priors(sliding, contacts, free_decay)
    values = rig_of(priors)
    period = values.natural_period
    if free_decay is not None:
        # what the sensor shows at rest is its zero: left in, it would pass to the friction coefficients as k*rest/(R N)
        raw = at_rest(raw, free_decay)
    fused, sensors = fuse(raw, SMOOTHING * period)
    fused, temperature = with_temperature(with_walk(fused, values.r, values.R, period))

    def with_segments(motion: DiscMotion) -> tuple[DiscMotion, list[SlipSegment]]:
        check_stick_speed(motion, values.r, values.R, SMOOTHING * period)
        return motion, slip_segments(motion, period, threshold=threshold, allow_no_stick=allow_no_stick)

    usable, empty = _usable([(motion.log.name, motion) for motion in fused], with_segments, split)
    motions = tuple(motion for motion, _ in usable)
    priors = (*priors, *speed_priors(motions), *gain_prior(motions, sensors))
    zero = zero_prior(raw, free_decay)
    priors = tuple(by_cells(prior, motions, contacts) for prior in priors)
    warnings = [f"Log '{log.name}': {warning}" for log in (*sliding, *decays) for warning in log.warnings]
    warnings += [warning for motion in motions for warning in (*motion.warnings, *drive_warnings(motion))]
    segments = tuple(segment for _, segments in usable for segment in segments)
    said = (*notes, *warnings, *empty, *sensors.warnings, *pool_warnings(sliding, sensors, priors, free_decay))
    said += (*zero_unseen(motions, segments, values, free_decay), *creep_unseen(motions))
    readings = stated_readings(sliding) if free_decay is not None else ()
    of_logs: tuple[tuple[str, ...], tuple[str, ...], Arrangement] = (contacts, materials, arrangement)
    return Pool(motions, segments, sensors, priors, *of_logs, threshold, said, readings, zero, free_decay, temperature)


def by_kind(logs: Sequence[RigLog], advice: str) -> tuple[list[RigLog], list[RigLog]]:
    """Stick-slip logs and free decays of one rig. StickslipError: none of the first, which ``advice`` ends; different
    rigs."""
    decays = [log for log in logs if log.kind == "free-decay"]
    sliding = [log for log in logs if log.kind != "free-decay"]
    if not sliding:
        raise StickslipError(f"There is no stick-slip log among those given. {advice}")
    check_same_rig([*sliding, *decays])
    return sliding, decays


def motions_as_seen(
    logs: Sequence[RigLog], window: float, shortest: float = 0.0
) -> tuple[Sequence[RigLog], list[DiscMotion], frozenset[str], tuple[str, ...]]:
    """The logs with the laser's beam that the encoder shows, themselves where that is as described, and what
    `motions_in_pieces` makes of them. window: s, smoothing."""
    raw, split, notes = motions_in_pieces(logs, shortest)
    beams = seen_beam(raw, window)
    if not beams:
        return logs, raw, split, notes
    words = beam_words(raw[0].log.calibration.need("laser"), beams)
    logs = [with_beam(log, beams[0]) for log in logs]
    raw, split, notes = motions_in_pieces(logs, shortest)
    return logs, raw, split, (words, *notes)


def motions_in_pieces(
    logs: Sequence[RigLog], shortest: float = 0.0
) -> tuple[list[DiscMotion], frozenset[str], tuple[str, ...]]:
    """Motions of the pieces of all stick-slip logs, at one rate; names of the pieces of logs that have several; notes.

    shortest: s, a piece of several must last, or it is left out.

    Raises:
        StickslipError: a whole log that `disc_motion` refuses, or no piece is left; logs of different rates.
    """
    pieces = [log.pieces() for log in logs if log.kind != "free-decay"]
    split = frozenset(piece.name for group in pieces if len(group) > 1 for piece in group)

    def motion(piece: RigLog) -> DiscMotion:
        if piece.name in split and piece.duration < shortest:
            raise StickslipError(f"It lasts {piece.duration:.3g} s, and {shortest:.3g} s are needed.")
        return disc_motion(piece)

    raw, unfit = _usable([(piece.name, piece) for group in pieces for piece in group], motion, split)
    check_same_rate(raw)
    notes = [
        f"Log '{group[0].name}' is in {len(group)} pieces (gaps, a clock set back, lost edges); nothing is filtered or "
        "simulated across."
        for group in pieces
        if len(group) > 1
    ]
    return raw, split, (*notes, *unfit)


def _usable(
    candidates: Sequence[tuple[str, Part]], make: Callable[[Part], Made], split: Container[str]
) -> tuple[list[Made], tuple[str, ...]]:
    """Results of ``make`` for named candidates; a piece of a log in ``split`` that it refuses is left out, in words."""
    results, warnings, refused = [], [], None
    for name, candidate in candidates:
        try:
            results.append(make(candidate))
        except StickslipError as error:
            if name not in split:
                raise
            refused = error
            warnings.append(f"'{name}', one of several pieces, was left out. {error}")
    if refused is not None and not results:
        raise refused
    return results, tuple(warnings)


def check_contacts(logs: Sequence[RigLog]) -> None:
    """Refuse logs without a disc in contact."""
    for log in logs:
        if not log.contacts:
            raise StickslipError(
                f"Log '{log.name}' is of kind '{log.kind}', but has no disc in contact. Say which one touches, "
                '"contacts": ["disc0"], or call it a "free-decay".'
            )


def _contacts(logs: Sequence[RigLog]) -> tuple[tuple[str, ...], Arrangement]:
    """Discs of all logs, and the arrangement of those logs that have two."""
    check_contacts(logs)
    contacts = tuple(sorted({contact for log in logs for contact in log.contacts}))
    double = [log for log in logs if len(log.contacts) == 2]
    if len(contacts) > 1 and not double:
        raise StickslipError(
            f"The logs are of different discs ({', '.join(contacts)}), and none is of both. Fit each disc by itself."
        )
    for log in double[1:]:
        if log.experiment.arrangement != double[0].experiment.arrangement:
            raise StickslipError(
                f"Logs '{double[0].name}' and '{log.name}' are of different arrangements of the two discs, "
                f"'{double[0].experiment.arrangement}' and '{log.experiment.arrangement}'. Fit them apart."
            )
    return contacts, double[0].experiment.arrangement if double else "together"


def _materials(logs: Sequence[RigLog], contacts: Sequence[str]) -> tuple[str, ...]:
    """The friction pair of each disc; none if a log states none."""
    stated: dict[str, tuple[str, str]] = {}
    for log in logs:
        pairs = log.experiment.materials
        if pairs and len(pairs) != len(log.contacts):
            raise StickslipError(
                f"Log '{log.name}' states the materials {' and '.join(pairs)} for {' and '.join(log.contacts)}. Give "
                "one for each disc."
            )
        for contact, pair in zip(log.contacts, pairs or ("no materials",) * len(log.contacts), strict=True):
            first, before = stated.setdefault(contact, (log.name, pair))
            if before != pair:
                raise StickslipError(
                    f"Logs '{first}' ({before}) and '{log.name}' ({pair}) are of different materials on {contact}. Fit "
                    "each pair alone."
                )
    pairs = tuple(stated[contact][1] for contact in contacts)
    return () if "no materials" in pairs else pairs


def check_same_rig(logs: Sequence[RigLog]) -> None:
    first = logs[0]
    for log in logs[1:]:
        for name in RIG_UNITS:
            a, b = getattr(first.rig, name), getattr(log.rig, name)
            if a is not None and b is not None and not np.isclose(a.value, b.value, rtol=1e-9):
                raise StickslipError(
                    f"Logs '{first.name}' and '{log.name}' are of different rigs: {name} = {a.value:g} and "
                    f"{b.value:g} {a.unit}. Only logs of one rig can be pooled."
                )
        if log.calibration.laser != first.calibration.laser:
            raise StickslipError(
                f"Logs '{first.name}' and '{log.name}' state different calibrations of the laser. Fit them apart."
            )


def check_same_rate(motions: Sequence[DiscMotion]) -> None:
    first = motions[0]
    for motion in motions[1:]:
        if abs(motion.step / first.step - 1) > SAME_RATE:
            raise StickslipError(
                f"Logs '{first.log.name}' and '{motion.log.name}' are sampled every {first.step:g} s and "
                f"{motion.step:g} s. Resample them at one rate, or fit them apart."
            )


def _check_no_copies(logs: Sequence[RigLog]) -> None:
    """A log that counts twice would make the standard deviations too small."""
    for first, second in combinations(logs, 2):
        same = first.columns.keys() == second.columns.keys() and len(first.time) == len(second.time)
        if same and all(np.array_equal(first.columns[name], second.columns[name]) for name in first.columns):
            raise StickslipError(f"Logs '{first.name}' and '{second.name}' hold the same data. Give each log once.")


def at_rest(motions: Sequence[DiscMotion], decay: FreeDecay) -> list[DiscMotion]:
    """The motions with the zero of the sensor that showed a free decay put where it came to rest."""
    return [zeroed(m, decay.rest) if angle_sensor(m.log) == decay.sensor else m for m in motions]


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


def creep_unseen(motions: Sequence[DiscMotion]) -> tuple[str, ...]:
    """Warnings where a belt may creep, nobody says how much, and too few drive speeds tell it from friction."""
    encoders = [getattr(m.log.calibration, f"drive{contact[-1]}") for m in motions for contact in m.log.contacts]
    if not any(encoder and encoder.may_creep and encoder.creep_deviation is None for encoder in encoders):
        return ()
    speeds = np.sort([abs(float(np.mean(drive))) for motion in motions for drive in motion.drives])
    if 1 + np.count_nonzero(np.diff(speeds) > SAME_SPEED * speeds[1:]) >= SPEEDS_OF_CREEP:
        return ()
    return (
        "The encoder of the drive sits before a belt, and nobody says how much that creeps: logs at fewer than "
        f"{SPEEDS_OF_CREEP} drive speeds do not tell creep from friction, and no interval holds it. Add logs at other "
        "drive speeds, or describe it: --set 'belt=0.5 ± 0.2 %', or belt=gear.",
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
    warm = [log.name for log in logs if log.has("temperature")]
    if warm and len(warm) < len(logs):
        warnings.append(
            f"The temperature is recorded in {' and '.join(warm)} alone: what it does to friction was not sought. "
            "Record it in all logs."
        )
    elif warm and any(len(log.contacts) > 1 for log in logs):
        warnings.append("What the temperature does to friction is followed with one disc alone.")
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
