"""Base parameters of a machine from logs of efforts and positions.

    least squares   theta = (Y'Y)^-1 Y'tau            rows of each joint over the deviation of its residuals
    instruments     theta = (Z'Y)^-1 Z'tau            Z = Y on simulated motion, free of the sensors' noise

Noise in positions makes the columns of Y noisy, and least squares too small, the more the higher the cutoff; the
instruments keep the bias out. Z is simulated with the values of the round before, held near the log by a slow observer;
the first round takes least squares at a low cutoff, which filters what drives the simulation too. What is no linear
function of the velocity keeps a bias by noise, sgn v most of all: columns of friction of Y too are those of the motion
after the low cutoff. A prefilter takes off what the noise of accelerations would make friction scatter by. A deviation
is the larger of Newey-West's and that of a jackknife over logs.

Sources: Janot, Vandanjon, Gautier (2014), IEEE Trans. Control Syst. Technol. 22, 132 (IDIM-IV); Brunot, Janot, Young,
Carrillo (2018), Control Eng. Practice 74, 155.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference import lmfit_exchange
from identification.inference.lmfit_exchange import NOTHING, Given
from identification.inference.problem import Solution, among, solve
from identification.inference.uncertainty import clustered_covariance, newey_west, plain_covariance
from identification.machines.motion import Cutoffs, JointMotion, MachineLog, motions, stacked
from identification.machines.prefilter import Band, prefilter
from identification.machines.problem import machine_problem
from identification.machines.regressor import Base, Regressor
from identification.machines.rows import Rows, balanced, check_excited, loaded, rows_of
from identification.machines.simulated import Stretches, run

OBSERVER = 1.5  # Hz: slow beside the sensors' noise, fast beside how far a model is off
ROUNDS = 6
SAME = 0.05  # standard deviations by which values move between rounds that have converged
LOW = 3.0  # times the usual frequency of the motion: cutoff of the first values
SHARE = 0.95  # of the velocities' power, below the usual frequency
NOISY = (0.3, 0.6)  # of the rows' cutoff: where positions show their noise
HOLD = 2.0  # periods of the observer that a simulated stretch is used for, after one to settle
FINE = 40.0  # steps of a simulation per period of the cutoff of what drives it
METHODS = ("instruments", "least squares")


@dataclass(frozen=True, eq=False)
class Estimated:
    """Values (b,) with their covariance (b, b) by Newey-West, that of white residuals, and, of two logs or more, that
    of a jackknife over logs; at_bound, held: names of parameters that ended on a bound, or were held."""

    method: str
    values: np.ndarray
    covariance: np.ndarray
    white: np.ndarray
    jackknife: np.ndarray | None
    rounds: int = 0
    at_bound: tuple[str, ...] = ()
    held: tuple[str, ...] = ()

    @property
    def deviation(self) -> np.ndarray:
        """Deviations (b,): the larger of Newey-West's and the jackknife's."""
        deviation = np.sqrt(np.diag(self.covariance))
        return deviation if self.jackknife is None else np.maximum(deviation, np.sqrt(np.diag(self.jackknife)))


@dataclass(frozen=True, eq=False)
class Identified:
    """Both estimates of the same rows, what is behind them, and limits set to the parameters. instruments: None if
    they were not asked for; solved: the rows that they were found from, and the columns (rows, b) that stand for Z;
    low: Hz, a cutoff that passes the motion, 0 of least squares alone."""

    regressor: Regressor
    base: Base
    pieces: list[JointMotion]
    rows: Rows
    least_squares: Estimated
    limits: Given = NOTHING
    instruments: Estimated | None = None
    solved: tuple[Rows, np.ndarray] | None = None
    low: float = 0.0

    @property
    def best(self) -> Estimated:
        """The estimate of the method that was asked for."""
        return self.instruments or self.least_squares

    def from_rows(self, chosen: np.ndarray) -> np.ndarray:
        """Values (b,) from some of the rows (rows,)."""
        if self.solved is None:
            return _solved(self.rows.where(chosen), self.limits).values
        rows, columns = self.solved
        return _by_instruments(rows.where(chosen), columns[chosen])

    def lmfit(self) -> lmfit_exchange.Solved:
        """The solution for lmfit, with the stated deviations. StickslipError: the values are not those of least
        squares."""
        if self.instruments is not None:
            raise StickslipError("lmfit minimises squares: ask for method='least squares'.")
        squares = self.least_squares
        smaller = np.sqrt(np.diag(squares.covariance))
        wider = np.divide(squares.deviation, smaller, out=np.ones_like(smaller), where=smaller > 0)
        solution = _solved(self.rows, self.limits)
        problem = replace(machine_problem(self.rows), unknowns=self.limits.bounded(self.rows.unknowns))
        return lmfit_exchange.Solved(problem, solution, squares.covariance * np.outer(wider, wider))


def solve_machine(
    regressor: Regressor,
    base: Base,
    logs: Sequence[MachineLog],
    cutoffs: Cutoffs | None,
    *,
    method: str = METHODS[0],
    limits: Given = NOTHING,
    progress: Callable[[float], None] | None = None,
) -> Identified:
    """Estimate by instruments and least squares, or by least squares alone. cutoffs: None if the recipe filters.
    StickslipError: as in `motions`; the logs do not tell the base parameters apart; instruments are asked for without
    cutoffs or with bounds; or simulated motion leaves the logs with every round."""
    on_progress = progress if progress is not None else lambda _: None
    pieces = motions(logs, regressor.joints, cutoffs)
    rows = balanced(rows_of(regressor, base, pieces))
    limits.check(rows.names)
    check_excited(rows, ", ".join(log.name for log in logs))
    squares = least_squares(rows, limits)
    on_progress(0.2)
    if method != METHODS[0]:
        return Identified(regressor, base, pieces, rows, squares, limits)
    if cutoffs is None or limits != NOTHING:
        raise StickslipError(
            "Instruments need a cutoff and have no bounds: give a cutoff, take parameters as known, or ask for "
            "method='least squares'."
        )
    band = _band(pieces, cutoffs.parallel)
    low = LOW * band.motion
    slow = Cutoffs(min(low, cutoffs.kinematic), min(low, cutoffs.parallel))
    slowly = motions(logs, regressor.joints, slow)
    if len(slowly) < len(pieces):
        # between gaps there are pieces too short for the low cutoff
        starts = [(piece.log, piece.time[0]) for piece in slowly]
        pieces = [piece for piece in pieces if (piece.log, piece.time[0]) in starts]
        rows = balanced(rows_of(regressor, base, pieces))
        squares = least_squares(rows)
    first = least_squares(balanced(rows_of(regressor, base, slowly))).values
    setup = _Setup(regressor, base, pieces, slowly, slow.parallel, band)
    slow_friction = _with_slow_friction(setup, rows)
    best, columns = _instrumented(setup, slow_friction, first, lambda done: on_progress(0.2 + 0.8 * done))
    return Identified(
        regressor, base, pieces, rows, squares, instruments=best, solved=(slow_friction, columns), low=low
    )


def least_squares(rows: Rows, limits: Given = NOTHING) -> Estimated:
    """Weighted least squares, with deviations that allow for coloured residuals. limits: bounds and held parameters."""
    solution = _solved(rows, limits)
    free = np.array([name not in solution.fixed for name in rows.names], dtype=bool)
    columns, effort = rows.weighted
    at_bound = tuple(name for name, at in zip(rows.names, solution.at_bound, strict=True) if at)
    residual = effort - columns @ solution.values
    judged = _judged(METHODS[1], rows, solution.values, columns[:, free], residual, free)
    return replace(judged, at_bound=at_bound, held=solution.fixed)


def _solved(rows: Rows, limits: Given) -> Solution:
    problem = machine_problem(rows)
    if limits == NOTHING:
        values = problem.start()
        return Solution(values, problem.evaluate(values), True, "", (False,) * len(values))
    problem = replace(problem, unknowns=limits.bounded(rows.unknowns))
    return solve(problem, limits.start(problem), fixed=limits.fixed(problem))


def _by_instruments(rows: Rows, instruments: np.ndarray) -> np.ndarray:
    y, tau = rows.weighted
    z, sizes = instruments * rows.weight[:, None], np.linalg.norm(y, axis=0)
    return np.linalg.solve((z / sizes).T @ (y / sizes), (z / sizes).T @ tau) / sizes


def _estimated(rows: Rows, instruments: np.ndarray) -> Estimated:
    y, tau = rows.weighted
    z, sizes = instruments * rows.weight[:, None], np.linalg.norm(y, axis=0)
    to_values = np.linalg.solve((z / sizes).T @ (y / sizes), (z / sizes).T)  # (b, rows)
    values = (to_values @ tau) / sizes
    # the rows that least squares would have with these same values
    gradient = np.linalg.solve(to_values @ to_values.T, to_values).T * sizes
    return _judged(METHODS[0], rows, values, gradient, tau - y @ values, np.ones(len(sizes), dtype=bool))


def _judged(
    method: str, rows: Rows, values: np.ndarray, gradient: np.ndarray, residual: np.ndarray, free: np.ndarray
) -> Estimated:
    """Values (b,) with their covariances, 0 where they were not free. gradient: (rows, free); residual: (rows,)."""
    # in units of their own
    sizes = np.linalg.norm(gradient, axis=0)
    scaled, scale = gradient / sizes, np.outer(1 / sizes, 1 / sizes)
    many = len(np.unique(rows.log)) > 1
    return Estimated(
        method,
        values,
        among(newey_west(scaled, residual, log=rows.series) * scale, free),
        among(plain_covariance(scaled, residual) * scale, free),
        among(clustered_covariance(scaled, residual, rows.log) * scale, free) if many else None,
    )


@dataclass(frozen=True, eq=False)
class _Setup:
    """What instruments are made of. slow: the same pieces after a low cutoff (Hz), which drive the simulation: noise of
    efforts and positions above it must not come back; band: of the rows."""

    regressor: Regressor
    base: Base
    pieces: Sequence[JointMotion]
    slow: Sequence[JointMotion]
    cutoff: float
    band: Band


def _instrumented(
    setup: _Setup, rows: Rows, first: np.ndarray, progress: Callable[[float], None]
) -> tuple[Estimated, np.ndarray]:
    values, estimate, columns = first, None, rows.columns
    for number in range(ROUNDS):
        simulated = instruments(setup, values)
        if simulated is None:
            break
        estimate, columns = _prefiltered(rows, simulated, values, setup.band)
        estimate = replace(estimate, rounds=number + 1)
        moved = np.max(np.abs(estimate.values - values) / estimate.deviation)
        values = estimate.values
        progress((number + 1) / ROUNDS)
        if moved < SAME:
            break
    if estimate is None:
        raise StickslipError(
            "With the values that least squares gives the simulated machine leaves the logs: there are no instruments. "
            "Lower the cutoff, check signs and units of efforts and positions, or ask for least squares."
        )
    return estimate, columns


def _with_slow_friction(setup: _Setup, rows: Rows) -> Rows:
    """With columns of friction of the slow pieces: the mean of sgn(v + noise) is not sgn v, and instruments keep out
    additive noise alone."""
    frictional = np.array([parameter.frictional for parameter in setup.base.parameters])
    slowly = {
        id(piece): loaded(
            setup.regressor(slow.position, slow.velocity, slow.acceleration)[:, :, setup.base.places], setup.base, piece
        )
        for piece, slow in zip(setup.pieces, setup.slow, strict=True)
    }
    columns = stacked(setup.pieces, lambda piece: slowly[id(piece)])
    return replace(rows, columns=np.where(frictional, columns, rows.columns))


def _prefiltered(rows: Rows, instruments: np.ndarray, values: np.ndarray, band: Band) -> tuple[Estimated, np.ndarray]:
    """The estimate after the prefilter of the residuals that values (b,) leave; the columns (rows, b) that give the
    same one as instruments of rows without it."""
    # what weighs nothing is left out on both sides of the equation before a filter spreads it
    used = rows.used
    residual = rows.residual(values) * used
    calm = prefilter(residual, rows.series, rows.joint, band)
    settled, filtered = calm.settled, calm(residual)
    joints = range(len(rows.deviation))
    deviation = np.array([np.std(filtered[settled & used & (rows.joint == joint)]) for joint in joints])
    signals = {name: calm((getattr(rows, name).T * used).T) for name in ("columns", "given", "effort")}
    smooth = replace(rows, **signals, deviation=deviation, trust=np.where(used, rows.trust, 1.0))
    inside = calm((instruments.T * used).T) * settled[:, None]
    return (
        _estimated(smooth.where(settled), inside[settled]),
        calm.transposed(inside) * (rows.deviation / deviation)[rows.joint, None] ** 2,
    )


def instruments(setup: _Setup, values: np.ndarray) -> np.ndarray | None:
    """Instrument columns (rows, b), from simulated motion; None where that is not finite."""
    regressor, base, pieces = setup.regressor, setup.base, setup.pieces
    try:
        runs = follow(regressor, base.whole(values), setup.slow, setup.cutoff)
    except np.linalg.LinAlgError:
        return None
    if not all(np.all(np.isfinite(signal)) for motion in runs for signal in motion):
        return None
    simulated = {id(piece): regressor(*motion)[:, :, base.places] for piece, motion in zip(pieces, runs, strict=True)}
    return stacked(pieces, lambda piece: loaded(simulated[id(piece)], base, piece))


def follow(
    regressor: Regressor, values: np.ndarray, pieces: Sequence[JointMotion], cutoff: float
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Position, velocity, acceleration (n, joints) of every piece, simulated in stretches that overlap, at steps that
    the cutoff (Hz) of the pieces allows."""
    stride = max(int(1 / (FINE * cutoff * pieces[0].step)), 1)
    step = stride * pieces[0].step
    grids = [np.arange(piece.time[0], piece.time[-1] + step, step) for piece in pieces]
    settle = int(1 / (OBSERVER * step))
    used = int(HOLD * settle)
    starts = [(number, at) for number, grid in enumerate(grids) for at in range(0, len(grid), used)]
    reach = np.arange(-settle, used)
    rows = [np.clip(at + reach, 0, len(grids[number]) - 1) for number, at in starts]

    def taken(of: Callable[[JointMotion], np.ndarray]) -> np.ndarray:
        signals = [_between(grid, piece.time, of(piece)) for grid, piece in zip(grids, pieces, strict=True)]
        return np.stack([signals[number][at] for (number, _), at in zip(starts, rows, strict=True)])

    stretches = Stretches(
        step,
        taken(lambda piece: piece.position),
        taken(lambda piece: piece.velocity),
        taken(lambda piece: piece.smooth(piece.effort)),
    )
    with np.errstate(over="ignore", invalid="ignore"):
        motion = run(regressor, values, stretches, OBSERVER)
    paths = []
    for number, (grid, piece) in enumerate(zip(grids, pieces, strict=True)):
        mine = [i for i, (owner, _) in enumerate(starts) if owner == number]
        joined = [values[mine, settle:].reshape(-1, values.shape[-1])[: len(grid)] for values in motion]
        q, v, a = (_between(piece.time, grid, values) for values in joined)
        paths.append((q, v, a))
    return paths


def _between(at: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, joints) at other times (k,): (k, joints)."""
    return np.stack([np.interp(at, time, column) for column in values.T], axis=1)


def _band(pieces: Sequence[JointMotion], cutoff: float) -> Band:
    """Of rows after a low-pass at ``cutoff`` (Hz). The motion ends where nearly all power of the velocities lies below,
    of the joint that moves fastest; white noise of positions, whose power rises there by the square of the frequency,
    is taken off."""
    from scipy.signal import periodogram

    step = float(np.diff(pieces[0].time[pieces[0].indices[:2]])[0])
    spectra = [periodogram(piece.thinned(piece.velocity), 1 / step, window="hann", axis=0) for piece in pieces]
    frequency = np.concatenate([grid for grid, _ in spectra])
    power = np.concatenate([density * len(piece.indices) for piece, (_, density) in zip(pieces, spectra, strict=True)])
    order = np.argsort(frequency)
    order = order[frequency[order] < NOISY[1] * cutoff]
    frequency, power = frequency[order], power[order]
    noisy = frequency > NOISY[0] * cutoff
    noise = np.median(power[noisy] / frequency[noisy, None] ** 2, axis=0) / np.log(2)  # mean of an exponential
    below = np.cumsum(power - noise * frequency[:, None] ** 2, axis=0)
    ends = frequency[np.argmax(below >= SHARE * below[-1], axis=0)]
    return Band(step, float(np.max(ends)), cutoff)
