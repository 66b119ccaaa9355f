"""The problem of shooting segments, made of logs: what a sensor showed and how noisily, drives, models, unknowns."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.signal import Signal
from identification.disturbances.oscillator import LOAD, TURNED, WARMER, disturbed_oscillator
from identification.disturbances.term import DisturbanceTerm
from identification.estimators.base import Options
from identification.estimators.regression import load_factor, warmth
from identification.estimators.segment_runs import Runs, ShootingSegment, Start, directions
from identification.estimators.shooting_segments import LINE, ShootingProblem
from identification.inference.problem import Prior, Unknown
from identification.laws.law import FittableLaw, unknowns
from identification.measurement.motion import DiscMotion, drive_angle
from identification.measurement.pooled import SPEED, Pool
from rig_io.logs.arrangement import MODELS

MARGIN = 0.005  # s by which a segment begins before its first sample, so that the delay may move
DRIVE_STEP = 0.02  # s between knots of the drive's speed in the model: its eighth harmonic bends by 0.3 % between
BENT = 0.01  # of the range of what goes with it, where it bends by more between them
ZERO_UNCERTAINTY = 2e-5  # m, assumed of a laser's zero where it is to be estimated
LEAST_NOISE = 1e-6  # of the range of a reading, where a log without noise (a computed one) shows less
EDGE_NOISE = 2e-5  # rad: what unevenness between the edges of a drive's encoder adds, beside misplaced lines
LEAST_EDGES = 3  # of the encoder in a segment: two show nothing but its start
REACH = 20.0  # standard uncertainties of a prior, within which a nuisance parameter is searched


def shooting_problem(
    ready: Pool,
    law: FittableLaw,
    segments: Sequence[ShootingSegment],
    q: np.ndarray,
    options: Options,
    noise_known: bool,
) -> ShootingProblem:
    """The problem of these segments. q: (m,) first values of the law's parameters, and of disturbances where known.
    StickslipError: a nuisance parameter is unknown, or nothing is known of it."""
    others = _nuisance(ready, options.nuisance, any(segment.laser for segment in segments))
    terms = options.disturbances
    every = options.given.bounded((*unknowns(law), *(term.unknown for term in terms), *others))
    freed = {unknown.name for unknown in others}
    runs = _runs(ready, law, [unknown.name for unknown in every], terms)
    variables = {name for each in runs.values() for name in each.fmu.variables}
    recorded: Mapping[str, Callable[[DiscMotion], np.ndarray]] = {
        TURNED: lambda motion: drive_angle(motion, int(motion.log.contacts[0][-1])),
        LOAD: lambda motion: load_factor(motion, ready.values.N),
        WARMER: warmth,
    }
    return ShootingProblem(
        ready=ready,
        law=law,
        segments=tuple(segments),
        unknowns=every,
        held=tuple(prior for prior in ready.priors if prior.name not in freed),
        first=np.concatenate(
            [
                q,
                [0.0] * (len(law.parameters) - len(q)),
                [term.first for term in terms][max(len(q) - len(law.parameters), 0) :],
                [unknown.prior.value for unknown in others if unknown.prior is not None],
            ]
        ),
        noise_known=noise_known,
        runs=runs,
        starts=tuple(Start(segment.guess) for segment in segments),
        residual_unit="m" if any(segment.laser for segment in segments) else "rad",
        terms=terms,
        workers=options.workers,
        along={name: _along_logs(ready, values) for name, values in recorded.items() if name in variables},
    )


def under(slips: ShootingProblem, x: np.ndarray, law: FittableLaw, q: np.ndarray) -> ShootingProblem:
    """The same segments under another law, so that the two are judged by the same residuals. slips: solved at x; q:
    (m,) first values of the law's parameters."""
    count = len(slips.law.parameters)
    every = (*unknowns(law), *slips.unknowns[count:])
    return replace(
        slips,
        law=law,
        unknowns=every,
        first=np.concatenate([q, x[count:]]),
        runs=_runs(slips.ready, law, [unknown.name for unknown in every], slips.terms),
        starts=tuple(Start(start.at(x)) for start in slips.starts),
    )


def _runs(
    ready: Pool, law: FittableLaw, names: Sequence[str], terms: Sequence[DisturbanceTerm]
) -> dict[tuple[str, ...], Runs]:
    """The models of the logs, by the discs in contact, differentiated by what is named."""
    from fmu_models.codegen.package import built
    from fmu_models.fmu.fmu import Fmu

    runs = {}
    for contacts in dict.fromkeys(motion.log.contacts for motion in ready.motions):
        if not all(term.of_sensor for term in terms):
            fmu = disturbed_oscillator(contacts[0], law.reference, terms)
        else:
            model = MODELS[ready.arrangement if len(contacts) == 2 else "together"]
            fmu = Fmu.open(built(model, contacts=contacts, laws=dict.fromkeys(contacts, law.reference)))
        runs[contacts] = Runs(fmu, directions(law, names, contacts, terms))
    return runs


def _along_logs(ready: Pool, values_of: Callable[[DiscMotion], np.ndarray]) -> dict[int, Signal]:
    """What goes with the drive of the one disc in each log, for the model; values_of: a log's (n,)."""
    signals = {}
    for number, motion in enumerate(ready.motions):
        (signal,) = drive_signals(motion)
        values = values_of(motion)
        off = np.abs(values - np.interp(motion.time, signal.time, np.interp(signal.time, motion.time, values)))
        bent = motion.time[off > max(BENT * float(np.ptp(values)), 5 * float(np.median(off)))]
        time = np.union1d(signal.time, bent)
        signals[number] = Signal(time, np.interp(time, motion.time, values))
    return signals


def _nuisance(ready: Pool, names: Sequence[str], laser: bool) -> tuple[Unknown, ...]:
    """Gain and delay as the encoder gave them, and what was asked for."""
    nuisance = []
    if laser:
        deviations = np.sqrt(np.diag(ready.sensors.covariance))
        source = "laser against encoder" if ready.sensors.lines else "clocks of the recorders"
        pairs = (("gain", ready.sensors.gain, "1"), ("delay", ready.sensors.delay, "s"))
        for (name, value, unit), deviation in zip(pairs, deviations, strict=True):
            if not deviation > 0:
                continue
            prior = Prior(name, value, unit, float(deviation), source)
            reach = min(REACH * float(deviation), MARGIN if name == "delay" else 0.1)
            nuisance.append(Unknown(name, unit, value - reach, value + reach, f"{name} of the laser", prior))
    stated = {prior.name: prior for prior in ready.priors}
    taken = [p.name for p in ready.priors if p.name.startswith(("laser", SPEED)) and p.standard_uncertainty > 0]
    taken += [] if ready.zero is None else ["zero"]
    stated["zero"] = ready.zero or Prior("zero", 0.0, "m" if laser else "rad", ZERO_UNCERTAINTY, "assumed")
    for name in dict.fromkeys([*taken, *names]):
        if name not in stated:
            raise StickslipError(f"'{name}' cannot be estimated beside the law. Known are: {', '.join(stated)}.")
        prior = stated[name]
        if not prior.standard_uncertainty > 0:
            raise StickslipError(
                f"The rig constant {name} is stated without uncertainty, so it cannot be estimated beside the law: the "
                'logs alone do not tell them apart. State its "standard_uncertainty" in datapackage.json.'
            )
        reach = REACH * prior.standard_uncertainty
        low = prior.value - reach if name == "zero" else max(prior.value - reach, 0.1 * prior.value)
        nuisance.append(Unknown(name, prior.unit, low, prior.value + reach, f"known from: {prior.source}", prior))
    return (*nuisance, *_lines(ready))


def _lines(ready: Pool) -> tuple[Unknown, ...]:
    """Misplacements of the lines of an encoder that alone shows the angle: all passes of a line share one."""
    passed = [motion.passes.line for motion in ready.motions if motion.passes is not None]
    if not passed:
        return ()
    deviation = ready.sensors.rms
    reach = REACH * deviation
    lines = np.unique(np.concatenate(passed))
    priors = [Prior(f"{LINE}{line}", 0.0, "rad", deviation, "usual ruling", many=True) for line in lines]
    return tuple(Unknown(prior.name, "rad", -reach, reach, "misplacement of a line", prior) for prior in priors)


def drive_signals(motion: DiscMotion) -> tuple[Signal, ...]:
    """The speed of each drive for the model, held at both ends for `MARGIN` and more."""
    stride = max(round(DRIVE_STEP / motion.step), 1)
    ends = motion.time[0] - 2 * MARGIN, motion.time[-1] + 2 * MARGIN
    time = np.concatenate([ends[:1], motion.time[::stride], motion.time[-1:], ends[1:]])
    keep = np.concatenate([[True], np.diff(time) > 0])
    signals = []
    for drive in motion.drives:
        value = np.concatenate([drive[:1], drive[::stride], drive[-1:], drive[-1:]])
        signals.append(Signal(time[keep], value[keep]))
    return tuple(signals)


@dataclass(frozen=True, eq=False)
class Sensed:
    """What shooting compares a model with. time: (n,) s; readings: (n,) m or rad, see `measured`; good: (n,) those that
    the sensor gave; lines: (n,) of an encoder that alone shows the angle; laser; deviation
    of the noise, whether it is known, and its memory in s (0: white)."""

    time: np.ndarray
    readings: np.ndarray
    good: np.ndarray
    lines: np.ndarray | None
    laser: bool
    deviation: float
    noise_known: bool
    memory: float = 0.0

    def within(self, segment: ShootingSegment, start: float, end: float) -> ShootingSegment:
        """A segment with the good samples from begin to end, s."""
        inside = (self.time >= start) & (self.time <= end) & self.good
        lines = None if self.lines is None else self.lines[inside]
        return replace(segment, time=self.time[inside], measured=self.readings[inside], lines=lines)


def sensed(motion: DiscMotion, R: float) -> Sensed:
    """Samples of the sensor that shows the angle; of an encoder alone its edges."""
    passes = motion.passes
    if passes is None:
        readings, laser = measured(motion, R)
        return Sensed(motion.time, readings, ~motion.filled, None, laser, *noise(motion, R), motion.memory)
    every = np.ones(len(passes.time), dtype=bool)
    return Sensed(passes.time, passes.angle, every, passes.line, False, EDGE_NOISE, False)


def measured(motion: DiscMotion, R: float) -> tuple[np.ndarray, bool]:
    """What the angle sensor showed (n,), and whether it was a laser: displacement in m, or the angle itself in rad."""
    laser = motion.log.has("laser") and not motion.log.has("angle")
    return (R * np.sin(motion.angle) if laser else motion.angle), laser


def noise(motion: DiscMotion, R: float) -> tuple[float, bool]:
    """Standard deviation of the angle sensor's noise in the unit of `measured`, and whether it is known: from the
    calibration and the resolution that the readings show, otherwise from what the readings do within four samples."""
    readings, laser = measured(motion, R)
    if motion.colour is not None:
        return (R if laser else 1.0) * motion.colour.noise, False
    calibration = motion.log.calibration.laser
    if laser and calibration is not None and calibration.noise > 0:
        volts = np.unique(np.round(motion.log.column("laser"), 9))
        resolution = abs(calibration.gain) * float(np.min(np.diff(volts))) if len(volts) > 1 else 0.0
        return float(np.hypot(calibration.noise, resolution / np.sqrt(12))), True
    # third differences of white noise have 20 times its variance, those of a motion next to nothing
    deviation = float(np.sqrt(np.mean(np.diff(readings, 3) ** 2) / 20))
    return max(deviation, LEAST_NOISE * float(np.ptp(readings))), False
