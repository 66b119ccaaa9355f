"""Several logs of one rig made ready for one fit: constants, motions on a common scale, slip segments.

One drive speed leaves mu_k and p nearly collinear; logs at three speeds pooled separate them. Pooling is the default
path.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TypeVar

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.base.threads import one_blas_thread
from identification.inference.adjustment import Reading
from identification.inference.problem import Prior
from identification.measurement.disc_motion import (
    angle_sensor,
    by_encoder,
    corrected,
    disc_motion,
    fuse,
    nominal_drives,
    zeroed,
)
from identification.measurement.free_decay import FreeDecay, fit_free_decay
from identification.measurement.motion import LINE_ERROR, SMOOTHING, DiscMotion, SensorFit
from identification.measurement.sensor_checks import check_stick_speed, drive_warnings
from identification.measurement.slip_segments import THRESHOLD, SlipSegment, long_enough, slip_segments
from rig_io.logs.arrangement import Arrangement
from rig_io.logs.log import RIG_UNITS, Quantity, RigLog

SAME_RATE = 1e-3  # relative difference of the sample intervals of logs that are pooled
_ASSUMED: dict[Arrangement, str] = {
    "together": "both discs touch at every angle",
    "sequential": "one disc touches at a time: disc 0 below the angle theta_s, disc 1 from there on",
    "overlapping": "disc 0 touches up to the angle alpha, disc 1 from -alpha on",
}
LASER = frozenset({"gain", "laser", "delay"})
SENSED = LASER | {"zero", "lines"}  # what moves the angle
SPEED = "w_"  # before the number of a log: speed of its drives over the nominal one
DRAWS = 24
REST_SUSPECT = 1e-3  # rad at rest, beyond which the zero of the angle sensor is worth a word

Part = TypeVar("Part")
Made = TypeVar("Made")


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


@dataclass(frozen=True, eq=False)
class Pool(Shown):
    """Logs ready for a fit. contacts: names of the driving discs in any of the logs, each with its material in
    ``materials`` (if stated); arrangement: of logs with two discs; segments of all logs, in order of motions and
    time; readings: what else is known of the constants in ``priors``; zero: what is known of that of an
    encoder, where nothing else shows the angle."""

    motions: tuple[DiscMotion, ...]
    segments: tuple[SlipSegment, ...]
    sensors: SensorFit
    priors: tuple[Prior, ...]
    contacts: tuple[str, ...]
    materials: tuple[str, ...]
    arrangement: Arrangement
    threshold: float
    warnings: tuple[str, ...]
    readings: tuple[Reading, ...] = ()
    zero: Prior | None = None

    @property
    def values(self) -> RigValues:
        """Constants at their stated values."""
        return rig_values({prior.name: prior.value for prior in self.priors})

    @property
    def assumed(self) -> tuple[str, ...]:
        """How two discs touch, in words; nothing of one."""
        return () if len(self.contacts) == 1 else (_ASSUMED[self.arrangement], "each disc has a law of its own")

    @property
    def natural_period(self) -> float:
        """2 pi sqrt(J/k), s."""
        values = self.values
        return float(2 * np.pi * np.sqrt(values.J / values.k))

    def with_constants(self, values: Mapping[str, float]) -> Pool:
        """The same logs of a rig with other constants, by name; those that are not named stay."""
        return replace(self, priors=tuple(replace(one, value=values.get(one.name, one.value)) for one in self.priors))

    def moved(self, moved: Mapping[str, float], window: float) -> tuple[list[SlipSegment], list[int], RigValues]:
        """Segments that hold ``window`` s, the number of the log of each, and the rig, where what is taken as given is
        moved: constants by a share of themselves, the laser by "gain" (relative) and "delay" (s), the zero of an
        encoder by "zero" (rad), its lines as draw number "lines" has them."""
        known = {prior.name: prior.value * (1 + moved.get(prior.name, 0.0)) for prior in self.priors}
        segments = self.segments
        if "R" in moved and self.laser_alone:
            # a laser alone measures R sin(angle)
            moved = {**moved, "gain": (1 + moved.get("gain", 0.0)) / (1 + moved["R"]) - 1}
        if any(name in SENSED or name.startswith(SPEED) for name in moved):
            segments = self.with_sensors(moved)
        kept = long_enough(segments, window)
        return kept, [self.log_number(segment) for segment in kept], rig_values(known)

    def with_sensors(self, moved: Mapping[str, float]) -> tuple[SlipSegment, ...]:
        """The same segments with the angle moved, see `moved`."""
        motions = {id(motion): self._sensed(place, motion, moved) for place, motion in enumerate(self.motions)}
        return tuple(replace(segment, motion=motions[id(segment.motion)]) for segment in self.segments)

    def _sensed(self, place: int, motion: DiscMotion, moved: Mapping[str, float]) -> DiscMotion:
        if not LASER.isdisjoint(moved):
            gain = (1 + moved.get("gain", 0.0)) * (1 + moved.get("laser", 0.0)) - 1
            motion = corrected(motion, gain, moved.get("delay", 0.0))
        if speed_name(place) in moved:
            motion = replace(motion, drives=motion.drives * (1 + moved[speed_name(place)]))
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
    def seen_well(self) -> bool:
        """Whether residuals can tell disturbances of friction from what sensors leave open: from misplaced lines of an
        encoder that alone shows the angle, and from drives whose unevenness is not recorded."""
        return not any(motion.passes is not None or nominal_drives(motion.log) for motion in self.motions)

    @property
    def drawn(self) -> int:
        """How many draws of the misplacement of an encoder's lines stand for it; 0 where it does not show the angle."""
        return DRAWS if any(motion.passes is not None for motion in self.motions) else 0

    def log_number(self, segment: SlipSegment) -> int:
        """Place of the segment's log among ``motions``, whose sensors may have been moved."""
        return next(i for i, motion in enumerate(self.motions) if motion.log is segment.motion.log)


def speed_name(place: int) -> str:
    """Of the speed of the drives over the nominal one in a log, by its place."""
    return f"{SPEED}{place + 1}"


def rig_values(known: dict[str, float]) -> RigValues:
    """Constants from priors: k and c as they are, or from k/J and c/J of a free decay and J; N, or N0 and N1."""
    J = known["J"]
    k = known["k"] if "k" in known else J * known["k/J"]
    c = known["c"] if "c" in known else J * known["c/J"]
    forces = tuple(known[name] for name in ("N", "N0", "N1") if name in known)
    return RigValues(J, k, c, known["R"], known["r"], forces)


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
    priors = _priors(sliding, contacts, free_decay)
    values = rig_values({prior.name: prior.value for prior in priors})
    period = float(2 * np.pi * np.sqrt(values.J / values.k))
    raw, split, unfit = motions_in_pieces(sliding)
    if free_decay is not None:
        # what the sensor shows at rest is its zero: left in, it would pass to the friction coefficients as k*rest/(R N)
        raw = at_rest(raw, free_decay)
    fused, sensors = fuse(raw, SMOOTHING * period)

    def with_segments(motion: DiscMotion) -> tuple[DiscMotion, list[SlipSegment]]:
        check_stick_speed(motion, values.r, values.R, SMOOTHING * period)
        return motion, slip_segments(motion, period, threshold=threshold, allow_no_stick=allow_no_stick)

    found, empty = _usable([(motion.log.name, motion) for motion in fused], with_segments, split)
    motions = tuple(motion for motion, _ in found)
    priors = (*priors, *_nominal_speeds(motions), *_laser_gain(motions, sensors))
    zero = _zero(raw, free_decay)
    priors = tuple(_by_cells(prior, motions, contacts) for prior in priors)
    warnings = [f"Log '{log.name}': {warning}" for log in (*sliding, *decays) for warning in log.warnings]
    warnings += [warning for motion in motions for warning in (*motion.warnings, *drive_warnings(motion))]
    return Pool(
        motions,
        tuple(segment for _, segments in found for segment in segments),
        sensors,
        priors,
        contacts,
        materials,
        arrangement,
        threshold,
        (
            *warnings,
            *unfit,
            *empty,
            *sensors.warnings,
            *_warnings(sliding, sensors, priors, free_decay),
            *_zero_unseen(motions, [s for _, segments in found for s in segments], values, free_decay),
        ),
        _readings(sliding) if free_decay is not None else (),
        zero,
    )


def motions_in_pieces(
    logs: Sequence[RigLog], shortest: float = 0.0
) -> tuple[list[DiscMotion], frozenset[str], tuple[str, ...]]:
    """Motions of the pieces of all logs, at one rate; names of the pieces of logs that have several; what to say.

    shortest: s, a piece of several must last, or it is left out.

    Raises:
        StickslipError: a whole log that `disc_motion` refuses, or no piece is left; logs of different rates.
    """
    pieces = [log.pieces() for log in logs]
    split = frozenset(piece.name for parts in pieces if len(parts) > 1 for piece in parts)

    def motion(piece: RigLog) -> DiscMotion:
        if piece.name in split and piece.duration < shortest:
            raise StickslipError(f"It lasts {piece.duration:.3g} s, and {shortest:.3g} s are needed.")
        return disc_motion(piece)

    raw, unfit = _usable([(piece.name, piece) for parts in pieces for piece in parts], motion, split)
    check_same_rate(raw)
    said = [
        f"Log '{parts[0].name}' is in {len(parts)} pieces (gaps, a clock set back, lost edges); nothing is filtered or "
        "simulated across."
        for parts in pieces
        if len(parts) > 1
    ]
    return raw, split, (*said, *unfit)


def _usable(
    parts: Sequence[tuple[str, Part]], make: Callable[[Part], Made], split: Container[str]
) -> tuple[list[Made], tuple[str, ...]]:
    """What ``make`` gives for each named part; of a log that is ``split`` a part that it refuses is left out, in words.

    Raises:
        StickslipError: a whole log is refused, or no part is left.
    """
    made, warnings, refused = [], [], None
    for name, part in parts:
        try:
            made.append(make(part))
        except StickslipError as error:
            if name not in split:
                raise
            refused = error
            warnings.append(f"'{name}', one of several pieces, was left out. {error}")
    if refused is not None and not made:
        raise refused
    return made, tuple(warnings)


def _contacts(logs: Sequence[RigLog]) -> tuple[tuple[str, ...], Arrangement]:
    """Discs of all logs, and the arrangement of those logs that have two."""
    for log in logs:
        if not log.contacts:
            raise StickslipError(
                f"Log '{log.name}' is of kind '{log.kind}', but has no disc in contact. Say which one touches, "
                '"contacts": ["disc0"], or call it a "free-decay".'
            )
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
    found: dict[str, tuple[str, str]] = {}
    for log in logs:
        pairs = log.experiment.materials
        if pairs and len(pairs) != len(log.contacts):
            raise StickslipError(
                f"Log '{log.name}' states the materials {' and '.join(pairs)} for {' and '.join(log.contacts)}. Give "
                "one for each disc."
            )
        for contact, pair in zip(log.contacts, pairs or ("no materials",) * len(log.contacts), strict=True):
            first, known = found.setdefault(contact, (log.name, pair))
            if known != pair:
                raise StickslipError(
                    f"Logs '{first}' ({known}) and '{log.name}' ({pair}) are of different materials on {contact}. Fit "
                    "each pair alone."
                )
    pairs = tuple(found[contact][1] for contact in contacts)
    return () if "no materials" in pairs else pairs


def check_same_rig(logs: Sequence[RigLog]) -> None:
    first = logs[0]
    for log in logs[1:]:
        for name in RIG_UNITS:
            here, there = getattr(first.rig, name), getattr(log.rig, name)
            if here is not None and there is not None and not np.isclose(here.value, there.value, rtol=1e-9):
                raise StickslipError(
                    f"Logs '{first.name}' and '{log.name}' are of different rigs: {name} = {here.value:g} and "
                    f"{there.value:g} {here.unit}. Only logs of one rig can be pooled."
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
    for one, other in combinations(logs, 2):
        same = one.columns.keys() == other.columns.keys() and len(one.time) == len(other.time)
        if same and all(np.array_equal(one.columns[name], other.columns[name]) for name in one.columns):
            raise StickslipError(f"Logs '{one.name}' and '{other.name}' hold the same data. Give each log once.")


def _priors(logs: Sequence[RigLog], contacts: Sequence[str], free_decay: FreeDecay | None) -> tuple[Prior, ...]:
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
            Prior(name, value, unit, known or 0.0, source[name], known is not None)
            for name, value, unit, known in (
                ("k/J", free_decay.stiffness_ratio, "1/s^2", free_decay.stiffness_ratio_deviation),
                ("c/J", free_decay.damping_ratio, "1/s", free_decay.damping_ratio_deviation),
            )
        ]
    elif log.rig.k is None or log.rig.c is None:
        missing = " and ".join(name for name in ("k", "c") if getattr(log.rig, name) is None)
        raise StickslipError(
            f"Log '{log.name}' does not state {missing}, and there is no free decay among the logs. Record one (the "
            'disc let go with no driving disc in contact, "kind": "free-decay"), from which k/J and c/J follow, or '
            f'state {missing} under "rig" in datapackage.json.'
        )
    stated = []
    for name, entry in names.items():
        quantity = _stated(log, entry)
        if not quantity.value > 0:
            raise StickslipError(
                f"The rig constant {entry} is {quantity.value:g} {quantity.unit}; a fit needs it positive. Mend it in "
                "datapackage.json."
            )
        known = quantity.standard_uncertainty
        source = "log" if known is not None else "log, uncertainty unknown"
        stated.append(Prior(name, quantity.value, quantity.unit, known or 0.0, source, known is not None))
    return (*stated, *ratios)


def at_rest(motions: Sequence[DiscMotion], decay: FreeDecay) -> list[DiscMotion]:
    """The motions with the zero of the sensor that showed a free decay put where it came to rest."""
    return [zeroed(m, decay.rest) if angle_sensor(m.log) == decay.sensor else m for m in motions]


def _zero(motions: Sequence[DiscMotion], decay: FreeDecay | None) -> Prior | None:
    """What is known of the zero of an encoder that alone shows the angle."""
    counted = [motion.log for motion in motions if motion.passes is not None]
    if not counted:
        return None
    if decay is not None and decay.sensor == "encoder":
        return Prior("zero", 0.0, "rad", decay.rest_deviation, f"free decay '{decay.log}'")
    # even over the pitch
    deviation = float(counted[0].calibration.need("encoder").pitch / np.sqrt(12))
    return Prior("zero", 0.0, "rad", deviation, "counter set to 0 at rest")


def _nominal_speeds(motions: Sequence[DiscMotion]) -> tuple[Prior, ...]:
    """Speed of the drives over the nominal one, of each log that does not record it."""
    found = []
    for place, motion in enumerate(motions):
        done = motion.log.experiment
        if not nominal_drives(motion.log):
            continue
        known = [sd / abs(speed) for sd, speed in zip(done.drive_speed_uncertainty, done.drive_speed, strict=False)]
        source = f"nominal speed of '{motion.log.name}'" + ("" if known else ", uncertainty unknown")
        found.append(Prior(speed_name(place), 1.0, "1", max(known, default=0.0), source, bool(known)))
    return tuple(found)


def _stated(log: RigLog, entry: str) -> Quantity:
    """A constant as a log states it; a normal force that is not stated as its load cell shows it."""
    cell = entry.replace("N", "load")
    if getattr(log.rig, entry) is None and log.has(cell):
        return Quantity(float(np.nanmean(log.column(cell))), RIG_UNITS[entry])
    return log.rig.quantity(entry)


def weighed(motions: Sequence[DiscMotion]) -> bool:
    """Whether load cells show the normal forces in all logs."""
    return all(motion.loads is not None for motion in motions)


def _by_cells(prior: Prior, motions: Sequence[DiscMotion], contacts: Sequence[str]) -> Prior:
    """A normal force as its load cell shows it, on average over the logs; what a cell does not show stays."""
    disc = {"N": contacts[0], "N0": "disc0", "N1": "disc1"}.get(prior.name)
    if disc is None or not weighed(motions):
        return prior
    rows = [m.loads[m.log.contacts.index(disc)] for m in motions if m.loads is not None and disc in m.log.contacts]
    force = float(np.mean(np.concatenate(rows)))
    cells = [getattr(motion.log.calibration, f"load{disc[-1]}") for motion in motions if disc in motion.log.contacts]
    known = None if cells[0] is None else cells[0].gain_deviation
    source = "load cell" + (", uncertainty unknown" if known is None else "")
    return Prior(prior.name, force, "N", (known or 0.0) * force, source, known is not None)


def _laser_gain(motions: Sequence[DiscMotion], sensors: SensorFit) -> tuple[Prior, ...]:
    """The laser's gain over the stated one, where no encoder shows it."""
    calibrations = [m.log.calibration.need("laser") for m in motions if angle_sensor(m.log) == "laser"]
    if sensors.lines or not calibrations:
        return ()
    known = calibrations[0].gain_deviation  # the logs of a pool share it
    source = "calibration of the laser" + (", uncertainty unknown" if known is None else "")
    return (Prior("laser", 1.0, "1", known or 0.0, source, known is not None),)


def _readings(logs: Sequence[RigLog]) -> tuple[Reading, ...]:
    """k and c as stated, where a free decay gives k/J and c/J: with these, two more readings of J."""
    stated = [(name, getattr(logs[0].rig, name)) for name in ("k", "c")]
    return tuple(
        Reading(name, {"J": 1, f"{name}/J": 1}, one.value, one.standard_uncertainty / one.value)
        for name, one in stated
        if one is not None and one.value > 0 and one.standard_uncertainty
    )


def _zero_unseen(
    motions: Sequence[DiscMotion], segments: Sequence[SlipSegment], rig: RigValues, free_decay: FreeDecay | None
) -> tuple[str, ...]:
    """What to say where one disc always slips one way and nothing shows the zero of the angle."""
    one_way = len({segment.sign for segment in segments}) == 1 and len(rig.forces) == 1
    if free_decay is not None or not one_way or any(motion.passes is not None for motion in motions):
        return ()
    return (
        "No free decay shows the zero of the angle, and all drives turn one way: a zero that is off by 1 mrad moves "
        f"every friction coefficient by {1e-3 * rig.spring:.2g}, which no interval holds. Add one log with the drive "
        "reversed, or a free decay.",
    )


def _warnings(
    logs: Sequence[RigLog], sensors: SensorFit, priors: Sequence[Prior], free_decay: FreeDecay | None
) -> tuple[str, ...]:
    found = []
    unknown = [prior.name for prior in priors if not prior.stated]
    if unknown:
        found.append(
            f"How well {', '.join(unknown)} {'is' if len(unknown) == 1 else 'are'} known is not stated: intervals are "
            f"at least as wide as shown. State it: --uncertainty {unknown[0]}=0.5%, or in datapackage.json."
        )
    by_laser = [log for log in logs if log.has("laser") and not log.has("angle")]
    if sensors.lines == 0 and any(log.calibration.need("laser").gain_deviation is None for log in by_laser):
        found.append(
            "The laser's gain was taken as stated (no encoder in the logs, or too few of its lines passed): an error "
            "of it passes to the friction coefficients one to one and is not in their standard deviations."
        )
    if any(by_encoder(log) for log in logs):
        zero = (
            "its zero is that of the free decay"
            if free_decay is not None and free_decay.sensor == "encoder"
            else "its zero is known within half a pitch, for a counter set to 0 at rest (a free decay would show it)"
        )
        found.append(
            f"Nothing but the encoder shows the angle: {zero}, its lines are taken to be misplaced by up to "
            f"{LINE_ERROR:.0%} of the pitch, micro-slip in stick cannot be seen, and disturbances are not sought, only "
            "estimated where they are named. A laser beside it would tell more."
        )
    cells = [log.name for log in logs if any(log.has(f"load{contact[-1]}") for contact in log.contacts)]
    if cells and not all(prior.source.startswith("load cell") for prior in priors if prior.name in ("N", "N0", "N1")):
        found.append(
            f"The load cell is not in all logs, or not on each disc in contact (it is in {' and '.join(cells)}): the "
            "normal force was taken as stated, and constant."
        )
    elif cells and any(len(log.contacts) > 1 for log in logs):
        found.append(
            "Of two discs the mean of each load cell was taken as its normal force: how it changes is followed with "
            "one disc alone."
        )
    nominal = [log.name for log in logs if nominal_drives(log)]
    if nominal:
        found.append(
            f"How the drives turned is not recorded in {' and '.join(nominal)}: the nominal speeds were taken. Their "
            "unevenness passes to the law as noise, their uncertainty is added, micro-slip in stick cannot be seen, "
            "and disturbances are not sought, only estimated where they are named. An encoder on each drive would tell "
            "more."
        )
    if len(logs) == 1 and len(logs[0].contacts) == 1:
        found.append("One drive speed leaves mu_k and p nearly collinear: pool logs at three speeds or more.")
    elif len(logs) == 1:
        found.append(
            "One pair of drive speeds hardly tells the laws of two discs apart: pool logs at three pairs or more, now "
            "one disc and now the other the faster, or add logs of one disc alone."
        )
    if free_decay is not None:
        found += free_decay.warnings
        if abs(free_decay.rest) > REST_SUSPECT:
            found.append(
                f"In the free decay the disc comes to rest at {free_decay.rest:.2g} rad: the sensor's zero is off. All "
                "angles were shifted by it."
            )
        k, J = logs[0].rig.k, logs[0].rig.J
        # where both are known to something, they are adjusted to the decay with the fit
        if k is not None and J is not None and not (k.standard_uncertainty and J.standard_uncertainty):
            stated = k.value / J.value
            if abs(free_decay.stiffness_ratio / stated - 1) > 0.02:
                found.append(
                    f"The free decay gives k/J = {free_decay.stiffness_ratio:.5g} 1/s^2, the log's constants "
                    f"{stated:.5g}; the free decay was used, with the stated J."
                )
    return tuple(found)
