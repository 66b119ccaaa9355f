"""Slip shooting: the motion in each slip as an initial-value problem, all slips under one law.

    1  law by the weak form                                             (first values; no guess of the user's)
    2  shooting segments = slip segments of the smoothed speed, trimmed; solve (start states projected out)
    3  cut them anew where the solved motion passes the threshold of slip speed; solve

After 3 no end of a segment is chosen by its own noise, and nothing is trimmed. What happens below the threshold (stick,
micro-slip) does not enter, so that no model of it is needed; multiple shooting: Bock (1983), in Numerical Treatment of
Inverse Problems in Differential and Integral Equations, 95; one segment per slip, since slips are short.
"""

from dataclasses import replace

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import in_threads
from identification.estimators import savitzky_golay, weak_form
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.chart import Bend, bends_of, solve_straight
from identification.estimators.segment_runs import ShootingSegment, Start
from identification.estimators.shooting_problem import LEAST_EDGES, MARGIN, drive_signals, sensed, shooting_problem
from identification.estimators.shooting_segments import ShootingProblem
from identification.estimators.two_discs import joint_rows, segments_at
from identification.inference.problem import Solution
from identification.laws.joint_law import JointLaw
from identification.laws.law import FittableLaw
from identification.measurement.pooled import Pool
from identification.measurement.slip_segments import SlipSegment

SHORTEST = 0.1  # natural periods that a segment must last
GUESS = 0.12  # natural periods at the start of a segment from which its first start states are read
CLEAR = 0.002  # rad that a segment begins off a changeover, so that this one may move
HEAD = 10  # samples, the least from which a motion is continued backward
AHEAD = 0.15  # natural periods by which a segment may grow at either end when it is cut anew
ROUGH, TOLERANCE = 1e-3, 1e-8  # of the searches of stages 2 and 3

STRUCTURE = (
    "rigid contact in slip: no micro-slip above the threshold of slip speed",
    "friction depends on slip speed alone",
    "J, k, c, N, R, r known but for those estimated beside the law",
)


def estimate(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """Friction law from pooled logs. If the later stages are interrupted, or the model cannot be run with the law that
    was found first, that one is returned with a warning. StickslipError: no slip lasts long enough, or friction has the
    wrong sign."""
    first = first_values(ready, law, options)
    try:
        problem, solution = shoot(ready, law, _carried(first, law, options), options)
    except KeyboardInterrupt:
        return replace(first, warnings=(f"Interrupted: this is the result of the {first.estimator.name} estimator.",))
    except Unmodelled as error:
        return replace(first, warnings=(f"{error} This is the result of the {first.estimator.name} estimator.",))
    return Estimate(ESTIMATOR, law, problem, solution)


class Unmodelled(StickslipError):
    """The first values of a law are such that the model cannot be run with them."""


def first_values(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """The weak form's solution, or that of Savitzky-Golay derivatives where slips are too short for it."""
    seen = tuple(term for term in options.disturbances if term.by_inverse_dynamics)
    options = replace(options, disturbances=seen)
    try:
        return weak_form.estimate(ready, law, options)
    except StickslipError:
        if isinstance(law, JointLaw):
            raise
        return savitzky_golay.estimate(ready, law, options)


def _carried(first: Estimate, law: FittableLaw, options: Options) -> np.ndarray:
    """First values (m,) of the law and of all disturbances, from those that inverse dynamics can show."""
    if not options.disturbances:
        return first.solution.values
    names = [unknown.name for unknown in first.problem.unknowns]
    values = dict(zip(names, first.solution.values, strict=True))
    terms = [values.get(term.name, term.first) for term in options.disturbances]
    return np.concatenate([first.solution.values[: len(law.parameters)], terms])


def shoot(ready: Pool, law: FittableLaw, q: np.ndarray, options: Options) -> tuple[ShootingProblem, Solution]:
    """Stages 2 and 3. q: (m,) first values of the law's parameters. Unmodelled: the model refuses them. StickslipError:
    no slip lasts long enough."""
    if isinstance(law, JointLaw):
        ready = segments_at(ready, law, q)
    segments, noise_known = slip_shooting(ready)
    problem = shooting_problem(ready, law, segments, q, options, noise_known)
    fixed = options.given.fixed(problem)
    try:
        problem.evaluate(problem.first)
    except StickslipError as error:
        raise Unmodelled(f"The model of slip cannot be run with the law found first: {error}") from error
    bends = straight(ready, law, q)
    solution = solve_straight(problem, bends, fixed=fixed, progress=options.progress, tolerance=ROUGH)
    trimmed = recut(problem, solution)
    return trimmed, solve_straight(trimmed, bends, fixed=fixed, progress=options.progress, tolerance=TOLERANCE)


def straight(ready: Pool, law: FittableLaw, q: np.ndarray) -> tuple[Bend, ...]:
    """Straight coordinates for the laws of two discs, of which one is often seen at few speeds; none for one disc."""
    if not isinstance(law, JointLaw):
        return ()
    rows = joint_rows(ready, law, q)
    return bends_of(law, ready.contacts, q, rows.speed, rows.disc)


def slip_shooting(ready: Pool) -> tuple[list[ShootingSegment], bool]:
    """Segments on the slip segments of a pool, and whether the noise of their sensors is known. StickslipError: every
    segment is too short."""
    shortest = SHORTEST * ready.natural_period
    long = [s for s in ready.segments if (s.last - s.first) * s.motion.step > shortest]
    if len(long) < 2:
        longest = max(((s.last - s.first) * s.motion.step for s in ready.segments), default=0.0)
        raise StickslipError(
            f"{len(long)} slips last longer than {shortest:.3g} s (longest {longest:.3g} s, ends trimmed); two or more "
            "are needed. Record for several cycles, at a lower drive speed or load, where slips last longer."
        )
    R = ready.values.R
    seen = {id(m): (sensed(m, R), drive_signals(m)) for m in ready.motions}
    segments: list[ShootingSegment] = []
    for slip in long:
        sensor, drives = seen[id(slip.motion)]
        start, end = (float(slip.motion.time[i]) for i in (slip.first, slip.last - 1))
        bare = ShootingSegment(
            start_time=start - MARGIN,
            time=np.zeros(0),
            measured=np.zeros(0),
            cluster=np.zeros(0),
            deviation=sensor.deviation,
            memory=sensor.memory,
            wander=slip.motion.wander * (R if sensor.laser else 1.0),
            log=ready.log_number(slip),
            drives=drives,
            sign=slip.sign,
            laser=sensor.laser,
            guess=_guess(slip, GUESS * ready.natural_period),
        )
        segment = sensor.within(bare, start, end)
        if len(segment.time) >= LEAST_EDGES:
            segments.append(replace(segment, cluster=np.full(len(segment.time), len(segments))))
    return segments, all(sensor.noise_known for sensor, _ in seen.values())


def _guess(slip: SlipSegment, window: float) -> np.ndarray:
    """Angle and speed `MARGIN` before a segment, from a parabola through its first ``window`` seconds."""
    count = min(max(round(window / slip.motion.step), 5), len(slip.angle))
    time = slip.motion.step * np.arange(count) + MARGIN
    curve = np.polynomial.Polynomial.fit(time, slip.angle[:count], 2)
    return np.array([curve(0.0), curve.deriv()(0.0)])


def recut(problem: ShootingProblem, solution: Solution) -> ShootingProblem:
    """The segments between the instants at which the solved motion passes the pool's threshold of slip speed. One whose
    start cannot be found then (a disc may have come to touch just there) stays as it was."""
    ready, x = problem.ready, solution.values
    R = ready.values.R
    seen = [sensed(motion, R) for motion in ready.motions]
    segments: list[ShootingSegment] = []
    before: list[tuple[ShootingSegment, Start]] = []
    spans = in_threads(lambda number: _span(problem, number, x), range(len(problem.segments)), problem.workers)
    for segment, number, (first, end, start) in zip(problem.segments, range(len(spans)), spans, strict=True):
        moved = seen[segment.log].within(segment, first, end)
        step = ready.motions[segment.log].step
        lasts = len(moved.time) * step if moved.lines is None else end - first
        if lasts <= SHORTEST * ready.natural_period or len(moved.time) < LEAST_EDGES:
            continue
        label = np.full(len(moved.time), len(segments))
        moved = replace(moved, start_time=start[0], cluster=label, guess=start[1])
        segments.append(moved)
        before.append(
            (replace(segment, cluster=np.full(len(segment.time), label[0])), Start(problem.starts[number].at(x)))
        )
    trimmed = replace(
        problem, segments=tuple(segments), starts=tuple(Start(segment.guess) for segment in segments), first=x
    )
    pairs = zip(trimmed.segments, trimmed.starts, strict=True)
    follows = in_threads(lambda index: trimmed.follows(index, x), range(len(trimmed.segments)), problem.workers)
    best = [new if well else old for well, new, old in zip(follows, pairs, before, strict=True)]
    return replace(trimmed, segments=tuple(segment for segment, _ in best), starts=tuple(start for _, start in best))


def _span(problem: ShootingProblem, number: int, x: np.ndarray) -> tuple[float, float, tuple[float, np.ndarray]]:
    """First and last time of slip above the threshold, and start time and states before them.

    Forward the motion is run on; backward, where no run leads, it is continued by the cubic that it follows at its
    start.
    """
    ready, segment = problem.ready, problem.segments[number]
    step = ready.motions[segment.log].step
    limit, ahead = ready.threshold, AHEAD * ready.natural_period
    log = ready.motions[segment.log].time
    late = min(float(segment.time[-1]) + ahead, float(log[-1]))
    time = np.arange(segment.start_time, late, step)
    motion = problem.run(number, x, time)
    every, touch = problem.slips(segment, x, motion)
    slip = np.where(touch, np.abs(every), np.inf).min(axis=0)
    after = np.flatnonzero((slip < limit) & (time > segment.time[0] + 0.5 * (segment.time[-1] - segment.time[0])))
    end = float(time[after[0] - 1]) if len(after) else late
    same = np.all(touch == touch[:, :1], axis=0)  # another disc bends the motion
    head = (time <= time[0] + 0.5 * ahead) & np.logical_and.accumulate(same)
    if np.count_nonzero(head) < HEAD:
        return float(segment.time[0]), end, (segment.start_time, np.array([motion["theta"][0], motion["omega"][0]]))
    past = time[0] - step * np.arange(round(ahead / step) + 1)[::-1]
    touched = np.sign(every[touch[:, 0], :1]) * every[touch[:, 0]]
    before = np.min([np.polynomial.Polynomial.fit(time[head], row[head], 3)(past) for row in touched], axis=0)
    angle = np.polynomial.Polynomial.fit(time[head], motion["theta"][head], 4)
    away = np.any(problem.touch(segment, x, angle(past - MARGIN), CLEAR) != touch[:, :1], axis=0)
    low = np.flatnonzero((before < limit) | away)
    first = max(float(past[min(low[-1] + 1, len(past) - 1)]) if len(low) else float(past[0]), float(log[0]))
    if slip[0] < limit:
        first = float(time[np.argmax(slip >= limit)])
    start = first - MARGIN
    return first, end, (start, np.array([angle(start), angle.deriv()(start)]))


ESTIMATOR = Estimator("shooting", STRUCTURE, estimate, searches=(0.15, 0.35, 0.5))
