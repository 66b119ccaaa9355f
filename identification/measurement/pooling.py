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
from identification.measurement.disc_motion import angle_sensor, disc_motion, fuse, zeroed
from identification.measurement.free_decay import FreeDecay, fit_free_decay
from identification.measurement.laser_walk import with_walk
from identification.measurement.motion import SMOOTHING, DiscMotion
from identification.measurement.pool_warnings import pool_warnings, zero_unseen
from identification.measurement.pooled import Pool, rig_values
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
    decays = [log for log in logs if log.kind == "free-decay"]
    sliding = [log for log in logs if log.kind != "free-decay"]
    if not sliding:
        raise StickslipError("There is no stick-slip log among those given. A friction fit needs one, better three.")
    check_same_rig([*sliding, *decays])
    _check_no_copies(sliding)
    contacts, arrangement = _contacts(sliding)
    materials = _materials(sliding, contacts)
    if free_decay is None and decays:
        free_decay = fit_free_decay(decays[0])
    priors = stated_priors(sliding, contacts, free_decay)
    values = rig_values({prior.name: prior.value for prior in priors})
    period = float(2 * np.pi * np.sqrt(values.J / values.k))
    raw, split, unfit = motions_in_pieces(sliding)
    if free_decay is not None:
        # what the sensor shows at rest is its zero: left in, it would pass to the friction coefficients as k*rest/(R N)
        raw = at_rest(raw, free_decay)
    fused, sensors = fuse(raw, SMOOTHING * period)
    fused = with_walk(fused, values.r, values.R, period)

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
    said = (*warnings, *unfit, *empty, *sensors.warnings, *pool_warnings(sliding, sensors, priors, free_decay))
    said += zero_unseen(motions, segments, values, free_decay)
    readings = stated_readings(sliding) if free_decay is not None else ()
    of_logs: tuple[tuple[str, ...], tuple[str, ...], Arrangement] = (contacts, materials, arrangement)
    return Pool(motions, segments, sensors, priors, *of_logs, threshold, said, readings, zero, free_decay)


def motions_in_pieces(
    logs: Sequence[RigLog], shortest: float = 0.0
) -> tuple[list[DiscMotion], frozenset[str], tuple[str, ...]]:
    """Motions of the pieces of all logs, at one rate; names of the pieces of logs that have several; what to say.

    shortest: s, a piece of several must last, or it is left out.

    Raises:
        StickslipError: a whole log that `disc_motion` refuses, or no piece is left; logs of different rates.
    """
    pieces = [log.pieces() for log in logs]
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
