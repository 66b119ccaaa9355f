"""Friction over slip speed without any law, with bands that hold.

The slips of all logs are followed by a spline of the slip speed (`spline`), each with a start of its own and with
torques that no term explains (`slips`), normal with deviation tau in units of the friction coefficient. The search
goes by steps of Gauss and Newton from a law's solution; tau has the greatest marginal likelihood among `TAUS`,

    -2 ln L = min(sum of squares, with all that is assumed beforehand) + sum of slips ln det(K)/det(D) + ln det H,

K = L'L + D of what is a slip's own, D its precision beforehand, H what is left for all that is shared. A band of one
speed is 1.96 deviations; the simultaneous one holds the whole curve, by draws from the normal distribution of its
coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.estimators.base import Estimate
from identification.estimators.shooting_segments import ShootingProblem
from identification.free_friction.result import FreeFriction
from identification.free_friction.slips import MODES, STARTS, Guess, Rows, Slips
from identification.free_friction.spline import COEFFICIENTS, SCALE, SpeedSpline
from identification.inference.problem import Prior
from identification.measurement.motion import SMOOTHING
from identification.measurement.pooled import Pool
from identification.measurement.slip_segments import SlipSegment

TAUS = (1e-9, 2e-4, 1e-3, 5e-3, 0.03)  # in units of the friction coefficient; the least is none
EXPLAINED = 5.0  # by which ln L must be greater with a torque that no term explains
STEPS, CUTS, LITTLE = 10, 6, 0.02  # of a search: most steps, most cuts of one, gain of the sum of squares that ends it
EXACT = 1e-9  # relative deviation of a constant that is stated as exact, or of which nobody says
LOOSE = 1e-3  # precision of the curve's level and slope beforehand
POINTS, DRAWS, SEED = 61, 2000, 0
LEVEL = 0.95  # of the band of the whole curve


def free_friction(problem: ShootingProblem, x: np.ndarray) -> FreeFriction | None:
    """The curve of one driving disc on the slips of a fit by shooting; None where they cannot tell it.

    They cannot of two discs, in both directions, by an encoder alone, with drives whose speed was not recorded, or with
    a sensor whose noise is not known.

    Args:
        problem: the slips, and the disturbances that are estimated beside the curve.
        x: (m,) where a law was found: the search begins there, and no trace of the law is left in the curve.

    Raises:
        StickslipError: as in `ShootingProblem.run`.
    """
    ready, law = problem.ready, problem.law
    if len(ready.contacts) != 1 or not ready.seen_well or ready.slips_both_ways or not problem.noise_known:
        return None
    speeds = np.concatenate([_slip_speeds(ready, segment) for segment in ready.segments])
    names = (*(prior.name for prior in ready.priors), "gain", "delay", *(term.name for term in problem.terms))
    slips = Slips(ready, problem.segments, SpeedSpline(float(speeds.max())), problem.terms, names)
    grid, count = np.linspace(0.0, slips.spline.greatest, 4 * POINTS), len(law.parameters)
    guess = Guess(
        np.linalg.lstsq(slips.spline.basis(grid), law.value(grid, x[:count]), rcond=None)[0],
        np.array([start.at(x) for start in problem.starts]),
        np.zeros((len(problem.segments), MODES)),
        {term.name: float(value) for term, value in zip(problem.terms, x[count:], strict=False)},
    )
    prior = _Prior.of(slips)
    guess = _searched(slips, prior, guess, TAUS[-1])
    tau = _likeliest(slips, prior, guess)
    for width in [width for width in reversed(TAUS[:-1]) if tau <= width]:
        guess = _searched(slips, prior, guess, width)
    return _curve(slips, prior, guess, tau)


def free_explains(estimate: Estimate) -> bool:
    """Whether friction that is free of any law leaves nothing but noise of the slips of an estimate by shooting, with
    the constants as they are stated: then only the form of its law can be wrong."""
    if not isinstance(estimate.problem, ShootingProblem):
        return False
    try:
        curve = free_friction(estimate.problem, estimate.solution.values)
    except StickslipError:
        return False
    return curve is not None and curve.explains


def _slip_speeds(ready: Pool, segment: SlipSegment) -> np.ndarray:
    """Of the samples of a slip, m/s."""
    slip = segment.motion.slip(ready.values.r, ready.values.R, SMOOTHING * ready.natural_period)
    return np.abs(slip[0, segment.first : segment.last])


@dataclass(frozen=True, eq=False)
class _Prior:
    """What is known beforehand of what slips share. mean (m,), precision (m, m)."""

    mean: np.ndarray
    precision: np.ndarray

    @classmethod
    def of(cls, slips: Slips) -> _Prior:
        """Of spline, constants (relative), sensors and terms."""
        size = COEFFICIENTS + len(slips.names)
        mean, precision = np.zeros(size), np.zeros((size, size))
        precision[:COEFFICIENTS, :COEFFICIENTS] = slips.spline.stiffness + LOOSE * np.eye(COEFFICIENTS)
        stated = {prior.name: prior for prior in slips.ready.priors}
        instruments = dict(zip(("gain", "delay"), np.sqrt(np.diag(slips.ready.sensors.covariance)), strict=True))
        terms = {term.name: term.prior for term in slips.terms}
        for place, name in enumerate(slips.names, COEFFICIENTS):
            if name in stated:
                deviation = _relative(stated[name])
            elif name in instruments:
                deviation = max(float(instruments[name]), EXACT)
            else:
                known = terms[name]
                mean[place], deviation = (known.value, known.standard_uncertainty) if known else (0.0, 1.0)
            precision[place, place] = deviation**-2
        return cls(mean, precision)


def _relative(prior: Prior) -> float:
    return max(prior.standard_uncertainty / prior.value, EXACT) if prior.stated else EXACT


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations where what is a slip's own is eliminated. hessian (m, m), gradient (m,) with what is known
    beforehand; step (m,) and steps of slips (n_slips, STARTS + MODES) to the least sum; likelihood: ln L there."""

    hessian: np.ndarray
    step: np.ndarray
    local: np.ndarray
    likelihood: float


def _normal(slips: Slips, rows: Sequence[Rows], prior: _Prior, guess: Guess, tau: float) -> _Normal:
    own = np.array([row.local.T @ row.local for row in rows])
    across = np.array([row.local.T @ row.shared for row in rows])
    down = np.array([row.local.T @ row.residual for row in rows])
    whole = sum(row.shared.T @ row.shared for row in rows)
    slope = sum(row.shared.T @ row.residual for row in rows)
    squares = sum(float(row.residual @ row.residual) for row in rows)
    precision = np.concatenate([np.full(STARTS, EXACT), np.full(MODES, tau**-2)])
    down[:, STARTS:] += guess.unexplained / tau**2
    kernel = own + np.diag(precision)
    solved = np.linalg.solve(kernel, np.concatenate([across, down[..., None]], axis=-1))
    values = guess.values(slips.names) - prior.mean
    hessian = whole - np.einsum("nij,nik->jk", across, solved[..., :-1]) + prior.precision
    gradient = slope - np.einsum("nij,ni->j", across, solved[..., -1]) + prior.precision @ values
    scale = np.sqrt(np.diag(hessian))
    step = -np.linalg.solve(hessian / np.outer(scale, scale), gradient / scale) / scale
    least = (
        squares
        + float(np.sum(guess.unexplained**2)) / tau**2
        - float(np.einsum("ni,ni->", down, solved[..., -1]))
        + values @ prior.precision @ values
        + gradient @ step
    )
    volume = float(np.sum(np.linalg.slogdet(kernel)[1])) - len(rows) * float(np.sum(np.log(precision)))
    volume += float(np.linalg.slogdet(hessian)[1])
    return _Normal(hessian, step, -(solved[..., :-1] @ step + solved[..., -1]), -0.5 * (least + volume))


def _searched(slips: Slips, prior: _Prior, guess: Guess, tau: float) -> Guess:
    """Steps of Gauss and Newton, each cut to a third while it makes the sum of squares greater."""

    def total(guess: Guess) -> float:
        off = guess.values(slips.names) - prior.mean
        within = slips.squares(guess) + float(np.sum(guess.unexplained**2)) / tau**2
        return within + float(off @ prior.precision @ off)

    before = total(guess)
    for _ in range(STEPS):
        normal = _normal(slips, slips.rows(guess), prior, guess, tau)
        for cut in range(CUTS):
            share = 3.0**-cut
            other = guess.moved(share * normal.step, share * normal.local, slips.names)
            after = total(other)
            if after < before:
                break
        else:
            return guess
        guess, gained, before = other, before - after, after
        if gained < LITTLE:
            return guess
    return guess


def _likeliest(slips: Slips, prior: _Prior, guess: Guess) -> float:
    """The tau of greatest likelihood, the least where none is likelier by much."""
    rows = slips.rows(guess)
    likelihood = [_normal(slips, rows, prior, guess, tau).likelihood for tau in TAUS]
    best = int(np.argmax(likelihood))
    return TAUS[best] if likelihood[best] > likelihood[0] + EXPLAINED else TAUS[0]


def _curve(slips: Slips, prior: _Prior, guess: Guess, tau: float) -> FreeFriction:
    rows = slips.rows(guess)
    hessian = _normal(slips, rows, prior, guess, tau).hessian
    constants = {one.name for one in slips.ready.priors}
    form = [*range(COEFFICIENTS), *(n for n, name in enumerate(slips.names, COEFFICIENTS) if name not in constants)]
    speed = SCALE * np.sinh(np.linspace(0.0, np.arcsinh(slips.spline.greatest / SCALE), POINTS))
    basis = slips.spline.basis(speed)
    inside = slice(None, COEFFICIENTS)
    alone = np.linalg.inv(hessian[np.ix_(form, form)])[inside, inside]
    known = np.linalg.inv(hessian)[inside, inside]
    form_deviation, deviation = (np.sqrt(np.einsum("ij,jk,ik->i", basis, c, basis)) for c in (alone, known))
    draws = np.random.default_rng(SEED).multivariate_normal(np.zeros(COEFFICIENTS), alone, DRAWS)
    least = slips.least(guess)
    seen = speed >= least
    furthest = np.max(np.abs(draws @ basis[seen].T) / form_deviation[seen], axis=1)
    count = sum(len(row.residual) for row in rows)
    return FreeFriction(
        tuple(speed.tolist()),
        tuple((basis @ guess.coefficients).tolist()),
        tuple(form_deviation.tolist()),
        tuple(deviation.tolist()),
        float(np.quantile(furthest, LEVEL)),
        least,
        0.0 if tau == TAUS[0] else tau,
        sum(float(row.residual @ row.residual) for row in rows) / count,
    )
