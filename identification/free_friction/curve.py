"""Friction over slip speed without any law, with bands that hold.

The slips of all logs are followed by a curve of the slip speed (`SpeedBasis`), each with a start of its own and with
torques that no term explains (`slips`), normal with deviation tau in units of the friction coefficient. The search
goes by steps of Gauss and Newton from friction by inverse dynamics; tau has the greatest marginal likelihood among
`TAUS`,

    -2 ln L = min(sum of squares, with all that is assumed beforehand) + sum of slips ln det(K)/det(D) + ln det H,

K = L'L + D of what is a slip's own, D its precision beforehand, H what is left for all that is shared. A band of one
speed is 1.96 deviations; the simultaneous one holds the whole curve, by draws from the normal distribution of its
coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.disturbances.terms import terms_of
from identification.estimators.savitzky_golay import friction_samples
from identification.estimators.segment_runs import ShootingSegment
from identification.estimators.shooting_segments import LINE
from identification.free_friction.at_rest import Releases
from identification.free_friction.guess import AHEAD, MODES, STARTS, WRONG, YIELDS, Guess, SlipRows
from identification.free_friction.responses import rows_of
from identification.free_friction.result import BENDS, COEFFICIENTS, FreeFriction, SpeedBasis
from identification.free_friction.slips import Slips
from identification.inference.problem import Prior
from identification.measurement.motion import SMOOTHING
from identification.measurement.pooled import SPEED, Pool
from identification.measurement.presliding import SOFT, presliding

TAUS = (1e-9, 2e-4, 1e-3, 5e-3, 0.03)  # in units of the friction coefficient; the least is none
LOUDER = (100.0, 10.0, 1.0)  # times the noise, in a search from far off
BETWEEN = 1e-3  # on the way to the likeliest one
LOST = 2.0  # times the squares with the widest torque, that slips have which are not followed
EXPLAINED = 5.0  # by which ln L must be greater with a torque that no term explains
STEPS = 10  # of a search, at most
DAMPED = (0.0, 1e-4, 1e-3, 0.01, 0.1, 1.0, 10.0)  # a step of it, until it gains
LITTLE = 2e-3  # gain of the sum of squares that is not worth a step: 4 % of a deviation
EXACT = 1e-9  # relative deviation of a constant that is stated as exact, or of which nobody says
SET = 0.01  # that of a drive's speed, which was set and not recorded
ROUGH = 0.02  # deviation of the force that sticks carried last, at first
ROUNDS, FARTHEST, NEAR = 2, 0.05, 5e-4  # with releases: slips followed anew; steps of a coefficient, most and last
ASTRAY = 3.0  # deviations of the row of releases, which then are not what the curve would have
LOOSE = 1e-3  # precision of the curve's level and slope beforehand
SOFTER = {YIELDS: 1.0, AHEAD: 5e-3}  # of a contact that gives way
OFF = {
    "J": 0.04,
    "k": 0.04,
    "k/J": 0.04,
    "c": 0.2,
    "c/J": 0.2,
    "R": 0.03,
    "r": 0.03,
    "gain": 0.01,
}  # of constants that are wrong
DRAWS, SEED = 2000, 0
LEVEL = 0.95  # of the band of the whole curve
SIGNED = 0.2  # share of the squares of unexplained torques from which on what goes with them is said


def slips_of(ready: Pool, segments: Sequence[ShootingSegment]) -> Slips:
    """Slips of one driving disc with the constants of the rig, the laser's gain and delay, and a load cell."""
    speeds, window = [], SMOOTHING * ready.natural_period
    for segment in ready.segments:
        slip = segment.motion.slip(ready.values.r, ready.values.R, window)
        speeds.append(np.abs(slip[0, segment.first : segment.last]))
    terms, elastic = terms_of(ready, ()), presliding(ready, np.inf)
    soft = elastic.compliance if elastic is not None and elastic.elastic and elastic.compliance > SOFT else 0.0
    counted = [segment.lines for segment in segments if segment.lines is not None]
    sensors = ("zero", *(f"{LINE}{line}" for line in np.unique(np.concatenate(counted)))) if counted else ()
    names = (*(prior.name for prior in ready.priors), "gain", "delay", *sensors, *(term.name for term in terms))
    return Slips(ready, tuple(segments), SpeedBasis(float(np.concatenate(speeds).max())), terms, names, soft)


def begun(slips: Slips) -> Guess:
    """A guess that follows the slips, from inverse dynamics and what the sensors show, with noise that is taken for
    larger at first. StickslipError: no slip holds a window of inverse dynamics."""
    samples = friction_samples(slips.ready)
    basis = slips.curve.weights(np.abs(samples.slip))
    straight = basis.T @ basis + BENDS.T @ BENDS
    guess = Guess(
        np.linalg.solve(straight, basis.T @ samples.coefficient),
        np.array([segment.guess for segment in slips.segments]),
        np.zeros((len(slips.segments), MODES)),
        {term.name: term.first for term in slips.terms},
    )
    known = Known.of(slips)
    for louder in LOUDER:
        guess = _searched(slips.with_noise(louder), known, guess, TAUS[-1])
    return guess


def settled(slips: Slips, guess: Guess, near: tuple[float, float] | None = None) -> tuple[Guess, float, float]:
    """The best guess, the tau of greatest likelihood, the least where none is likelier by much, and the sum of squares
    that slips have under the widest torque. near: tau and this sum, where the guess is near that of other columns.
    StickslipError: as in `ShootingProblem.run`."""
    known, widest = Known.of(slips), TAUS[-1]
    loose, followed = guess, 0.0
    if near is not None:
        loose, followed = _searched(slips, known, guess, near[0]), near[1]
    if near is None or not follows(slips, loose, followed):
        loose = _searched(slips, known, guess, widest)
        followed = slips.squares(loose)
    rows = rows_of(slips, loose)
    values = loose.values(slips.names)
    likelihood = [Gram.of(rows, loose, tau).least(known, values).likelihood for tau in TAUS]
    best = int(np.argmax(likelihood))
    first = best if likelihood[best] > likelihood[0] + EXPLAINED else 0
    guess, tau, halfway = loose, TAUS[first], None
    for tau in TAUS[first:]:
        if tau > BETWEEN:
            guess = _searched(slips, known, loose, tau)
        else:
            halfway = halfway or _searched(slips, known, loose, BETWEEN)
            guess = halfway if tau == BETWEEN else _searched(slips, known, halfway, tau)
        if follows(slips, guess, followed):  # else likely to first order only
            break
    return guess, tau, followed


def follows(slips: Slips, guess: Guess, squares: float) -> bool:
    """Whether a guess follows the slips about as well as one with these squares, or within their noise."""
    return slips.squares(guess) < LOST * max(squares, sum(len(segment.time) for segment in slips.segments))


@dataclass(frozen=True, eq=False)
class Known:
    """What is known beforehand of what slips share. mean (m,), precision (m, m); told (m,): ln L that is gained where
    a value need not be zero, by what others than the slips tell of it."""

    mean: np.ndarray
    precision: np.ndarray
    told: np.ndarray

    @classmethod
    def of(cls, slips: Slips) -> Known:
        """Of the curve, constants (relative), sensors and terms."""
        size = COEFFICIENTS + len(slips.names)
        mean, precision, told = np.zeros(size), np.zeros((size, size)), np.zeros(size)
        precision[:COEFFICIENTS, :COEFFICIENTS] = BENDS.T @ BENDS + LOOSE * np.eye(COEFFICIENTS)
        deviations = {prior.name: _relative(prior) for prior in slips.ready.priors}
        instruments = np.sqrt(np.diag(slips.ready.sensors.covariance))
        deviations |= dict(zip(("gain", "delay"), instruments.tolist(), strict=True))
        if slips.ready.zero is not None:
            deviations["zero"] = slips.ready.zero.standard_uncertainty
        deviations |= {name: slips.ready.sensors.rms for name in slips.names if name.startswith(LINE)}
        deviations |= SOFTER
        deviations |= {name + WRONG: deviation for name, deviation in OFF.items()}
        terms = {term.name: term for term in slips.terms}
        for index, name in enumerate(slips.names, COEFFICIENTS):
            if name in deviations:
                precision[index, index] = max(deviations[name], EXACT) ** -2
                continue
            prior, wide = terms[name].prior, terms[name].effect.width(terms[name].order) ** -2
            sure = 0.0 if prior is None else prior.standard_uncertainty**-2
            precision[index, index] = wide + sure
            if prior is not None:
                mean[index] = prior.value * sure / (wide + sure)
                told[index] = 0.5 * (np.log(wide / (wide + sure)) + mean[index] ** 2 * (wide + sure))
        return cls(mean, precision, told)

    def without(self, columns: np.ndarray, sure: float) -> Known:
        """With columns (k,) held at 0, to 1/``sure`` of what was known of them."""
        mean, precision, told = self.mean.copy(), self.precision.copy(), self.told.copy()
        mean[columns] = told[columns] = 0.0
        precision[columns, columns] *= sure**2
        return Known(mean, precision, told)


def _relative(prior: Prior) -> float:
    if not prior.stated:
        return SET if prior.name.startswith(SPEED) else EXACT
    return max(prior.standard_uncertainty / prior.value, EXACT)


@dataclass(frozen=True, eq=False)
class Least:
    """The least sum of squares to second order. hessian (m, m); step (m,) to it, and steps of slips (n_slips, STARTS +
    MODES); squares: the sum, and likelihood: ln L there; best: ln L of the values that are best, which is no less where
    these are many or could be anything."""

    hessian: np.ndarray
    step: np.ndarray
    local: np.ndarray
    squares: float
    likelihood: float
    best: float


@dataclass(frozen=True, eq=False)
class Gram:
    """Normal equations of what slips share, for one tau, where what is a slip's own is eliminated; nothing that is
    known of the shared is in them. matrix (m, m), slope (m,), squares and volume: of -2 ln L; solved (n_slips, STARTS +
    MODES, m + 1): how what is a slip's own follows."""

    matrix: np.ndarray
    slope: np.ndarray
    squares: float
    volume: float
    solved: np.ndarray

    @classmethod
    def of(cls, rows: Sequence[SlipRows], guess: Guess, tau: float) -> Gram:
        """Of the residuals at a guess."""
        local_gram = np.array([row.local.T @ row.local for row in rows])
        across = np.array([row.local.T @ row.shared for row in rows])
        down = np.array([row.local.T @ row.residual for row in rows])
        combined, slope = np.zeros(2 * across.shape[-1:]), sum(row.shared.T @ row.residual for row in rows)
        for row in rows:
            mine = np.flatnonzero(row.shared.any(axis=0))  # not those of other logs
            combined[np.ix_(mine, mine)] += row.shared[:, mine].T @ row.shared[:, mine]
        squares = sum(float(row.residual @ row.residual) for row in rows)
        precision = np.concatenate([np.full(STARTS, EXACT), np.full(MODES, tau**-2)])
        down[:, STARTS:] += guess.unexplained / tau**2
        kernel = local_gram + np.diag(precision)
        solved = np.linalg.solve(kernel, np.concatenate([across, down[..., None]], axis=-1))
        squares += float(np.sum(guess.unexplained**2)) / tau**2 - float(np.einsum("ni,ni->", down, solved[..., -1]))
        volume = float(np.sum(np.linalg.slogdet(kernel)[1])) - len(rows) * float(np.sum(np.log(precision)))
        matrix = combined - np.einsum("nij,nik->jk", across, solved[..., :-1])
        return cls(matrix, slope - np.einsum("nij,ni->j", across, solved[..., -1]), squares, volume, solved)

    def alike(self, rows: Sequence[SlipRows], tau: float) -> Gram:
        """Where as large a torque, the same in every slip, may act beside: for what is known of the shared alone."""
        local_gram = np.array([row.local.T @ row.local for row in rows])
        across = np.array([row.local.T @ row.shared for row in rows])
        precision = np.diag(np.concatenate([np.full(STARTS, EXACT), np.full(MODES, tau**-2)]))
        share = np.linalg.solve(local_gram + precision, precision)  # of a torque, once each slip has had its own
        beside = np.sum((local_gram @ share)[:, STARTS:, STARTS:], axis=0) + precision[STARTS:, STARTS:]
        with_shared = np.einsum("nji,njk->ik", share, across)[STARTS:]
        return replace(self, matrix=self.matrix - with_shared.T @ np.linalg.solve(beside, with_shared))

    def beside(self, slope: np.ndarray, residual: float) -> Gram:
        """With one more row, (m,) and its residual."""
        return replace(
            self,
            matrix=self.matrix + np.outer(slope, slope),
            slope=self.slope + slope * residual,
            squares=self.squares + residual**2,
        )

    def least(self, known: Known, values: np.ndarray, columns: np.ndarray | None = None, damped: float = 0.0) -> Least:
        """With what is known beforehand, at values (m,). columns: the only ones that may move; damped: by how much the
        step of each is shorter than if it alone moved, after Levenberg and Marquardt."""
        selected = np.arange(len(values)) if columns is None else columns
        off, precision = (values - known.mean)[selected], known.precision[np.ix_(selected, selected)]
        hessian = self.matrix[np.ix_(selected, selected)] + precision
        gradient = self.slope[selected] + precision @ off
        scale = np.sqrt(np.diag(hessian))
        scaled = hessian / np.outer(scale, scale)
        step = np.zeros(len(values))
        step[selected] = -np.linalg.solve(scaled + damped * np.eye(len(selected)), gradient / scale) / scale
        sum_of_squares = self.squares + off @ precision @ off + gradient @ step[selected]
        beside = selected[selected >= COEFFICIENTS]
        volume = float(np.linalg.slogdet(scaled)[1] + 2 * np.sum(np.log(scale)))
        volume -= float(np.sum(np.log(np.diag(known.precision)[beside])))
        local = -(self.solved[..., :-1] @ step + self.solved[..., -1])
        best = float(np.sum(known.told[selected]) - 0.5 * (sum_of_squares + self.volume))
        return Least(hessian, step, local, float(sum_of_squares), best - 0.5 * volume, best)


def _searched(slips: Slips, known: Known, guess: Guess, tau: float) -> Guess:
    """Steps of Gauss and Newton, damped while they make the sum of squares greater."""

    def total(guess: Guess) -> float:
        off = guess.values(slips.names) - known.mean
        within = slips.squares(guess) + float(np.sum(guess.unexplained**2)) / tau**2
        return within + float(off @ known.precision @ off)

    before, first = total(guess), 0
    for _ in range(STEPS):
        gram, values = Gram.of(rows_of(slips, guess), guess, tau), guess.values(slips.names)
        if not before - gram.least(known, values).squares > LITTLE:
            return guess
        for damped in DAMPED[first:]:
            best = gram.least(known, values, damped=damped)
            moved_guess = guess.moved(best.step, best.local, slips.names)
            after = total(moved_guess)
            if after < before:
                break
        else:
            return guess
        gained, guess, before, first = before - after, moved_guess, after, max(DAMPED.index(damped) - 1, 0)
        if gained < LITTLE:
            break
    return guess


def _at_rest(slips: Slips, guess: Guess, tau: float) -> tuple[Guess, Gram, int]:
    """The best guess with what releases of sticks say beside the slips, the normal equations there, and of how many
    sticks; as it was without any where they cannot be followed."""
    known, every = Known.of(slips), Releases.of(slips)
    plain = Gram.of(rows_of(slips, guess), guess, tau)
    if every is None:
        return guess, plain, 0
    off, unit = guess.coefficients[0] - every.rough(guess), np.eye(len(known.mean))[0]
    first = plain.beside(unit / ROUGH, off / ROUGH).least(known, guess.values(slips.names))
    near = guess.moved(first.step, first.local, slips.names)
    releases = every.begun(near)
    if releases is None:
        return guess, plain, 0
    farthest = np.inf
    for _ in range(ROUNDS):
        gram, values, step = Gram.of(rows_of(slips, near), near, tau), near.values(slips.names), np.zeros(len(unit))
        best = gram.least(known, values)
        for _ in range(STEPS):
            residual, slope = releases.row(near.moved(step, best.local, slips.names), tau, whole=False)
            best = gram.beside(slope, residual - float(slope @ step)).least(known, values)
            farthest = float(np.max(np.abs((best.step - step)[:COEFFICIENTS])))
            if not np.isfinite(farthest):  # sticks are not followed
                return guess, plain, 0
            step = step + min(1.0, FARTHEST / farthest) * (best.step - step)
            if farthest < NEAR:
                break
        near = near.moved(step, best.local, slips.names)
    residual, slope = releases.row(near, tau, whole=True)
    if not farthest < NEAR or abs(residual) > ASTRAY:
        return guess, plain, 0
    return near, Gram.of(rows_of(slips, near), near, tau).beside(slope, residual), len(releases.at)


def curve_of(slips: Slips, guess: Guess, tau: float) -> FreeFriction:
    """The curve of a guess that has settled, with its bands."""
    guess, gram, releases = _at_rest(slips, guess, tau)
    hessian = (
        gram.alike(rows_of(slips, guess), slips.torn(tau)).least(Known.of(slips), guess.values(slips.names)).hessian
    )
    constants = slips.constants(guess)
    form = [
        *range(COEFFICIENTS),
        *(n for n, name in enumerate(slips.names, COEFFICIENTS) if name.removesuffix(WRONG) not in constants),
    ]
    inside = slice(None, COEFFICIENTS)
    alone = np.linalg.inv(hessian[np.ix_(form, form)])[inside, inside]
    # of what logs do not tell rounding of large variances may be negative
    draws = np.random.default_rng(SEED).multivariate_normal(np.zeros(COEFFICIENTS), alone, DRAWS, check_valid="ignore")
    least, curve = float(np.min(slips.slip_speeds(guess))), slips.curve
    seen = curve.grid >= least
    furthest = np.max(np.abs(draws @ curve.weights(curve.grid[seen]).T) / curve.deviation(alone)[seen], axis=1)
    count = sum(len(segment.time) for segment in slips.segments)
    return FreeFriction(
        curve.greatest,
        tuple(guess.coefficients.tolist()),
        tuple(map(tuple, alone.tolist())),
        tuple(map(tuple, np.linalg.inv(hessian)[inside, inside].tolist())),
        float(np.quantile(furthest, LEVEL)),
        least,
        0.0 if tau == TAUS[0] else tau,
        slips.squares(guess) / count,
        *(((), ()) if tau == TAUS[0] else _signature(slips, guess)),
        releases=releases,
        constants=constants,
    )


def _signature(slips: Slips, guess: Guess) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """What goes with the torques that no term explains, and the share of their squares that does."""
    torques, slip = guess.unexplained, np.arange(len(slips.segments))
    phase, log = slips.where.turned[:, 0], slips.where.log[:, 0]
    every = {
        "is the same in every slip": np.ones((len(slip), 1)),
        "goes with the log (its speed, its load)": (log[:, None] == np.unique(log)).astype(float),
        "goes with time": np.stack([np.ones(len(slip)), slip, slips.where.share[:, 0]], axis=1),
        "goes with the angle of the drive": np.stack(
            [np.ones(len(slip)), np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)], axis=1
        ),
    }
    shares = {}
    for words, columns in every.items():
        residual = torques - columns @ np.linalg.lstsq(columns, torques, rcond=None)[0]
        spare = len(slip) / max(len(slip) - columns.shape[1], 1)
        shares[words] = 1 - spare * float(np.sum(residual**2) / np.sum(torques**2))
    signs = sorted((words for words in shares if shares[words] > SIGNED), key=lambda words: -shares[words])
    return tuple(signs), tuple(shares[words] for words in signs)
