"""Measured motion and efforts of a machine, made ready: velocities and accelerations, and one low-pass over all.

    positions -> low-pass forward and backward -> central differences
    efforts, and every column of the regressor -> the same second low-pass -> thinned

The second one passes over both sides of a linear equation and leaves it true; it takes off noise above the machine's
motion and keeps few samples. Both are Butterworth of order 4, forward and backward; a recipe has filters of its own.
At its turns a joint sticks, and friction is what it is held by, not sgn v: of a joint that is still nothing weighs.

Sources: Gautier (1997), ICRA, 2278 (parallel decimation); Janot, Vandanjon, Gautier (2014), Control Eng. Practice 25,
85.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from fmu_models.base.errors import StickslipError

ORDER = 4
GAP = 10.0  # usual steps: a longer one parts a log
PADDED = 2.0  # periods of a cutoff by which a log is prolonged: a filter that starts nearer shows in its ends
SETTLED = 1.5  # periods of the lower cutoff that are cut off both ends of a piece, where filters have no past
LEAST = 20  # thinned samples that a piece must hold
PER_PERIOD = 5.0  # thinned samples per period of the second cutoff
LEAST_TRAVEL = 1e-6  # rad or m: a joint that moves less is at rest

Smooth = Callable[[np.ndarray], np.ndarray]  # (n, ...) -> (n, ...)


@dataclass(frozen=True, eq=False)
class JointMotion:
    """A piece of a log at even steps: time (n,), position, velocity, acceleration, effort (n, joints), filtered but for
    the efforts; log: number of its log; smooth: the second low-pass; indices: (k,) of the thinned samples; weight: (n,
    joints); load, warmer: (n,) as in `Conditions.relative`, None where they are constant."""

    log: int
    step: float
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    effort: np.ndarray
    weight: np.ndarray
    smooth: Smooth
    indices: np.ndarray
    load: np.ndarray | None = None
    warmer: np.ndarray | None = None

    def thinned(self, values: np.ndarray) -> np.ndarray:
        """Values (n, ...) after the second low-pass at the thinned samples, (k, ...)."""
        return self.smooth(values)[self.indices]

    @property
    def span(self) -> slice:
        """From the first used sample to the last."""
        return slice(int(self.indices[0]), int(self.indices[-1]) + 1)


@dataclass(frozen=True, eq=False)
class MachineLog:
    """One log. time: (n,) s; position, effort: (n, joints), as declared; notes: what to say of it; ready: its pieces as
    a recipe filters them, empty where there is none; load: (n,) N, of all joints, and temperature: (n,) K, of their
    friction, None where nobody recorded them."""

    name: str
    time: np.ndarray
    position: np.ndarray
    effort: np.ndarray
    notes: tuple[str, ...] = ()
    ready: tuple[JointMotion, ...] = ()
    load: np.ndarray | None = None
    temperature: np.ndarray | None = None


@dataclass(frozen=True)
class Conditions:
    """Under which friction is that of the parameters. load: N; temperature: K; None where logs have none."""

    load: float | None = None
    temperature: float | None = None

    @classmethod
    def of(cls, logs: Sequence[MachineLog]) -> Self:
        """Medians over logs. StickslipError: some have such a column and others none, or a normal force below zero."""
        medians: dict[str, float | None] = {"load": None, "temperature": None}
        for name, words in (("load", "normal force"), ("temperature", "temperature")):
            columns = [column for log in logs if (column := getattr(log, name)) is not None]
            if columns and len(columns) < len(logs):
                raise StickslipError(f"Some logs have a {words} and others none: give it of all, or of none.")
            if columns:
                medians[name] = float(np.median(np.concatenate(columns)))
        least = min((float(log.load.min()) for log in logs if log.load is not None), default=0.0)
        if least < 0 or medians["load"] == 0:
            raise StickslipError(
                f"The normal force falls to {least:.3g} N: it presses from 0 on. Check the zero and the sign of its "
                "load cell."
            )
        return cls(**medians)

    def relative(self, logs: Sequence[MachineLog]) -> list[MachineLog]:
        """Logs with loads in place of 1 that are over the usual one, and temperatures, K, above the usual one."""
        return [
            replace(
                log,
                load=None if self.load is None or log.load is None else log.load / self.load,
                temperature=None
                if self.temperature is None or log.temperature is None
                else log.temperature - self.temperature,
            )
            for log in logs
        ]


@dataclass(frozen=True)
class Cutoffs:
    """Of the low-pass of positions, and of that over efforts and columns, Hz; still: share of its usual speed below
    which a joint may stick, and weighs nothing."""

    kinematic: float
    parallel: float
    still: float = 0.0


def motions(logs: Sequence[MachineLog], joints: Sequence[str], cutoffs: Cutoffs | None) -> list[JointMotion]:
    """All pieces of logs, at the step of the slowest of them; as their recipe filters them if there are no cutoffs.
    StickslipError: a log is too short or too slow for the cutoffs, has no positions or no recipe, time runs back, or a
    joint never moves."""
    if cutoffs is None:
        for log in logs:
            if not log.ready:
                raise StickslipError(
                    f"'{log.name}' was read without a recipe that says how to filter it: give a cutoff."
                )
        return [replace(piece, log=number) for number, log in enumerate(logs) for piece in log.ready]
    step = max(float(np.median(np.diff(log.time))) for log in logs)
    pieces = [piece for number, log in enumerate(logs) for piece in _pieces(number, log, step, cutoffs)]
    travel = np.max([np.ptp(piece.position, axis=0) for piece in pieces], axis=0)
    still = [name for name, reach in zip(joints, travel, strict=True) if reach < LEAST_TRAVEL]
    if still:
        raise StickslipError(
            f"{', '.join(still)} never moves in the logs: nothing of it can be found. Record a motion of every joint, "
            "or declare the machine without it."
        )
    return weighed(pieces, cutoffs) if cutoffs.still > 0 else pieces


def weighed(pieces: Sequence[JointMotion], cutoffs: Cutoffs) -> list[JointMotion]:
    """Pieces in which a joint weighs nothing while it is still, and as long before and after as the second low-pass
    shows it: half a period."""
    from scipy.ndimage import minimum_filter1d

    usual = np.sqrt(np.mean(np.concatenate([piece.velocity for piece in pieces]) ** 2, axis=0))
    reach = int(0.5 / (cutoffs.parallel * pieces[0].step))
    slowest = (minimum_filter1d(np.abs(piece.velocity), 2 * reach + 1, axis=0) for piece in pieces)
    return [
        replace(piece, weight=piece.weight * (speed >= cutoffs.still * usual))
        for piece, speed in zip(pieces, slowest, strict=True)
    ]


def _pieces(number: int, log: MachineLog, step: float, cutoffs: Cutoffs) -> list[JointMotion]:
    if not np.all(np.isfinite(log.position)):
        raise StickslipError(
            f"'{log.name}' has no positions, from which a machine's velocities and accelerations are found. Add "
            "[signals.position] to its recipe, or leave it its own filters, without --method and --cutoff."
        )
    steps = np.diff(log.time)
    if not np.all(steps > 0):
        index = int(np.argmax(steps <= 0))
        raise StickslipError(
            f"The time of '{log.name}' does not rise at {log.time[index]:g} s (row {index + 2}). Mend the log, or join "
            "its parts as logs of their own."
        )
    for name, cutoff in (("positions", cutoffs.kinematic), ("efforts", cutoffs.parallel)):
        if not 0 < 2 * cutoff * step < 1:
            raise StickslipError(
                f"The cutoff of {name}, {cutoff:g} Hz, does not lie between 0 and half the sampling rate of "
                f"'{log.name}', {0.5 / step:.4g} Hz. Choose another, and check that its time is in s."
            )
    ends = np.flatnonzero(steps > GAP * float(np.median(steps))) + 1
    pieces = []
    for rows in np.split(np.arange(len(log.time)), ends):
        time = np.arange(float(log.time[rows[0]]), float(log.time[rows[-1]]) + 0.5 * step, step)
        if len(_used_samples(len(time), cutoffs.parallel, step)) >= LEAST:
            pieces.append(_piece(number, log, rows, time, step, cutoffs))
    if not pieces:
        raise StickslipError(
            f"'{log.name}' lasts {log.time[-1] - log.time[0]:.3g} s{' with gaps' if len(ends) else ''}: too short for "
            f"a cutoff of {cutoffs.parallel:g} Hz. Raise the cutoff, or record for longer."
        )
    return pieces


def _piece(
    number: int, log: MachineLog, rows: np.ndarray, time: np.ndarray, step: float, cutoffs: Cutoffs
) -> JointMotion:
    def even(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(time, log.time[rows], column) for column in values[rows].T], axis=1)

    def beside(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else np.interp(time, log.time[rows], values[rows])

    position = low_pass(even(log.position), cutoffs.kinematic, step)
    velocity = np.gradient(position, step, axis=0)
    return JointMotion(
        number,
        step,
        time,
        position,
        velocity,
        np.gradient(velocity, step, axis=0),
        even(log.effort),
        np.ones(position.shape),
        partial(low_pass, cutoff=cutoffs.parallel, step=step),
        _used_samples(len(time), cutoffs.parallel, step),
        beside(log.load),
        beside(log.temperature),
    )


def low_pass(values: np.ndarray, cutoff: float, step: float) -> np.ndarray:
    """Values (n, ...) filtered forward and backward. cutoff: Hz; step: s."""
    from scipy.signal import butter, sosfiltfilt

    padding = min(int(PADDED / (cutoff * step)), len(values) - 1)
    return sosfiltfilt(butter(ORDER, 2 * cutoff * step, output="sos"), values, axis=0, padlen=padding)


def _used_samples(count: int, parallel: float, step: float) -> np.ndarray:
    """Indices (k,) of the samples that are used after the second low-pass: thinned, without the ends."""
    edge = int(SETTLED / (parallel * step))
    return np.arange(edge, max(count - edge, edge), max(int(1 / (PER_PERIOD * parallel * step)), 1))


def stacked(pieces: Sequence[JointMotion], of: Callable[[JointMotion], np.ndarray]) -> np.ndarray:
    """What each piece gives (k, joints, ...), thinned, joint after joint of one piece after another: (rows, ...)."""
    return in_rows([piece.thinned(of(piece)) for piece in pieces])


def in_rows(pieces: Sequence[np.ndarray]) -> np.ndarray:
    """Values of thinned samples (k, joints, ...) of each piece in the order of `stacked`."""
    return np.concatenate([np.swapaxes(piece, 0, 1).reshape(-1, *piece.shape[2:]) for piece in pieces])
