"""Breakaway: the friction coefficient at which every stick of one driving disc lets go, and whether it ages.

    stick    theta = theta_0 + r/R (Phi - Phi_0),   Phi angle of the drive, up to the release at t_r
    slip     J theta'' + c theta' + k theta = R N mu(|v|) sgn(v),   v = r w - R theta',   from t_r on, fitted law
    level    (J r w'/R + c r w/R + k theta(t_r))/(R N),   that of the force that the stick carried last

theta_0 and t_r of each stick are found by Gauss-Newton steps from the angle in stick and in the first part of the
slip. A contact that ages lets go at mu(0) + b log10(1 + t/t_0) after a stick of t s (``language/laws/ageing.py``): the
mean of the levels beyond mu(0) shows it, b follows where the sticks span a decade or more; then their mean level is
free, so that neither mu(0) nor t_0 matters (for t >> t_0). Where the law is wrong its mu(0) is, and levels beyond it
say nothing of age: only their growth does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.language.law_parameter import T_0
from identification.inference.problem import Prior
from identification.laws.law import FittableLaw
from identification.measurement.motion import SMOOTHING, drive_angle, savitzky_golay
from identification.measurement.pooled import Pool, RigValues, rig_values
from identification.measurement.slip_segments import stretches

STEP = 8e-3  # s, of the motion from the release on
BEFORE, AFTER = 0.15, 0.08  # natural periods about the instant at which slip is seen, that are looked at
TRIM = 1.0  # smoothing windows at the begin of a stick, where the contact may ring
SHORTEST = 0.02  # natural periods of stick that must be left
RAMP = 0.045  # natural periods over which the drive's acceleration is taken
SAMPLED = 4  # of what is known of a stick, first, at its samples
FEWEST = 5  # sticks, below which their spread is not known
STEPS, LONGEST_STEP = 10, 0.02  # of the search; s
SETTLED, FOUND = 2e-5, 1e-2  # s, of the last step: where a search ends; where one that knows no better has come to
SIGNIFICANT = 3.5  # standard deviations
UNTOLD = 0.012  # of the coefficient: so little beyond mu(0) changes slip by its square, and is biased upward by noise
UNEVEN = 0.05  # of the coefficient, that the drive's acceleration may add to a level: its encoder says little of more
SHARE = 1e-4  # of a constant, by which it is moved for a derivative
HOLD = 2.0  # median sticks that a hold lasts, at least
DECADE = 1.0  # decades of time in stick from which on their growth has a value


@dataclass(frozen=True)
class Release:
    """The end of one stick. log: number; time: s, on the log's clock; stick: s, how long it lasted; level: friction
    coefficient of the force that it carried last."""

    log: int
    time: float
    stick: float
    level: float


@dataclass(frozen=True)
class Breakaway:
    """Breakaway of all sticks. level: mean friction coefficient; deviation: of that mean; at_rest: mu(0) of the fitted
    law; excess: of the mean over that, with its standard deviation (noise and constants of the rig); growth: b, per
    decade of time in stick, with its own, None where the sticks span less than a decade; of_wrong_law: whether mu(0) is
    that of a law which misses the logs, or which another beats."""

    level: float
    deviation: float
    at_rest: float
    excess: float
    excess_deviation: float
    growth: float | None
    growth_deviation: float | None
    releases: tuple[Release, ...]
    of_wrong_law: bool = False

    @property
    def ages(self) -> bool:
        """Whether sticks surely let go at more than the law has at rest, and later ones the more."""
        if self.growth is not None and self.growth_deviation is not None:
            return self.growth > SIGNIFICANT * self.growth_deviation
        return not self.of_wrong_law and self.excess > max(SIGNIFICANT * self.excess_deviation, UNTOLD)

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest stick, s."""
        sticks = [one.stick for one in self.releases]
        return min(sticks), max(sticks)

    @property
    def words(self) -> str:
        """What is said of it."""
        low, high = self.span
        said = (
            f"{len(self.releases)} sticks of {low:.2g} to {high:.2g} s let go at {self.level:.4f} ± "
            f"{self.deviation:.1g}, that is mu(0) {self.excess:+.4f} ± {self.excess_deviation:.1g}"
        )
        if self.growth is not None:
            return f"{said}; growth {self.growth:.4f} ± {self.growth_deviation:.1g} per decade of time in stick"
        if self.of_wrong_law:
            return f"{said}; this law is wrong, and so is its mu(0): whether breakaway ages, a law that fits will tell"
        return said

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to say where breakaway ages."""
        if not self.ages:
            return ()
        if self.growth is not None:
            return (
                f"Breakaway ages: it grows by {self.growth:.4f} ± {self.growth_deviation:.1g} with every decade of "
                "time in stick (law 'Conti+ageing'). Slips do not show it; the static coefficient is that of mu(0).",
            )
        return (
            f"Breakaway ages: sticks let go at {self.excess:.4f} ± {self.excess_deviation:.1g} above the friction that "
            "the slips have at rest (law 'Conti+ageing'). How fast it grows they do not say, for they span less than a "
            "decade of time: record holds, the drive stopped for 0.3 to 30 s and started again.",
        )


@dataclass(frozen=True, eq=False)
class _Sticks:
    """The sticks of all logs, on grids of their own. time: (n, K) s, samples; seen: (n, K) rad, theta; turned:
    (n, K) rad, Phi - Phi_0; used: (n, K); grid: (n,) s, begin of the drive's; speed, ramp: (n, G) rad/s and rad/s^2,
    of the drive every `STEP`; begins, ends: (n,) s, of the stick as the slip speed shows; log: (n,); sign: (n,)."""

    time: np.ndarray
    seen: np.ndarray
    turned: np.ndarray
    used: np.ndarray
    grid: np.ndarray
    speed: np.ndarray
    ramp: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    log: np.ndarray
    sign: np.ndarray


@dataclass(frozen=True, eq=False)
class Constants:
    """What was taken as given. held: constants; covariance: (n, n) of their logarithms; shifts: (m, n) of the law by
    these; others: what was estimated, by name, constants among it."""

    held: tuple[Prior, ...]
    covariance: np.ndarray
    shifts: np.ndarray
    others: Mapping[str, float]


def breakaway(
    ready: Pool, law: FittableLaw, q: np.ndarray, covariance: np.ndarray, constants: Constants
) -> Breakaway | None:
    """Breakaway of the sticks of one driving disc; None where too few can be followed.

    q: (m,) fitted law; covariance: (m, m) of it.
    """
    sticks = _sticks(ready)
    if sticks is None:
        return None
    known = {prior.name: constants.others.get(prior.name, prior.value) for prior in ready.priors}
    known |= {prior.name: prior.value for prior in constants.held}
    start = _first(sticks, ready)
    found, good = _searched(sticks, law, q, rig_values(known), start, STEPS)
    good &= np.abs(_ramp(sticks, rig_values(known), found)) < UNEVEN
    if np.count_nonzero(good) < FEWEST:
        return None
    kept, found = _only(sticks, good), found[good]

    def moved(q: np.ndarray, known: dict[str, float]) -> np.ndarray:
        rig = rig_values(known)
        there, _ = _searched(kept, law, q, rig, found, 1)
        return _excess(kept, law, q, rig, there)

    beyond = moved(q, known)
    held = np.maximum(found[:, 1] - kept.begins, STEP)
    decades = np.log10(1 + held / T_0)
    average = np.full(len(held), 1 / len(held))
    # the little that short sticks have aged is told less surely: of enough holds these alone tell the growth
    holds = held > HOLD * np.median(held)
    alone = np.count_nonzero(holds) >= FEWEST and float(np.ptp(decades[holds])) >= DECADE
    chosen = holds if alone else np.ones(len(held), dtype=bool)
    spans = float(np.ptp(decades[chosen])) >= DECADE
    spread = np.where(chosen, decades - decades[chosen].mean(), 0.0)
    slope = spread / float(spread @ spread) if spans else average
    # too little to be told needs no deviation of what it would be
    told = spans or beyond.mean() >= UNTOLD
    steps = np.diag(1e-3 * np.maximum(np.abs(q), 1e-3)) if told else np.zeros((0, len(q)))
    by_law = [(moved(q + step, known) - beyond) / step.max() for step in steps]
    by_rig = [
        (moved(q + SHARE * shift, known | {one.name: one.value * (1 + SHARE)}) - beyond) / SHARE
        for one, shift in zip(constants.held if told else (), constants.shifts.T, strict=False)
    ]
    spare = beyond - beyond[chosen].mean() - (spread * float(slope @ beyond) if spans else 0.0)

    def deviation(weights: np.ndarray, own: np.ndarray) -> float:
        count = np.count_nonzero(weights)
        scatter = float((weights**2) @ own**2) * count / max(count - 2, 1)
        if not told:
            return float(np.hypot(np.sqrt(scatter), 0.5 * UNTOLD))
        law_slope, rig_slope = (np.array([weights @ one for one in made]) for made in (by_law, by_rig))
        return float(
            np.sqrt(scatter + law_slope @ covariance @ law_slope + rig_slope @ constants.covariance @ rig_slope)
        )

    at_rest = float(law.value(law.along(np.zeros(1), kept.sign[0]), q)[0])
    rest = np.array([float(law.value(law.along(np.zeros(1), sign), q)[0]) for sign in kept.sign])
    level = rest + beyond
    return Breakaway(
        level=float(level.mean()),
        deviation=float(np.std(level, ddof=1) / np.sqrt(len(level))),
        at_rest=at_rest,
        excess=float(beyond.mean()),
        excess_deviation=deviation(average, beyond - beyond.mean()),
        growth=float(slope @ beyond) if spans else None,
        growth_deviation=deviation(slope, spare) if spans else None,
        releases=tuple(
            Release(int(log), float(time), float(stick), float(value))
            for log, time, stick, value in zip(kept.log, found[:, 1], held, level, strict=True)
        ),
    )


def _sticks(ready: Pool) -> _Sticks | None:
    """What is looked at of every stick that a slip follows; None where there is none."""
    values, period = ready.values, ready.natural_period
    window = SMOOTHING * period
    rows: list[tuple[np.ndarray | float, ...]] = []
    for log, motion in enumerate(ready.motions):
        step = motion.step
        before, after, trim = (round(one * period / step) for one in (BEFORE, AFTER, TRIM * SMOOTHING))
        slip = motion.slip(values.r, values.R, window)[0]
        phi = drive_angle(motion, int(motion.log.contacts[0][-1]))
        ramp = savitzky_golay(motion.drive, step, RAMP * period, 2, 1)
        stuck = [(int(a), int(b)) for a, b in stretches(np.abs(slip) < ready.threshold)]
        length = round((AFTER + BEFORE) * period / STEP) + 2
        for (start, end), (until, _) in zip(stuck, [*stuck[1:], (len(slip), 0)], strict=True):
            first, last = end - before, end + after
            if start == 0 or last >= min(until, len(slip)) or first < 1 or motion.filled[start:last].any():
                continue
            place = np.arange(first, last)
            used = place >= start + trim
            if np.count_nonzero(used[: max(before - after, 0)]) * step < SHORTEST * period:
                continue
            fall = max(abs(slip[max(start - trim, 0)]) - ready.threshold, 1e-9) / (trim * step)
            time = motion.time[place]
            grid = time[0] + STEP * np.arange(length)
            rows.append(
                (
                    time,
                    motion.angle[place],
                    phi[place] - phi[first],
                    used,
                    float(time[0]),
                    np.interp(grid, motion.time, motion.drive),
                    np.interp(grid, motion.time, ramp),
                    float(motion.time[start]) + min(ready.threshold / fall, window),
                    float(motion.time[end]),
                    log,
                    float(np.sign(slip[min(last, len(slip) - 1)])),
                )
            )
    if len(rows) < FEWEST:
        return None
    # logs of other rates have other counts
    shortest = min(len(np.atleast_1d(row[0])) for row in rows)
    columns = [
        np.stack([np.asarray(one) for one in column])
        if i > 3
        else np.stack([np.atleast_1d(one)[-shortest:] for one in column])
        for i, column in enumerate(zip(*rows, strict=True))
    ]
    return _Sticks(*columns)


def _only(sticks: _Sticks, chosen: np.ndarray) -> _Sticks:
    return replace(sticks, **{name: value[chosen] for name, value in vars(sticks).items()})


def _first(sticks: _Sticks, ready: Pool) -> np.ndarray:
    """First guess (n, 2): theta_0, rad, and t_r, s, before slip is seen by half of what it takes without ageing."""
    rig = ready.values
    sooner = np.sqrt(2 * ready.threshold * rig.J / np.maximum(rig.k * rig.r * np.abs(sticks.speed[:, -1]), 1e-9))
    release = sticks.ends - np.clip(0.5 * sooner, 2e-3, 0.5 * BEFORE * ready.natural_period)
    inside = sticks.used & (sticks.time <= release[:, None])
    left = np.where(inside, sticks.seen - rig.r / rig.R * sticks.turned, 0.0)
    offset = np.sum(left, axis=1) / np.maximum(inside.sum(axis=1), 1)
    return np.stack([offset, release], axis=1)


def _searched(
    sticks: _Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, start: np.ndarray, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """theta_0 and t_r (n, 2) of each stick by Gauss-Newton steps, and which have been found."""
    at, h = start.copy(), np.array([1e-5, 2e-4])
    low, high = sticks.time[:, 0] + STEP, sticks.time[:, -1] - STEP
    last = np.full(len(at), np.inf)
    for _ in range(steps):
        three = at + np.array([[0.0, 0.0], [h[0], 0.0], [0.0, h[1]]])[:, None]
        here, by_offset, by_time = _off(sticks, law, q, rig, three)
        A = np.stack([(by_offset - here) / h[0], (by_time - here) / h[1]], axis=-1)
        normal = np.einsum("nka,nkb->nab", A, A)
        right = np.einsum("nka,nk->na", A, here)
        scale = np.sqrt(np.maximum(np.einsum("naa->na", normal), 1e-300))
        even = normal / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(2)
        moved = -np.linalg.solve(even, (right / scale)[..., None])[..., 0] / scale
        moved[:, 1] = np.clip(moved[:, 1], -LONGEST_STEP, LONGEST_STEP)
        at = at + moved
        at[:, 1] = np.clip(at[:, 1], low, high)
        last = np.abs(moved[:, 1])
        if np.all(last < SETTLED):
            break
    inside = (at[:, 1] > low) & (at[:, 1] < high)
    return at, inside & (last < FOUND)


def _off(sticks: _Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, at: np.ndarray) -> np.ndarray:
    """Model minus measurement (3, n, K), rad, at theta_0 and t_r (3, n, 2)."""
    offset, release = at[..., 0], at[..., 1]
    count = sticks.speed.shape[1]
    sign = sticks.sign

    def drive(elapsed: float) -> np.ndarray:
        place = np.clip((release + elapsed - sticks.grid) / STEP, 0, count - 1.001)
        index = place.astype(int)
        low, high = (np.take_along_axis(sticks.speed, one.T, axis=1).T for one in (index, index + 1))
        return low + (place - index) * (high - low)

    def rate(w: np.ndarray, theta: np.ndarray, omega: np.ndarray) -> np.ndarray:
        slip = np.maximum(sign * (rig.r * w - rig.R * omega), 0.0)
        friction = rig.R * rig.N * sign * law.value(law.along(slip, sign), q)
        return (friction - rig.c * omega - rig.k * theta) / rig.J

    w = drive(0.0)
    theta, omega = offset + rig.r / rig.R * _turned(sticks, release), rig.r * w / rig.R
    path = [(theta, omega)]
    for number in range(count - 1):
        middle, after = drive((number + 0.5) * STEP), drive((number + 1.0) * STEP)
        a1 = rate(w, theta, omega)
        a2 = rate(middle, theta + STEP / 2 * omega, omega + STEP / 2 * a1)
        a3 = rate(middle, theta + STEP / 2 * omega + STEP**2 / 4 * a1, omega + STEP / 2 * a2)
        a4 = rate(after, theta + STEP * omega + STEP**2 / 2 * a2, omega + STEP * a3)
        theta = theta + STEP * omega + STEP**2 / 6 * (a1 + a2 + a3)
        omega = omega + STEP / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        path.append((theta, omega))
        w = after
    places, speeds = (np.stack([one[i] for one in path], axis=-1) for i in (0, 1))
    elapsed = (sticks.time[None] - release[..., None]) / STEP
    index = np.clip(elapsed.astype(int), 0, count - 2)
    s = np.clip(elapsed - index, 0.0, 1.0)
    p0, p1 = (np.take_along_axis(places, index + more, axis=-1) for more in (0, 1))
    m0, m1 = (STEP * np.take_along_axis(speeds, index + more, axis=-1) for more in (0, 1))
    bend = s**2 * (3 - 2 * s)
    slipped = p0 + bend * (p1 - p0) + s * (1 - s) * ((1 - s) * m0 - s * m1)
    model = np.where(elapsed < 0, offset[..., None] + rig.r / rig.R * sticks.turned, slipped)
    return np.where(sticks.used, model - sticks.seen, 0.0)


def _turned(sticks: _Sticks, release: np.ndarray) -> np.ndarray:
    """Phi - Phi_0 at t_r (..., n), rad; samples are even."""
    place = (release - sticks.time[:, 0]) / (sticks.time[:, 1] - sticks.time[:, 0])
    index = np.clip(place.astype(int), 0, sticks.time.shape[1] - 2)
    rows = np.arange(len(sticks.time))
    low, high = sticks.turned[rows, index], sticks.turned[rows, index + 1]
    return low + (place - index) * (high - low)


def _excess(sticks: _Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, at: np.ndarray) -> np.ndarray:
    """Level of each stick beyond the law at rest (n,)."""
    release, rows = at[:, 1], np.arange(len(at))
    index = np.clip(((release - sticks.grid) / STEP).astype(int), 0, sticks.speed.shape[1] - 1)
    speed = sticks.speed[rows, index]
    theta = at[:, 0] + rig.r / rig.R * _turned(sticks, release)
    carried = (rig.r / rig.R * rig.c * speed + rig.k * theta) / (rig.R * rig.N) + _ramp(sticks, rig, at)
    return sticks.sign * carried - law.value(law.along(np.zeros(len(at)), sticks.sign), q)


def _ramp(sticks: _Sticks, rig: RigValues, at: np.ndarray) -> np.ndarray:
    """What the acceleration of the drive adds to the level of each stick (n,)."""
    index = np.clip(((at[:, 1] - sticks.grid) / STEP).astype(int), 0, sticks.ramp.shape[1] - 1)
    return rig.r / rig.R * rig.J * sticks.ramp[np.arange(len(at)), index] / (rig.R * rig.N)
