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

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.uncertainty import clustered_covariance, newey_west
from identification.machines.base_parameters import Base
from identification.machines.motion import Cutoffs, MachineLog, Motion, labels, motions, stacked
from identification.machines.prefilter import prefilter
from identification.machines.regressor import Regressor
from identification.machines.simulated import Stretches, run

OBSERVER = 1.5  # Hz: slow beside the sensors' noise, fast beside how far a model is off
ROUNDS = 6
SAME = 0.05  # standard deviations by which values move between rounds that have converged
LOW = 3.0  # times the usual frequency of the motion: cutoff of the first values
SHARE = 0.95  # of the velocities' power, below the usual frequency
NOISY = (0.3, 0.6)  # of the rows' cutoff: where positions show their noise
WEIGHTS = 3  # rounds
HOLD = 2.0  # periods of the observer that a simulated stretch is used for, after one to settle
FINE = 40.0  # steps of a simulation per period of the cutoff of what drives it
INDISTINGUISHABLE = 1e8  # condition from which on base parameters are one
METHODS = ("instruments", "least squares")


@dataclass(frozen=True, eq=False)
class Rows:
    """A linear problem. columns: (rows, b) of the base parameters; effort: (rows,); series, joint, log: labels (rows,);
    deviation: (joints,) of the residuals."""

    columns: np.ndarray
    effort: np.ndarray
    series: np.ndarray
    joint: np.ndarray
    log: np.ndarray
    deviation: np.ndarray

    @property
    def weight(self) -> np.ndarray:
        """Of each row (rows,)."""
        return 1 / self.deviation[self.joint]

    def where(self, kept: np.ndarray) -> Rows:
        """Some of the rows (rows,)."""
        labels = (self.series[kept], self.joint[kept], self.log[kept])
        return Rows(self.columns[kept], self.effort[kept], *labels, self.deviation)

    def residual(self, values: np.ndarray) -> np.ndarray:
        """Measured less modelled effort (rows,)."""
        return self.effort - self.columns @ values


@dataclass(frozen=True, eq=False)
class Estimated:
    """Values (b,) with their covariance (b, b) by Newey-West and, of two logs or more, by a jackknife over logs."""

    method: str
    values: np.ndarray
    covariance: np.ndarray
    jackknife: np.ndarray | None
    rounds: int = 0

    @property
    def deviation(self) -> np.ndarray:
        """(b,), the larger of the two."""
        found = np.sqrt(np.diag(self.covariance))
        return found if self.jackknife is None else np.maximum(found, np.sqrt(np.diag(self.jackknife)))


@dataclass(frozen=True, eq=False)
class Solved:
    """Both estimates of the same rows (instruments None where they were not asked for), the pieces behind them, and the
    columns (rows, b) that stand for Z."""

    pieces: list[Motion]
    rows: Rows
    least_squares: Estimated
    instruments: Estimated | None
    columns: np.ndarray

    @property
    def best(self) -> Estimated:
        """That of the method that was asked for."""
        return self.instruments or self.least_squares

    def without(self, log: int) -> np.ndarray:
        """Values (b,) from the other logs."""
        kept = self.rows.log != log
        weight = self.rows.weight[kept, None]
        z, y = self.columns[kept] * weight, self.rows.columns[kept] * weight
        sizes = np.linalg.norm(y, axis=0)
        return (
            np.linalg.solve((z / sizes).T @ (y / sizes), (z / sizes).T @ (self.rows.effort[kept] * weight[:, 0]))
            / sizes
        )


def solve_machine(
    regressor: Regressor,
    base: Base,
    logs: Sequence[MachineLog],
    cutoffs: Cutoffs,
    *,
    method: str = METHODS[0],
    progress: Callable[[float], None] | None = None,
) -> Solved:
    """Both estimates, or least squares alone.

    Raises:
        StickslipError: as in `motions`; the logs do not tell the base parameters apart; or simulated motion leaves the
            logs with every round.
    """
    told = progress if progress is not None else lambda _: None
    pieces = motions(logs, regressor.joints, cutoffs)
    rows = weighted(rows_of(regressor, base, pieces))
    check_excited(base, rows)
    squares = least_squares(rows)
    told(0.2)
    if method != METHODS[0]:
        return Solved(pieces, rows, squares, None, rows.columns)
    low = LOW * usual_frequency(pieces)
    slow = motions(logs, regressor.joints, Cutoffs(min(low, cutoffs.kinematic), min(low, cutoffs.parallel)))
    first = least_squares(weighted(rows_of(regressor, base, slow))).values
    found, columns = _instrumented(regressor, base, (pieces, slow), rows, first, lambda done: told(0.2 + 0.8 * done))
    return Solved(pieces, rows, squares, found, columns)


def rows_of(regressor: Regressor, base: Base, pieces: Sequence[Motion]) -> Rows:
    """The linear problem of measured motion, not weighted."""
    joints = len(regressor.joints)
    columns = stacked(pieces, lambda one: _columns(regressor, base, one.position, one.velocity, one.acceleration))
    return Rows(columns, stacked(pieces, lambda one: one.effort), *labels(pieces, joints), np.ones(joints))


def _columns(regressor: Regressor, base: Base, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    return regressor(q, v, a)[:, :, base.places]


def weighted(rows: Rows) -> Rows:
    """With the deviations of the residuals of each joint, as least squares with them finds them again."""
    for _ in range(WEIGHTS):
        weight = rows.weight[:, None]
        values = np.linalg.lstsq(rows.columns * weight, rows.effort * weight[:, 0], rcond=None)[0]
        off = rows.residual(values)
        joints = range(len(rows.deviation))
        deviation = np.array([np.sqrt(np.mean(off[rows.joint == joint] ** 2)) for joint in joints])
        rows = replace(rows, deviation=np.maximum(deviation, 1e-12 * np.max(np.abs(rows.effort))))
    return rows


def check_excited(base: Base, rows: Rows) -> None:
    """Refuse logs in which base parameters go together.

    Raises:
        StickslipError: which.
    """
    sizes = np.linalg.norm(rows.columns, axis=0)
    idle = [one.name for one, size in zip(base.parameters, sizes, strict=True) if size == 0]
    if not idle:
        condition, idle = together(base, rows)
        if condition < INDISTINGUISHABLE:
            return
    raise StickslipError(
        f"The motion in the logs does not show {', '.join(idle)} (one by one): record one that excites all joints, at "
        "several speeds, or take some of them as known."
    )


def together(base: Base, rows: Rows) -> tuple[float, list[str]]:
    """Condition of the weighted columns, each scaled to one, and the base parameters that they tell apart least."""
    columns = rows.columns * rows.weight[:, None]
    _, singular, directions = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
    shares = np.abs(directions[-1])
    names = [one.name for one, share in zip(base.parameters, shares, strict=True) if share > 0.1 * shares.max()]
    return float(singular[0] / max(singular[-1], 1e-300)), names


def least_squares(rows: Rows) -> Estimated:
    """Weighted, with deviations that allow for coloured residuals."""
    return _estimated("least squares", rows, rows.columns)


def _estimated(method: str, rows: Rows, instruments: np.ndarray) -> Estimated:
    weight = rows.weight[:, None]
    z, y, tau = instruments * weight, rows.columns * weight, rows.effort * weight[:, 0]
    # in units of their own
    sizes = np.linalg.norm(y, axis=0)
    z, y = z / sizes, y / sizes
    to_values = np.linalg.solve(z.T @ y, z.T)  # (b, rows)
    values = to_values @ tau
    # the rows that least squares would have with these same values
    gradient = np.linalg.solve(to_values @ to_values.T, to_values).T
    residual = tau - y @ values
    scale = np.outer(1 / sizes, 1 / sizes)
    many = len(np.unique(rows.log)) > 1
    return Estimated(
        method,
        values / sizes,
        newey_west(gradient, residual, log=rows.series) * scale,
        clustered_covariance(gradient, residual, rows.log) * scale if many else None,
    )


def _instrumented(
    regressor: Regressor,
    base: Base,
    pieces: tuple[Sequence[Motion], Sequence[Motion]],
    rows: Rows,
    first: np.ndarray,
    told: Callable[[float], None],
) -> tuple[Estimated, np.ndarray]:
    rows = _with_slow_friction(regressor, base, *pieces, rows)
    values, found, columns = first, None, rows.columns
    measured = pieces[0][0]
    band = usual_frequency(pieces[0]), measured.parallel
    step = float(np.diff(measured.time[measured.kept][:2])[0])
    for number in range(ROUNDS):
        simulated = instruments(regressor, base, *pieces, values)
        if simulated is None:
            break
        found, columns = _prefiltered(rows, simulated, values, step, band)
        found = replace(found, rounds=number + 1)
        moved = np.max(np.abs(found.values - values) / found.deviation)
        values = found.values
        told((number + 1) / ROUNDS)
        if moved < SAME:
            break
    if found is None:
        raise StickslipError(
            "With the values that least squares gives the simulated machine leaves the logs: there are no instruments. "
            "Lower the cutoff, check signs and units of efforts and positions, or ask for least squares."
        )
    return found, columns


def _with_slow_friction(
    regressor: Regressor, base: Base, pieces: Sequence[Motion], slow: Sequence[Motion], rows: Rows
) -> Rows:
    """With columns of friction of the same pieces after a low cutoff: the mean of sgn(v + noise) is not sgn v, and
    instruments keep additive noise out alone."""
    frictional = np.array([one.frictional for one in base.parameters])
    slowly = {
        id(piece): _columns(regressor, base, one.position, one.velocity, one.acceleration)
        for piece, one in zip(pieces, slow, strict=True)
    }
    columns = np.where(frictional, stacked(pieces, lambda one: slowly[id(one)]), rows.columns)
    return replace(rows, columns=columns)


def _prefiltered(
    rows: Rows, instruments: np.ndarray, values: np.ndarray, step: float, band: tuple[float, float]
) -> tuple[Estimated, np.ndarray]:
    """The estimate after the prefilter of the residuals that values (b,) leave; the columns (rows, b) that give the same
    one as instruments of rows without it. step: s between rows; band: Hz, of the motion and of the rows."""
    residual = rows.residual(values)
    calm = prefilter(residual, rows.series, rows.joint, step, band)
    kept, left = calm.settled, calm(residual)
    joints = range(len(rows.deviation))
    deviation = np.array([np.std(left[kept & (rows.joint == joint)]) for joint in joints])
    smooth = replace(rows, columns=calm(rows.columns), effort=calm(rows.effort), deviation=deviation)
    inside = calm(instruments) * kept[:, None]
    return (
        _estimated(METHODS[0], smooth.where(kept), inside[kept]),
        calm.transposed(inside) * (rows.deviation / deviation)[rows.joint, None] ** 2,
    )


def instruments(
    regressor: Regressor, base: Base, pieces: Sequence[Motion], slow: Sequence[Motion], values: np.ndarray
) -> np.ndarray | None:
    """Columns (rows, b) on simulated motion; None where that is not finite. slow: the same pieces after a low cutoff,
    which drive it: the noise of efforts and positions above it must not come back in the instruments."""
    whole = np.zeros(len(regressor.names))
    whole[base.places] = values
    try:
        found = follow(regressor, whole, slow)
    except np.linalg.LinAlgError:
        return None
    if not all(np.all(np.isfinite(one)) for motion in found for one in motion):
        return None
    simulated = {id(piece): _columns(regressor, base, *motion) for piece, motion in zip(pieces, found, strict=True)}
    return stacked(pieces, lambda one: simulated[id(one)])


def follow(
    regressor: Regressor, values: np.ndarray, pieces: Sequence[Motion]
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Position, velocity, acceleration (n, joints) of every piece, simulated in stretches that overlap, at steps that
    the cutoff of the pieces allows."""
    stride = max(int(1 / (FINE * pieces[0].parallel * pieces[0].step)), 1)
    step = stride * pieces[0].step
    grids = [np.arange(piece.time[0], piece.time[-1] + step, step) for piece in pieces]
    settle = int(1 / (OBSERVER * step))
    used = int(HOLD * settle)
    begins = [(place, at) for place, grid in enumerate(grids) for at in range(0, len(grid), used)]
    reach = np.arange(-settle, used)
    rows = [np.clip(at + reach, 0, len(grids[place]) - 1) for place, at in begins]

    def taken(of: Callable[[Motion], np.ndarray]) -> np.ndarray:
        whole = [_between(grid, piece.time, of(piece)) for grid, piece in zip(grids, pieces, strict=True)]
        return np.stack([whole[place][at] for (place, _), at in zip(begins, rows, strict=True)])

    stretches = Stretches(
        step,
        taken(lambda one: one.position),
        taken(lambda one: one.velocity),
        taken(lambda one: one.smooth(one.effort)),
    )
    with np.errstate(over="ignore", invalid="ignore"):
        motion = run(regressor, values, stretches, OBSERVER)
    found = []
    for number, (grid, piece) in enumerate(zip(grids, pieces, strict=True)):
        mine = [i for i, (place, _) in enumerate(begins) if place == number]
        joined = [one[mine, settle:].reshape(-1, one.shape[-1])[: len(grid)] for one in motion]
        q, v, a = (_between(piece.time, grid, one) for one in joined)
        found.append((q, v, a))
    return found


def _between(at: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, joints) at other times (k,): (k, joints)."""
    return np.stack([np.interp(at, time, column) for column in values.T], axis=1)


def usual_frequency(pieces: Sequence[Motion]) -> float:
    """Below which nearly all power of the velocities lies, Hz, of the joint that moves fastest; white noise of
    positions, whose power rises there by the square of the frequency, is taken off."""
    from scipy.signal import periodogram

    step = float(np.diff(pieces[0].time[pieces[0].kept][:2])[0])
    spectra = [periodogram(piece.thinned(piece.velocity), 1 / step, window="hann", axis=0) for piece in pieces]
    frequency = np.concatenate([one for one, _ in spectra])
    power = np.concatenate([one * len(piece.time) for piece, (_, one) in zip(pieces, spectra, strict=True)])
    cutoff = pieces[0].parallel
    noisy = (frequency > NOISY[0] * cutoff) & (frequency < NOISY[1] * cutoff)
    noise = np.median(power[noisy] / frequency[noisy, None] ** 2, axis=0) / np.log(2)  # mean of an exponential
    order = np.argsort(frequency)
    below = frequency[order] < NOISY[1] * cutoff
    total = np.cumsum((power - noise * frequency[:, None] ** 2)[order][below], axis=0)
    first = np.argmax(total >= SHARE * total[-1], axis=0)
    return float(np.max(frequency[order][below][first]))
