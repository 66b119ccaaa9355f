"""Two driving discs in the weak form: the force of both, averaged over windows in which each that touches slips.

    sum_j a_j sum_i chi_i(th_j; x) N_i sgn(v_ij) mu_i(|v_ij|; q) = measured    (N),     v_i = r w_i - R th'

a_j, measured: averages of `weak_form` (its bump). chi_i: 1 where disc i touches, which the angle decides
(`rig_io.logs.arrangement`) and the changeover x; within the one sample interval that passes the changeover it is the
share of the interval, so that the equations are continuous in x. A log of one disc has N_i = 0 for the other.

Windows that hold a stick are left out. While the disc sticks to one driving disc its motion is known beforehand, and
the equation gives the force that holds it, of which the law says only |F| <= N mu_s: an inequality that the raw angle,
noisy as its second derivative is, would seldom come near. What a stick tells of the law is when it ends; that is used
where the whole motion is simulated.

Which disc touches is unknown until the changeover is known. First windows are taken where the slip speeds of both discs
are off zero, whichever touches, and x is found by a scan of the misfit; then those where the disc that touches slips.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import FrictionRows, Options
from identification.estimators.chart import bends_of, solve_straight
from identification.estimators.regression import Regression, RegressionProblem, loose
from identification.estimators.windows import SPEED_ORDER, SPEED_WINDOW, WINDOW, bump, stride_of, whitening, windows
from identification.inference.problem import TOLERANCE, Solution
from identification.laws.joint_law import DISCS, JointLaw, touching
from identification.laws.law import FittableLaw
from identification.measurement.motion import odd_count, savitzky_golay
from identification.measurement.pooled import Pool, RigValues
from identification.measurement.slip_segments import SlipSegment, long_enough, slip_segments

COLUMNS = ("slip", "measured", "force", "angle", "turn", "always")  # with a row for each window
THIN = 3  # samples per node of the average: 80 nodes on a bump whose first seven derivatives vanish at the ends
GUARD = 0.005  # rad on either side of the changeover where both discs must slip: ten times what it is known to at first
CANDIDATES = 41  # changeovers of the scan: 5 mrad apart on a swing of 0.2 rad
SLOPES = np.geomspace(0.5, 30.0, 5)  # of the scan: p times the greatest slip speed, for laws that fall
SELDOM = 0.01  # share of a log: a disc touched less says nothing
COARSE = 1e-6  # relative, of the search that only says which disc touches when
NEAR = 1e-6  # rad, least turn of the disc in one sample


@dataclass(frozen=True, eq=False)
class JointRegression(Regression):
    """The `Regression` of two discs.

    slip: (n, w, 2) m/s, with its sign; measured: (n,) N; force: (n, 2) N, 0 where the log is of the other disc alone;
    angle: (n, w) rad; turn: (n, w) rad, by which the angle changes from node to node, positive; always: (n,) rows of
    logs whose discs touch at every angle, whichever the arrangement of others.
    """

    by_row: ClassVar[tuple[str, ...]] = (*COLUMNS, "log")
    force: np.ndarray
    angle: np.ndarray
    turn: np.ndarray
    always: np.ndarray

    @property
    def speed(self) -> np.ndarray:
        """Mean slip speed (n,) over the discs of the log, m/s."""
        present = self.force > 0
        return (np.abs(self.slip).transpose(0, 2, 1) @ self.average * present).sum(axis=1) / present.sum(axis=1)

    def touch(self, law: JointLaw, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shares (n, w, 2) of time that each disc touches, and their derivatives by the changeover, per rad."""
        share, slope = np.ones(self.slip.shape), np.zeros(self.slip.shape)
        if law.changeover is None:
            return share, slope
        for disc, (edge, side) in enumerate(zip(law.edges, (-1.0, 1.0), strict=True)):
            past = side * (self.angle - edge * q[-1]) / self.turn + 0.5
            share[..., disc] = np.clip(past, 0.0, 1.0)
            slope[..., disc] = np.where((past > 0) & (past < 1), -side * edge / self.turn, 0.0)
        share[self.always], slope[self.always] = 1.0, 0.0
        return share, slope

    def model(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Averaged force (n,), N."""
        assert isinstance(law, JointLaw)
        push = np.sign(self.slip) * self.force[:, None, :]
        return (self.touch(law, q)[0] * push * law.value(np.abs(self.slip), q)).sum(axis=2) @ self.average

    def model_gradient(self, law: FittableLaw, q: np.ndarray) -> np.ndarray:
        """Derivatives (n, m) of the averaged force."""
        assert isinstance(law, JointLaw)
        share, slope = self.touch(law, q)
        push = np.sign(self.slip) * self.force[:, None, :]
        columns = []
        for disc in DISCS:
            by = law.single.gradient(np.abs(self.slip[..., disc]), q[law.of_disc(disc)])
            columns += [(share[..., disc] * push[..., disc] * column) @ self.average for column in by]
        if law.changeover is not None:
            columns.append((slope * push * law.value(np.abs(self.slip), q)).sum(axis=2) @ self.average)
        return np.stack(columns, axis=1)

    def rows(self, law: JointLaw, q: np.ndarray) -> FrictionRows:
        """Friction of each disc with that of the other, as modelled, taken off, in the windows in which it touches for
        the most part."""
        share = self.touch(law, q)[0] * np.sign(self.slip) * self.force[:, None, :]
        slip, mu = np.abs(self.slip), law.value(np.abs(self.slip), q)
        off = self.measured - self.model(law, q)
        weight = share.transpose(0, 2, 1) @ self.average
        rows, disc = np.nonzero(np.abs(weight) > 0.5 * self.force.max(axis=0))
        fitted = (share * mu)[rows, :, disc] @ self.average / weight[rows, disc]
        return FrictionRows(
            speed=slip[rows, :, disc] @ self.average,
            least=slip[rows, :, disc].min(axis=1),
            greatest=slip[rows, :, disc].max(axis=1),
            measured=fitted + off[rows] / weight[rows, disc],
            fitted=fitted,
            cluster=self.cluster[rows],
            log=self.log[rows],
            disc=disc,
        )


def joint_equations(
    segments: Sequence[SlipSegment], logs: Sequence[int], rig: RigValues, period: float
) -> JointRegression:
    """Equations of slip segments. logs: number of the log of each; period: natural period, s."""
    step = segments[0].motion.step
    count = odd_count(WINDOW * period, step)
    nodes = np.arange((count // 2) % THIN, count, THIN)
    average, weights = bump(count, step, replace(rig, forces=(1.0,)))
    columns: dict[str, list[np.ndarray]] = {name: [] for name in COLUMNS}
    whiten = []
    for segment in segments:
        smooth, speed = (
            savitzky_golay(segment.angle, step, SPEED_WINDOW * period, SPEED_ORDER, order) for order in (0, 1)
        )
        slip, force = _of_discs(segment, speed, rig)
        spare = len(smooth) - count
        stride = stride_of(spare, step, period)
        angles = windows(segment.angle, count, stride)
        rows = len(angles)
        columns["slip"].append(np.stack([windows(values, count, stride)[:, nodes] for values in slip], axis=-1))
        columns["measured"].append(angles @ weights)
        columns["force"].append(np.tile(force, (rows, 1)))
        columns["angle"].append(windows(smooth, count, stride)[:, nodes])
        columns["turn"].append(np.maximum(np.abs(windows(speed, count, stride)[:, nodes]) * THIN * step, NEAR))
        log = segment.motion.log
        columns["always"].append(np.full(rows, len(log.contacts) == 1 or log.experiment.arrangement == "together"))
        whiten.append(whitening(weights, stride, rows, segment.motion.memory / step))
    arrays: dict[str, Any] = {name: np.concatenate(pieces) for name, pieces in columns.items()}
    cluster = np.repeat(np.arange(len(segments)), [len(column) for column in columns["measured"]])
    return JointRegression(
        average=average[nodes] / average[nodes].sum(),
        cluster=cluster,
        log=np.asarray(logs)[cluster],
        whiten=tuple(whiten),
        noise=float(np.linalg.norm(weights)),
        **arrays,
    )


def _of_discs(segment: SlipSegment, speed: np.ndarray, rig: RigValues) -> tuple[np.ndarray, np.ndarray]:
    """Slip speeds (2, n) in m/s on disc 0 and 1, and their normal forces (2,) in N; for a disc that is away, 0."""
    slip, force = np.zeros((2, len(speed))), np.zeros(2)
    for contact, drive in zip(segment.motion.log.contacts, segment.motion.drives, strict=True):
        disc = int(contact[-1])
        slip[disc] = rig.r * drive[segment.first : segment.last] - rig.R * speed
        force[disc] = rig.forces[disc]
    return slip, force


def first_guess(these: JointRegression, law: JointLaw) -> np.ndarray:
    """Where to begin the search (m,): the best of a scan over the changeover and, by disc, over the slope of the law.

    For each changeover the averaged force is first fitted by Conti's law, which is linear in mu_s and mu_k for given p,
    disc by disc; the law's own guess starts from the friction found so.
    """
    thin = these.of(np.unique(these.cluster)[:: max(len(np.unique(these.cluster)) // 60, 1)])
    candidates = [0.0]
    if law.changeover is not None:
        low, high = np.quantile(thin.angle[~thin.always], [0.02, 0.98])
        low = max(low, 0.0) if law.changeover == "alpha" else low
        candidates = np.linspace(low, high, CANDIDATES).tolist()
    fits = [(*_linear_fit(thin, law, x), x) for x in candidates]
    _, shapes, x = min(fits, key=lambda fit: fit[0])
    columns = []
    for disc, (mu_s, mu_k, p) in enumerate(shapes):
        speed = np.abs(thin.slip[..., disc])[thin.force[:, disc] > 0].ravel()
        speed = np.linspace(0.0, float(speed.max()), 60)[1:]
        columns.append((speed, (mu_s - mu_k) / (1 + p * speed) + mu_k))
    v, mu = (np.stack([column[i] for column in columns], axis=1) for i in (0, 1))
    guess = law.start(v, mu)
    return guess if law.changeover is None else np.append(guess, x)


def _linear_fit(these: JointRegression, law: JointLaw, x: float) -> tuple[float, list[tuple[float, float, float]]]:
    """Misfit, and (mu_s, mu_k, p) of each disc, for one changeover."""
    share = these.touch(law, np.array([x]))[0]
    push = share * np.sign(these.slip) * these.force[:, None, :]
    fastest = np.abs(these.slip).max(axis=(0, 1))
    designs = []
    for disc in DISCS:
        total = push[..., disc] @ these.average
        designs.append([])
        for p in SLOPES / fastest[disc]:
            weighted = (push[..., disc] / (1 + p * np.abs(these.slip[..., disc]))) @ these.average
            designs[disc].append((p, these.whitened(np.stack([weighted, total - weighted], axis=1))))
    target = these.whitened(these.measured)
    best: tuple[float, list[tuple[float, float, float]]] = (np.inf, [])
    for p0, first in designs[0]:
        for p1, second in designs[1]:
            matrix = np.hstack([first, second])
            q = np.linalg.lstsq(matrix, target, rcond=None)[0]
            misfit = float(np.sum((matrix @ q - target) ** 2))
            # a law that is negative somewhere is no start, however well it fits
            if misfit < best[0] and np.all(q > 0):
                best = (misfit, [(q[0], q[1], p0), (q[2], q[3], p1)])
    if not best[1]:
        best = (float(target @ target), [(0.5, 0.3, 1 / fastest[disc]) for disc in DISCS])
    return best


def segments_at(ready: Pool, law: JointLaw, q: np.ndarray) -> Pool:
    """The pool with the slip segments of the disc that touches by a law with parameters q (m,). StickslipError: one of
    the discs is not touched in any log."""
    period = ready.natural_period
    segments: list[SlipSegment] = []
    seen: set[str] = set()
    for motion in ready.motions:
        contacts = motion.log.contacts
        touches = touching(law, contacts, q, motion.smoothed(SPEED_WINDOW * period, SPEED_ORDER), GUARD)
        seen |= {contact for contact, row in zip(contacts, touches, strict=True) if row.mean() > SELDOM}
        segments += slip_segments(motion, period, threshold=ready.threshold, allow_no_stick=True, touching=touches)
    missing = sorted(set(ready.contacts) - seen)
    if missing:
        raise StickslipError(
            f"In none of the logs the disc comes to touch {missing[0]} ({law.changeover} = {q[-1]:.4g} rad), so that "
            "its friction cannot be known. Let the swing pass the changeover (other drive speeds), or fit the other "
            f'alone: "contacts": ["{min(set(ready.contacts) - set(missing))}"].'
        )
    return replace(ready, segments=tuple(segments))


@dataclass(frozen=True, eq=False)
class JointProblem(RegressionProblem):
    """A joint regression, begun at a guess (m,)."""

    guess: np.ndarray = field(default_factory=lambda: np.zeros(0))
    residual_unit = "N"

    def start(self) -> np.ndarray:
        """The point of the scan with the least misfit."""
        return self.guess

    def rows(self, x: np.ndarray) -> FrictionRows:
        """Friction of each disc, that of the other taken off."""
        assert isinstance(self.regression, JointRegression) and isinstance(self.law, JointLaw)
        return self.regression.rows(self.law, x)


def estimate(ready: Pool, law: JointLaw, options: Options) -> tuple[JointProblem, Solution]:
    """Friction laws of two discs, and the changeover, from pooled logs. StickslipError: no slip segment holds a window,
    or one disc is touched nowhere."""
    problem = _problem(ready, law)
    _check_apart(problem.regression)
    problem = replace(problem, guess=options.given.start(problem))
    solution = _solved(problem, COARSE, options)
    if law.changeover is None:
        return problem, _solved(problem, TOLERANCE, options, solution)
    # twice: the windows follow the changeover, which moves a little with them
    for _ in range(2):
        problem = _problem(segments_at(ready, law, solution.values), law, solution.values)
        solution = _solved(problem, TOLERANCE, options, solution)
    return problem, solution


def _check_apart(these: Regression) -> None:
    """Where both discs touch and drag the body the same way, N_0 mu_0 + a and N_1 mu_1 - a are the same force for any
    a, in slip as in stick."""
    assert isinstance(these, JointRegression)
    shared = (these.force > 0).all(axis=1) & these.always
    against = (these.slip[shared, :, 0] * these.slip[shared, :, 1] < 0).any() if shared.any() else True
    if not against and shared.all():
        raise StickslipError(
            "In every log both discs drag the body the same way. A constant friction may then belong to either disc: "
            "only N0 mu0 + N1 mu1 shows, in slip and in stick. Add a log in which the discs turn against one another "
            "(drive speeds of opposite sign), or one of a disc alone."
        )


def _solved(problem: JointProblem, tolerance: float, options: Options, last: Solution | None = None) -> Solution:
    fixed = options.given.fixed(problem)
    x = options.given.put(problem.law.names, problem.start() if last is None else last.values)
    rows = problem.rows(x)
    bends = bends_of(problem.law, ("disc0", "disc1"), x, rows.speed, rows.disc)
    return solve_straight(replace(problem, guess=x), bends, fixed=fixed, progress=options.progress, tolerance=tolerance)


def joint_rows(ready: Pool, law: JointLaw, q: np.ndarray) -> FrictionRows:
    """Friction of each disc in the windows of the weak form, under a law with parameters q (m,), whoever found it."""
    segments = long_enough(segments_at(ready, law, q).segments, WINDOW * ready.natural_period)
    logs = [ready.log_number(segment) for segment in segments]
    return joint_equations(segments, logs, ready.values, ready.natural_period).rows(law, q)


def _problem(ready: Pool, law: JointLaw, guess: np.ndarray | None = None) -> JointProblem:
    period = ready.natural_period

    def build(moved: Mapping[str, float]) -> JointRegression:
        return joint_equations(*ready.moved(moved, WINDOW * period), period)

    these = build({})
    guess = first_guess(these, law) if guess is None else guess
    return JointProblem(law, these, ready.priors, build, drawn=ready.drawn, zero=loose(ready), guess=guess)
