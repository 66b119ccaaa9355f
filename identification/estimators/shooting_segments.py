"""Shooting segments: initial-value problems on measured samples, whose start states are projected out.

A segment begins in slip at t_0 with angle and speed s = (theta_0, omega_0), runs under the measured drive w(t), and is
seen as the laser sees it:
    y_i = (1 + g_0)/(1 + g) R sin(theta(t_i - (delay - delay_0); s, x) + z) + R drift(t_i) + zero
    r_i = (y_i - measured_i)/sd
measured_i and t_i are corrected by the gain g_0 and the delay_0 that the encoder gave; x holds the law's parameters
and what else is estimated (disturbances, among them z and the drift; gain, delay, zero, J, k, c, R, r, N). For each x
the best s of every segment is found by Gauss-Newton steps from the last one; with Q R = dr/ds,
    r <- r - Q Q'r,     dr/dx <- dr/dx - Q Q' dr/dx       (variable projection, see problem.py).
Derivatives of the motion are exact (fmu_models.simulation.sensitivity), also through stick and release.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import in_threads
from fmu_models.simulation.sensitivity import Sensitivity
from fmu_models.simulation.signal import Signal
from identification.disturbances.oscillator import DURATION, MIDDLE, MIDDLE_ANGLE, SIDE
from identification.disturbances.term import ANGLE, LASER, DisturbanceTerm, Whereabouts, misread
from identification.disturbances.terms import undisturbed
from identification.estimators.base import FrictionProblem, FrictionRows
from identification.estimators.savitzky_golay import friction_samples
from identification.estimators.segment_runs import STARTS, Moves, Runs, ShootingSegment, Start, chain, directions
from identification.estimators.two_discs import joint_rows
from identification.inference.problem import Evaluation, Prior, Solution, Unknown
from identification.laws.joint_law import JointLaw, laws_of, touching
from identification.laws.law import FittableLaw
from identification.measurement.pooled import Pool, RigValues, rig_values, speed_name

LOCAL_STEP = 1e-2  # of a standard deviation: a last step of the start states, whose second order is below 1e-8
LOCAL_STEPS = 12
SEEN = 1.0  # noise deviations per rad and rad/s: a start state that shows less, as in stick, cannot be found
SILENT = 0.5  # of the deviation, rms residuals below which say nothing where it is but assumed
STUCK = 1e-9  # m/s, of rounding: slower is no slip
DIFFERENCE = 1e-6  # rad, rad/s: for derivatives of what a laser shows too much
LINE = "line_"  # before the number of a line of the encoder: its misplacement as an unknown
KEPT = 3  # evaluations: a search asks again for its last ones, and so does what follows it


@dataclass(frozen=True, eq=False)
class ShootingProblem(FrictionProblem):
    """Shooting segments of pooled logs under one law.

    terms: disturbances, whose values follow those of the law in x; along: by inputs of the model that they need (angle
    of the drive, normal force, temperature) what was recorded, by log;
    first: (m,) where the search begins; runs: the models, by the discs in contact, differentiated by what the
    unknowns move and by `STARTS`; starts: those of the segments at the last x that was evaluated, which only saves
    steps; workers: threads.
    """

    ready: Pool
    law: FittableLaw
    segments: tuple[ShootingSegment, ...]
    unknowns: tuple[Unknown, ...]
    held: tuple[Prior, ...]
    first: np.ndarray
    noise_known: bool
    runs: Mapping[tuple[str, ...], Runs]
    starts: tuple[Start, ...] = field(repr=False)
    residual_unit: str = "m"
    terms: tuple[DisturbanceTerm, ...] = ()
    along: Mapping[str, Mapping[int, Signal]] = field(default_factory=dict)
    workers: int | None = None
    _last: deque[tuple[bytes, Evaluation, list[Start]]] = field(
        default_factory=lambda: deque(maxlen=KEPT), init=False, repr=False
    )

    def __getstate__(self) -> dict[str, object]:
        """State for another process."""
        return {**self.__dict__, "_last": deque(maxlen=KEPT)}

    def start(self) -> np.ndarray:
        """The given first values."""
        return self.first

    def evaluate(self, x: np.ndarray) -> Evaluation:
        """Residuals with the start states projected out. StickslipError: the model cannot be run at x."""
        key = np.asarray(x, dtype=float).tobytes()
        for point, evaluation, starts in self._last:
            if point == key:
                self._begin_at(starts)
                return evaluation
        names = [unknown.name for unknown in self.unknowns]
        residual, gradient, slip = self._all(x, names)
        result = Evaluation(
            residual=residual,
            gradient=gradient,
            cluster=np.concatenate([segment.cluster for segment in self.segments]),
            log=np.repeat([segment.log for segment in self.segments], [len(segment.time) for segment in self.segments]),
            slip=slip,
            eliminated=len(STARTS) * len(self.segments),
        )
        self._last.append((key, result, [replace(start) for start in self.starts]))
        return result

    def squares(self) -> Callable[[np.ndarray], float]:
        """As in `Problem`; every evaluation begins with the start states of the last one before this call."""
        runs = {on: Runs(run.fmu, directions(self.law, (), on)) for on, run in self.runs.items()}
        initial = tuple(replace(start) for start in self.starts)

        def of(x: np.ndarray) -> float:
            light = replace(self, runs=runs, starts=tuple(replace(start) for start in initial))
            residual = light._all(x, ())[0]
            return float(residual @ residual)

        return of

    def _begin_at(self, starts: Sequence[Start]) -> None:
        for mine, source in zip(self.starts, starts, strict=True):
            mine.states, mine.x, mine.slope = source.states, source.x, source.slope

    def _all(self, x: np.ndarray, names: Sequence[str]) -> list[np.ndarray]:
        """`_projected` of all segments, one after the other."""
        before = [replace(start) for start in self.starts]
        try:
            pieces = in_threads(
                lambda number: self._projected(number, x, names), range(len(self.segments)), self.workers
            )
        except StickslipError:
            # how far others came depends on who shared the work
            self._begin_at(before)
            raise
        return [np.concatenate(piece) for piece in zip(*pieces, strict=True)]

    def resampled(self, clusters: np.ndarray) -> ShootingProblem:
        chosen = [(segment.of(clusters), start) for segment, start in zip(self.segments, self.starts, strict=True)]
        used = [(segment, start) for segment, start in chosen if segment is not None]
        return replace(
            self, segments=tuple(segment for segment, _ in used), starts=tuple(replace(start) for _, start in used)
        )

    @property
    def beforehand(self) -> np.ndarray:
        """What is known of the law."""
        rows = self.law.beforehand
        return np.hstack([rows, np.zeros((len(rows), len(self.unknowns) - rows.shape[1]))])

    def rows(self, x: np.ndarray) -> FrictionRows:
        """Friction by inverse dynamics on the slip segments, for the eye: segments measure none."""
        ready = self.ready.with_constants(self.known(x))
        if isinstance(self.law, JointLaw):
            return joint_rows(ready, self.law, x[: len(self.law.parameters)])
        samples = friction_samples(ready)
        count = len(self.law.parameters)
        assert samples.sign is not None
        speed = self.law.along(np.abs(samples.slip), samples.sign)
        fitted, measured = self.law.value(speed, x[:count]), samples.coefficient
        if self.terms:
            assert samples.where is not None
            values = x[count : count + len(self.terms)]
            measured = undisturbed(self.terms, values, measured, samples.sign, samples.where, ready.values)
        return FrictionRows(
            speed=self.law.along(samples.slip, samples.sign),
            least=samples.slip,
            greatest=samples.slip,
            measured=measured,
            fitted=fitted,
            cluster=samples.cluster,
            log=samples.log,
            disc=np.zeros(len(samples.log), dtype=int),
        )

    def tested(self, solution: Solution) -> bool:
        """Whether residuals tell of the model: not where edges lie nearer to it than anything is known to come."""
        counted = any(segment.lines is not None for segment in self.segments)
        return not counted or float(np.mean(solution.evaluation.residual**2)) > SILENT**2

    def rms(self, x: np.ndarray) -> float:
        """Root mean square of the measured displacement."""
        deviations = np.repeat(
            [segment.deviation for segment in self.segments], [len(segment.time) for segment in self.segments]
        )
        return float(np.sqrt(np.mean((deviations * self.evaluate(x).residual) ** 2)))

    def by_held(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Exact slopes; the laser's gain and delay are among the unknowns, or nothing is known of them."""
        names = [prior.name for prior in self.held]
        runs = {on: Runs(run.fmu, directions(self.law, names, on)) for on, run in self.runs.items()}
        full = replace(self, runs=runs, starts=tuple(Start(start.at(x)) for start in self.starts))
        return dict(zip(names, full._all(x, names)[1].T, strict=True))

    def with_held(self, priors: tuple[Prior, ...]) -> ShootingProblem:
        """The same problem on the same samples."""
        return replace(self, held=priors, starts=tuple(replace(start) for start in self.starts))

    def run(self, number: int, x: np.ndarray, time: np.ndarray) -> Sensitivity:
        """The motion of segment ``number`` at x, from its best start states, at times (n,) of the model's clock."""
        segment = self.segments[number]
        rig, contacts = rig_values(self.known(x)), self.contacts(segment)
        theta, omega = self.starts[number].at(x)
        # the model turns its drives at r w: so much faster ones are discs so much larger
        over = self.known(x).get(speed_name(segment.log), 1.0)
        values = {"J": rig.J, "k": rig.k, "c": rig.c, "R": rig.R, "r": rig.r * over}
        start = {"theta": float(theta), "omega": float(omega)}
        for single in laws_of(self.law, contacts):
            law = {f"{name}{single.disc}": float(v) for name, v in zip(single.law.names, x[single.place], strict=True)}
            values |= law | {f"N{single.disc}": rig.forces[single.force]}
            if f"sigma0{single.disc}" in law:
                start[f"z{single.disc}"] = segment.bristles
            start |= self._aged(single.disc, segment, rig, float(omega))
        if isinstance(self.law, JointLaw) and self.law.changeover is not None and len(contacts) == 2:
            values[self.law.changeover] = float(x[len(self.law.parameters) - 1])
        inputs = {f"w{contact[-1]}": drive for contact, drive in zip(contacts, segment.drives, strict=True)}
        inputs |= {name: signals[segment.log] for name, signals in self.along.items()}
        count = len(self.law.parameters)
        for value, term in zip(x[count:], self.terms, strict=False):
            moves = self.moved(segment)[term.name]
            values |= {name: values.get(name, 0.0) + by * float(value) for name, by in moves.items()}
        variables = self.runs[contacts].fmu.variables
        if DURATION in variables:
            log = self.ready.motions[segment.log].time
            values |= {MIDDLE: float(log[0] + log[-1]) / 2, DURATION: float(log[-1] - log[0])}
        if MIDDLE_ANGLE in variables:
            values[MIDDLE_ANGLE] = next((term.reference for term in self.terms if term.reference), 0.0)
        if SIDE in variables:
            values[SIDE] = float(segment.sign)
        with self.runs[contacts].taken() as run:
            return run.run(time, start_time=segment.start_time, parameters=values, start=start, inputs=inputs)

    def _aged(self, disc: str, segment: ShootingSegment, rig: RigValues, omega: float) -> dict[str, float]:
        """Age of the contacts at the start of a segment, s, of a law that knows one: that of steady slip at the speed
        there. Slip since the release has renewed them, whatever they were in stick."""
        age, variables = f"theta{disc}", self.runs[self.contacts(segment)].fmu.variables
        if age not in variables:
            return {}
        drive = segment.drives[self.contacts(segment).index(f"disc{disc}")]
        slip = abs(rig.r * float(np.interp(segment.start_time, drive.time, drive.value)) - rig.R * omega)
        return {age: float(str(variables[f"D_c{disc}"].start)) / max(slip, STUCK)}

    def moved(self, segment: ShootingSegment, constants: Mapping[str, float] = MappingProxyType({})) -> Moves:
        """Derivatives of the FMU's parameters by each disturbance in a segment: 1, or 0 for that of another log; a
        sensor's moves none. With the constants, by r and by the speeds of drives too."""
        moves: Moves = {
            term.name: {} if term.of_sensor else {term.parameter: float(term.log in (None, segment.log))}
            for term in self.terms
        }
        mine = speed_name(segment.log)
        if mine in constants:
            moves |= {"r": {"r": constants[mine]}, mine: {"r": constants["r"]}}
        return moves

    def follows(self, number: int, x: np.ndarray) -> bool:
        """Whether the start of segment ``number`` can be found at x."""
        try:
            self._projected(number, x, [unknown.name for unknown in self.unknowns])
        except StickslipError:
            return False
        return True

    def contacts(self, segment: ShootingSegment) -> tuple[str, ...]:
        """The driving discs in contact in the log of a segment."""
        return self.ready.motions[segment.log].log.contacts

    def slips(self, segment: ShootingSegment, x: np.ndarray, motion: Sensitivity) -> tuple[np.ndarray, np.ndarray]:
        """Slip speeds (n_discs, n) in m/s of a motion on each disc, and whether it touches (n_discs, n)."""
        values = self.known(x)
        drives = np.array([np.interp(motion.time, drive.time, drive.value) for drive in segment.drives])
        slip = values["r"] * values.get(speed_name(segment.log), 1.0) * drives - values["R"] * motion["omega"]
        return slip, self.touch(segment, x, motion["theta"])

    def touch(self, segment: ShootingSegment, x: np.ndarray, angle: np.ndarray, guard: float = 0.0) -> np.ndarray:
        """Whether each disc in a segment's log touches (n_discs, n) at angles (n,) rad, give or take ``guard`` rad."""
        return touching(self.law, self.contacts(segment), x[: len(self.law.parameters)], angle, guard)

    def known(self, x: np.ndarray) -> dict[str, float]:
        """Values of everything but the law at x: constants of the rig, gain, delay, zero."""
        values = {"gain": self.ready.sensors.gain, "delay": self.ready.sensors.delay, "zero": 0.0}
        values |= {prior.name: prior.value for prior in self.held}
        count = len(self.law.parameters)
        return values | {u.name: float(v) for u, v in zip(self.unknowns[count:], x[count:], strict=True)}

    def _projected(self, number: int, x: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual (n,), its derivatives (n, len(names)) and slip speeds (n,) m/s of one segment."""
        last = self.starts[number]
        before = replace(last)
        try:
            return self._searched(number, x, names)
        except StickslipError:
            # where the disc sticks at once its first speed counts for nothing, and a step of it may lead anywhere;
            # and from the start at an x that is far off none may be found that the log shows
            last.states, last.x, last.slope = self.segments[number].guess, None, None
        try:
            return self._searched(number, x, names)
        except StickslipError:
            last.states, last.x, last.slope = before.states, before.x, before.slope
            raise

    def _searched(self, number: int, x: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `_projected`; leaves the last start states behind."""
        segment, last = self.segments[number], self.starts[number]
        slipped: np.ndarray | None = None
        for _ in range(LOCAL_STEPS):
            seen, by_start, columns, slip = self._seen(number, x, names)
            residual = segment.whitened((seen - segment.measured)[:, None])[:, 0]
            columns = segment.whitened(columns)
            basis, triangle = np.linalg.qr(segment.whitened(by_start))
            if np.min(np.abs(np.diag(triangle))) < SEEN:
                if slipped is None:
                    break
                # a whole step from a start that slips led into stick, where its speed counts for nothing
                last.states, last.x, last.slope = (last.at(x) + slipped) / 2, None, None
                continue
            slipped = np.array(last.at(x))
            along = basis.T @ np.column_stack([residual, columns])
            moved = -np.linalg.solve(triangle, along)
            last.states = last.at(x) + moved[:, 0]
            last.x, last.slope = (x.copy(), moved[:, 1:]) if len(names) == len(x) else (None, None)
            if np.max(np.abs(basis @ along[:, 0])) < LOCAL_STEP:
                return residual - basis @ along[:, 0], columns - basis @ along[:, 1:], slip
        raise StickslipError(
            f"The start of the motion at {segment.start_time:.4g} s in log "
            f"'{self.ready.motions[segment.log].log.name}' cannot be found: the model does not follow the log there."
        )

    def _seen(
        self, number: int, x: np.ndarray, names: Sequence[str]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """What the sensor would show (n,), its derivatives by start states (n, 2) and by names, slip speeds (n,)."""
        segment, values, sensors = self.segments[number], self.known(x), self.ready.sensors
        motion = self.run(number, x, segment.time - (values["delay"] - sensors.delay))
        theta, omega = motion["theta"], motion["omega"]
        # an encoder calibrates the laser as a meter of angles, whatever R; without one R is its lever
        lever = self.ready.values.R if sensors.lines else values["R"]
        scale = (1 + sensors.gain) / (1 + values["gain"]) / values.get("laser", 1.0) * lever
        offsets = [term.name for term in self.terms if term.effect.sensor == ANGLE]
        theta = theta + sum(values[name] for name in offsets)
        reading = scale * np.sin(theta) if segment.laser else theta
        slope = scale * np.cos(theta) if segment.laser else np.ones_like(theta)
        drift, (by_angle, by_speed), drifts = self._drift(segment, values, theta, omega)
        by = (slope + lever * by_angle)[:, None] * motion.of("theta")
        if np.any(by_speed):
            by = by + (lever * by_speed)[:, None] * motion.of("omega")
        inner = len(motion.by) - len(STARTS)
        across = chain(self.law, values, names, motion.by[:inner], self.contacts(segment), self.moved(segment, values))
        columns = by[:, :inner] @ across
        more = {"gain": -reading / (1 + values["gain"]), "delay": -slope * omega, "zero": 1.0}
        more |= {"laser": -reading / values.get("laser", 1.0)} | dict.fromkeys(offsets, slope)
        more |= {name: lever * drift for name, drift in drifts.items()}
        if segment.lines is not None:
            more |= {name: segment.lines == int(name.removeprefix(LINE)) for name in names if name.startswith(LINE)}
        if segment.laser and not sensors.lines:
            more["R"] = reading / values["R"]
        for column, name in enumerate(names):
            columns[:, column] += more.get(name, 0.0)
        every, touch = self.slips(segment, x, motion)
        slip = np.where(touch, np.abs(every), np.inf).min(axis=0)
        if segment.lines is not None:
            reading = reading + np.array([values[f"{LINE}{line}"] for line in segment.lines])
        return reading + lever * drift + values["zero"], by[:, inner:], columns, np.where(slip > STUCK, slip, np.nan)

    def _drift(
        self, segment: ShootingSegment, values: Mapping[str, float], theta: np.ndarray, omega: np.ndarray
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], dict[str, np.ndarray]]:
        """What the laser shows too much, over R (n,), its derivatives by angle and speed, and by each term."""
        terms = [t for t in self.terms if t.effect.sensor == LASER and t.log in (None, segment.log)]
        x = np.array([values[term.name] for term in terms])
        if not terms:
            return np.zeros(1), (np.zeros(1), np.zeros(1)), {}
        log = self.ready.motions[segment.log].time
        where = Whereabouts.seen(log, segment.log, segment.time, theta, omega)

        def curves(angle: float, speed: float) -> list[np.ndarray]:
            at = replace(where, angle=theta + angle, speed=omega + speed)
            return [np.cos(at.angle) * shape for shape in misread(terms, x, at)[1]]

        slopes = [
            x @ (np.array(curves(*ahead)) - np.array(curves(*(-np.array(ahead))))) / (2 * DIFFERENCE)
            for ahead in ((DIFFERENCE, 0.0), (0.0, DIFFERENCE))
        ]
        drifts = curves(0.0, 0.0)
        return x @ np.array(drifts), (slopes[0], slopes[1]), dict(zip([t.name for t in terms], drifts, strict=True))
