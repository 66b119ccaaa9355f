"""Free decay without contact: stiffness and damping over inertia.

    J th'' + c th' + k th = 0   =>   th(t) = z + exp(-a t) (C cos(w t) + S sin(w t)),
    c/J = 2 a,   k/J = a^2 + w^2

The response is fitted to the angle itself, from the first crossing of the rest position on, so that how the disc was
let go does not matter. Only ratios follow: absolute J, k, c need one further measurement (a known mass, a known
torque). To first order the residuals also tell k3 and c2 of k (1 + k3 th^2) and c (1 + c2 |th'|). Source: disc_rig
paper, section 3.2 (natural frequency and decay of the amplitude); here all samples at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from identification.inference.uncertainty import clustered_covariance, newey_west
from rig_io.logs.log import RigLog

PULLS = (
    "With no disc in contact a torque acts at some angles of the body, beside spring and damping: look for a magnet, a "
    "cable, a stop. Friction that depends on the angle is not told from it."
)
RATIOS = {"k/J": "stiffness_ratio", "c/J": "damping_ratio"}  # their fields
CYCLES = 3  # needed: fewer leave frequency and damping at the mercy of the rest position
DRIFTS = (1, 2, 3)  # powers of the time, in what a sensor shows too much
PLACES = 8  # from the least to the greatest angle, between which a torque that goes with it is straight
BLOCKS = 8  # of a cycle, whose means tell such a torque
PULLED = 100.0  # of 2 ln L, that it gains: less than 10 of a rig without, up to 100 with a laser that walks
SLIGHT = 1e-4  # of the angles, that it moves the rest by: less is rounding
FLOOR = 0.02  # of the first swing: below it dry friction of the bearings would count for more than the signal


@dataclass(frozen=True)
class FreeDecay(Shown):
    """Result of a free decay.

    stiffness_ratio k/J, 1/s^2; damping_ratio c/J, 1/s; each with its standard deviation (residuals' colour included;
    None where a user set the ratio and did not say how well he knows it).
    cubic: k3, 1/rad^2, and drag: c2, s/rad, each with its standard deviation; pull: rad, by which a torque that acts
    at some angles moves the rest there, 0 where none does.
    rest: rad, angle at rest (zero of the angle sensor), with its standard deviation; amplitude: rad, first swing used;
    rms_residual: rad; cycles used; stated: which of k/J and c/J were set by the user instead; sensor: that
    showed the angle.
    """

    stiffness_ratio: float
    stiffness_ratio_deviation: float | None
    damping_ratio: float
    damping_ratio_deviation: float | None
    rest: float
    rest_deviation: float
    amplitude: float
    rms_residual: float
    cycles: float
    log: str = ""
    warnings: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    sensor: str = ""
    cubic: tuple[float, float] | None = None
    drag: tuple[float, float] | None = None
    pull: float = 0.0

    def with_ratios(self, ratios: Mapping[str, float], deviations: Mapping[str, float | None]) -> FreeDecay:
        """The decay with stated k/J (1/s^2) or c/J (1/s), and their standard deviations, in place of its own."""
        changed: dict[str, Any] = {"stated": tuple(ratios)}
        for name, field in RATIOS.items():
            if name in ratios:
                changed |= {field: ratios[name], f"{field}_deviation": deviations.get(name)}
        return replace(self, **changed)

    def again(self, log: RigLog) -> FreeDecay:
        """That of the same log, read otherwise; what was stated stays."""
        fields = {name: field for name, field in RATIOS.items() if name in self.stated}
        ratios = {name: getattr(self, field) for name, field in fields.items()}
        deviations = {name: getattr(self, f"{field}_deviation") for name, field in fields.items()}
        return fit_free_decay(log).with_ratios(ratios, deviations)

    @property
    def natural_period(self) -> float:
        """2 pi / sqrt(k/J), s."""
        return 2 * np.pi / float(np.sqrt(self.stiffness_ratio))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, each ratio with unit and standard deviation."""
        return {
            "k/J": {"value": self.stiffness_ratio, "unit": "1/s^2", "sd": self.stiffness_ratio_deviation},
            "c/J": {"value": self.damping_ratio, "unit": "1/s", "sd": self.damping_ratio_deviation},
            "rest": {"value": self.rest, "unit": "rad", "sd": self.rest_deviation},
            "amplitude": {"value": self.amplitude, "unit": "rad"},
            "rms_residual": {"value": self.rms_residual, "unit": "rad"},
            "cycles": self.cycles,
            "log": self.log,
            "warnings": list(self.warnings),
        }


def fit_free_decay(log: RigLog) -> FreeDecay:
    """k/J and c/J from a log of the disc swinging free.

    Raises:
        StickslipError: no angle in the log, too few cycles, or an amplitude that does not decay.
    """
    from identification.measurement.disc_motion import angle_at_ticks, angle_sensor, by_encoder, passed_lines

    if log.kind != "free-decay":
        raise StickslipError(f"Log '{log.name}' is of kind '{log.kind}'; k/J and c/J need one of kind 'free-decay'.")
    pieces = log.pieces()
    longest = max(pieces, key=lambda piece: len(piece.time))
    if by_encoder(longest):
        passes = passed_lines(longest)
        decay = fit_decay(passes.time, passes.angle, name=log.name, line=passes.line)
    else:
        decay = fit_decay(*angle_at_ticks(longest), name=log.name)
    decay = replace(decay, sensor=angle_sensor(log))
    if len(pieces) == 1:
        return decay
    note = f"Free decay '{log.name}' is in {len(pieces)} pieces; the longest, of {longest.duration:.3g} s, was used."
    return replace(decay, warnings=(note, *decay.warnings))


def fit_decay(time: np.ndarray, angle: np.ndarray, *, name: str = "", line: np.ndarray | None = None) -> FreeDecay:
    """As `fit_free_decay`, from time (n,) in s and angle (n,) in rad; samples that are NaN are left out. line: (n,)
    number of the encoder's line that a sample is of, whose error all its passes share."""
    from scipy.optimize import least_squares

    good = np.isfinite(angle)
    time, angle = time[good], angle[good]
    start, swings = _swings(time, angle, name)
    used = time >= start
    time, angle = time[used] - start, angle[used]
    shared = None if line is None else line[good][used]
    frequency = np.pi * (len(swings) - 1) / (swings[-1, 0] - swings[0, 0])
    rate = -np.polyfit(swings[:, 0], np.log(np.abs(swings[:, 1])), 1)[0]
    scale = float(np.max(np.abs(swings[:, 1])))

    def residual(q: np.ndarray) -> np.ndarray:
        basis = _basis(time, q)
        return basis @ np.linalg.lstsq(basis, angle, rcond=None)[0] - angle

    # variable projection: the amplitudes are linear, only rate and frequency are searched
    solution = least_squares(
        residual, [rate, frequency], x_scale=[max(abs(rate), 1e-3 * frequency), frequency], xtol=1e-14
    )
    rate, frequency = (float(value) for value in solution.x)
    if rate <= 0:
        raise _no_decay(name, rate)
    basis = _basis(time, solution.x)
    linear = np.linalg.lstsq(basis, angle, rcond=None)[0]
    error = basis @ linear - angle
    gradient = _gradient(time, solution.x, linear, basis)
    # a decay tells most at its begin, so that a share of all samples is too much; what disturbs it is over in a swing
    reach = max(round(2 * np.pi / frequency / float(np.median(np.diff(time)))) // 4, 1)

    def spread(gradient: np.ndarray, error: np.ndarray) -> np.ndarray:
        if shared is None:
            return newey_west(gradient, error, reach=reach)
        return clustered_covariance(gradient, error, shared)

    full = spread(gradient, error)
    covariance = full[:2, :2]
    bent = np.column_stack([gradient, _bends(time, solution.x, linear, basis)])
    shares = -np.linalg.lstsq(bent, error, rcond=None)[0]
    cubic, drag = np.stack([shares, np.sqrt(np.diag(spread(bent, error + bent @ shares)))], axis=1)[-2:].tolist()
    # d(k/J) = 2 a da + 2 w dw
    to_ratio = np.array([2 * rate, 2 * frequency])
    pull = 0.0 if shared is not None else _pull(time, solution.x, linear, basis, bent, error)
    rms = float(np.sqrt(np.mean(error**2)))
    return FreeDecay(
        stiffness_ratio=rate**2 + frequency**2,
        stiffness_ratio_deviation=float(np.sqrt(to_ratio @ covariance @ to_ratio)),
        damping_ratio=2 * rate,
        damping_ratio_deviation=float(2 * np.sqrt(covariance[0, 0])),
        rest=float(linear[2]),
        rest_deviation=float(np.sqrt(full[4, 4])),
        amplitude=scale,
        rms_residual=rms,
        cycles=float(frequency * time[-1] / (2 * np.pi)),
        log=name,
        warnings=(*_warnings(time, error, frequency, scale), *([PULLS] if pull else [])),
        cubic=tuple(cubic),
        drag=tuple(drag),
        pull=pull,
    )


def _basis(time: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Cosine, sine and rest: (n, 3)."""
    envelope = np.exp(-q[0] * time)
    return np.stack([envelope * np.cos(q[1] * time), envelope * np.sin(q[1] * time), np.ones_like(time)], axis=1)


def _gradient(time: np.ndarray, q: np.ndarray, linear: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Derivatives of the model by rate, frequency, C, S, rest: (n, 5)."""
    by_rate = -time * (basis[:, 0] * linear[0] + basis[:, 1] * linear[1])
    by_frequency = time * (basis[:, 0] * linear[1] - basis[:, 1] * linear[0])
    return np.column_stack([by_rate, by_frequency, basis])


def _bends(time: np.ndarray, q: np.ndarray, linear: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Derivatives of the motion by k3 and c2: its responses to -(k/J) th^3 and -(c/J) |th'| th' (n, 2)."""
    rate, frequency = q
    angle = basis[:, :2] @ linear[:2]
    speed = -rate * angle + frequency * (basis[:, 0] * linear[1] - basis[:, 1] * linear[0])
    forces = np.stack([-(rate**2 + frequency**2) * angle**3, -2 * rate * np.abs(speed) * speed])
    return _responses(time, q, forces)


def _responses(time: np.ndarray, q: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Of the motion to forces (m, n) over J: (n, m)."""
    from scipy.integrate import cumulative_trapezoid

    turning = np.exp((1j * q[1] - q[0]) * time)
    return (turning * cumulative_trapezoid(forces / turning, time, axis=1, initial=0)).imag.T / q[1]


def _pull(
    time: np.ndarray, q: np.ndarray, linear: np.ndarray, basis: np.ndarray, bent: np.ndarray, error: np.ndarray
) -> float:
    """Size in rad of a torque that goes with the angle and is none of a spring that bends; 0 where it is chance, or a
    sensor that drifts slowly would show as much."""
    bent = np.column_stack([bent, *((time / time[-1]) ** power for power in DRIFTS)])
    angle = basis[:, :2] @ linear[:2]
    places = np.linspace(angle.min(), angle.max(), PLACES)
    hats = np.maximum(1 - np.abs(angle - places[:, None]) / (places[1] - places[0]), 0)
    block = (time * q[1] / (2 * np.pi) * BLOCKS).astype(int)
    every = np.column_stack([bent, _responses(time, q, hats)])
    norms = np.linalg.norm(every, axis=0)
    means = np.stack([np.bincount(block, column) for column in (every / norms).T], axis=1)
    seen = np.bincount(block, error)
    if len(seen) < 2 * every.shape[1]:
        return 0.0
    fits = [np.linalg.lstsq(means[:, :count], seen, rcond=1e-6)[0] for count in (bent.shape[1], every.shape[1])]
    before, after = (float(np.sum((seen - means[:, : len(fit)] @ fit) ** 2)) for fit in fits)
    if not len(seen) * np.log(before / after) > PULLED:
        return 0.0
    torque = (fits[1] / norms)[bent.shape[1] :] @ hats / float(q @ q)
    smooth = np.polynomial.Polynomial.fit(angle, torque, 3)  # rest and spring take up as much
    size = float(np.ptp(torque - smooth(angle))) / 2
    return size if size > SLIGHT * float(np.ptp(angle)) else 0.0


def _swings(time: np.ndarray, angle: np.ndarray, name: str) -> tuple[float, np.ndarray]:
    """First crossing of rest (s), and the extreme (time, deviation from rest) of each half swing after it: (m, 2).

    The rest position is taken as the median of the last quarter. Half swings below `FLOOR` of the greatest are left
    out.
    """
    if len(time) < 20:
        raise StickslipError(f"Free decay '{name}' has {len(time)} usable samples; it needs {CYCLES} cycles or more.")
    zero = float(np.median(angle[-len(angle) // 4 :]))
    away = angle - zero
    reach = float(np.max(np.abs(away)))
    # hysteresis: a side counts once it is left by more than the floor, so that noise makes no crossings
    side = np.where(away > FLOOR * reach, 1, np.where(away < -FLOOR * reach, -1, 0))
    outside = np.flatnonzero(side)
    turns = outside[1:][np.diff(side[outside]) != 0]
    if len(turns) < 2 * CYCLES:
        raise StickslipError(
            f"Free decay '{name}' shows {len(turns) / 2:.1f} cycles in {time[-1] - time[0]:.3g} s; {CYCLES} or more "
            "are needed. Record longer, or let the disc go from a larger angle."
        )
    swings = []
    for first, last in pairwise(turns):
        peak = first + int(np.argmax(np.abs(away[first:last])))
        swings.append((time[peak], away[peak]))
    table = np.array(swings)
    third = max(len(table) // 3, 1)
    if np.mean(np.abs(table[-third:, 1])) >= 0.98 * np.mean(np.abs(table[:third, 1])):
        growth = np.log(np.abs(table[-1, 1] / table[0, 1])) / (table[-1, 0] - table[0, 0])
        raise _no_decay(name, -float(growth))
    return float(time[turns[0]]), table


def _no_decay(name: str, rate: float) -> StickslipError:
    return StickslipError(
        f"Free decay '{name}' does not decay: its amplitude follows exp({-rate:+.3g} t). A free decay is recorded with "
        "no disc in contact and no drive; check that the log is of that kind and that nothing excites the rig."
    )


def _warnings(time: np.ndarray, error: np.ndarray, frequency: float, scale: float) -> tuple[str, ...]:
    """Warn where a viscous decay does not describe the data: residuals that swing with the disc."""
    lag = round(np.pi / frequency / 4 / float(np.median(np.diff(time))))
    smooth = np.convolve(error, np.ones(lag) / lag, mode="valid")
    swing = float(np.max(np.abs(smooth)))
    if swing < 0.01 * scale:
        return ()
    return (
        f"The residuals swing by {swing:.2g} rad ({100 * swing / scale:.1f} % of the first swing): damping is not "
        "viscous alone (dry friction in the bearings?) or the spring is not linear.",
    )
