"""The motion about the release of every stick of one driving disc, and what it says of the force that was carried last.

    stick    theta = theta_0 + r/R (Phi - Phi_0),   Phi angle of the drive, up to the release at t_r
    slip     J theta'' + c theta' + k theta = R N mu(|v|) sgn(v),   v = r w - R theta',   from t_r on, fitted law
    level    (J r w'/R + c r w/R + k theta(t_r))/(R N) = mu(0) + x,   that of the force that the stick carried last

theta_0 and x^2 of each stick are found by Gauss-Newton steps from the angle in stick and in the first part of the slip.
Why x^2: a stick that holds on for d longer than the law has it lets go with a jump of the acceleration that grows with
d, and catches up with what it lost by then; to first order in d the motion is the same, so that it depends on x only
by x^2. Its estimate is linear in the noise, and may be below 0; that of x is pushed up by any noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.laws.law import FittableLaw
from identification.measurement.motion import SMOOTHING, drive_angle, savitzky_golay
from identification.measurement.pooled import Pool, RigValues, speed_name
from rig_io.logs.log import stretches

STEP = 8e-3  # s, of the motion from the release on
BEFORE, AFTER = 0.4, 0.08  # natural periods about the instant at which slip is seen: slow drives let go long before
TRIM = 1.0  # smoothing windows at the begin of a stick, where the contact may ring
SHORTEST = 0.02  # natural periods of stick that must be left
RAMP = 0.045  # natural periods over which the drive's acceleration is taken
STEPS, LONGEST_STEP = 10, 4e-3  # of the search; of x^2
SETTLED, FOUND = 1e-7, 1e-3  # of x^2, the last step: where a search ends; where one that knows no better has come to
LEAST, HIGHEST = 4e-3, 0.3  # of x: below, slip is linear in x^2 to its noise; and the most that is looked for
OFFSET_STEP, EXCESS_STEP = 1e-5, 2e-3  # rad; of x: for derivatives
NEWTON = 5  # steps towards the release
SLOWEST = 1e-3  # 1/s, growth of the level
FEWEST = 5  # sticks, below which their spread is not known


@dataclass(frozen=True, eq=False)
class Sticks:
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


def sticks_of(ready: Pool) -> Sticks | None:
    """What is read from every stick that a slip follows; None where there is none."""
    values, period = ready.values, ready.natural_period
    window = SMOOTHING * period
    rows: list[tuple[np.ndarray | float, ...]] = []
    for log, motion in enumerate(ready.motions):
        step = motion.step
        before, after, trim = (round(duration * period / step) for duration in (BEFORE, AFTER, TRIM * SMOOTHING))
        slip = motion.slip(values.r, values.R, window)[0]
        phi = drive_angle(motion, int(motion.log.contacts[0][-1]))
        ramp = savitzky_golay(motion.drive, step, RAMP * period, 2, 1)
        stuck = [(int(a), int(b)) for a, b in stretches(np.abs(slip) < ready.threshold)]
        length = round((AFTER + BEFORE) * period / STEP) + 2
        for (start, end), (until, _) in zip(stuck, [*stuck[1:], (len(slip), 0)], strict=False):
            first, last = end - before, end + after
            if start == 0 or last >= min(until, len(slip)) or first < 1 or motion.filled[start:last].any():
                continue
            samples = np.arange(first, last)
            used = samples >= start + trim
            if np.count_nonzero(used[: max(before - after, 0)]) * step < SHORTEST * period:
                continue
            fall = max(abs(slip[max(start - trim, 0)]) - ready.threshold, 1e-9) / (trim * step)
            time = motion.time[samples]
            grid = time[0] + STEP * np.arange(length)
            seen = (time, motion.angle[samples], phi[samples] - phi[first], used)
            drive = (np.interp(grid, motion.time, values) for values in (motion.drive, ramp))
            begins = float(motion.time[start]) + min(ready.threshold / fall, window)
            sign = float(np.sign(slip[min(last, len(slip) - 1)]))
            rows.append((*seen, float(time[0]), *drive, begins, float(motion.time[end]), log, sign))
    if len(rows) < FEWEST:
        return None
    # logs of other rates have other counts
    shortest = min(len(np.atleast_1d(row[0])) for row in rows)
    columns = [
        np.stack([np.asarray(entry) for entry in column])
        if i > 3
        else np.stack([np.atleast_1d(entry)[-shortest:] for entry in column])
        for i, column in enumerate(zip(*rows, strict=True))
    ]
    return Sticks(*columns)


def sensed(sticks: Sticks, values: Mapping[str, float], ready: Pool) -> Sticks:
    """What sensors show once what was found of them is taken off: gain and zero of a laser, speeds of the drives."""
    gain = values.get("laser", 1.0) * (1 + values.get("gain", ready.sensors.gain)) / (1 + ready.sensors.gain)
    radius = ready.values.R
    if ready.laser_alone:  # it measures R sin(angle)
        gain *= radius / values["R"]
    sines = gain * (np.sin(sticks.seen) - values.get("zero", 0.0) / radius)
    over = np.array([values.get(speed_name(int(log)), 1.0) for log in sticks.log])[:, None]
    drives = {name: getattr(sticks, name) * over for name in ("turned", "speed", "ramp")}
    return replace(sticks, seen=np.arcsin(sines), **drives)


def only(sticks: Sticks, chosen: np.ndarray) -> Sticks:
    return replace(sticks, **{name: value[chosen] for name, value in vars(sticks).items()})


def first_guess(sticks: Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, ready: Pool) -> np.ndarray:
    """First guess (n, 2): theta_0, rad, and x^2."""
    offset, release = first_releases(sticks, rig, ready)
    beyond, _ = _excess(sticks, law, q, rig, offset, release)
    return np.stack([offset, np.clip(beyond, 0.0, HIGHEST) ** 2], axis=1)


def first_releases(sticks: Sticks, rig: RigValues, ready: Pool) -> tuple[np.ndarray, np.ndarray]:
    """First guess of theta_0 (n,), rad, and of when each stick lets go (n,), s: before slip is seen by half of what
    that takes without ageing."""
    sooner = np.sqrt(2 * ready.threshold * rig.J / np.maximum(rig.k * rig.r * np.abs(sticks.speed[:, -1]), 1e-9))
    release = sticks.ends - np.clip(0.5 * sooner, 2e-3, 0.5 * BEFORE * ready.natural_period)
    inside = sticks.used & (sticks.time <= release[:, None])
    residual = np.where(inside, sticks.seen - rig.r / rig.R * sticks.turned, 0.0)
    return np.sum(residual, axis=1) / np.maximum(inside.sum(axis=1), 1), release


@dataclass(frozen=True, eq=False)
class StickSearch:
    """Where a search ended. at: (n, 2) theta_0, rad, and x^2; weight: (n,) how much the motion says of x^2; good: (n,)
    whether a stick was found."""

    at: np.ndarray
    weight: np.ndarray
    good: np.ndarray


def searched(
    sticks: Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, start: np.ndarray, steps: int
) -> StickSearch:
    """theta_0 and x^2 of each stick by Gauss-Newton steps from (n, 2)."""
    at = start.copy()
    good, weight = np.ones(len(at), dtype=bool), np.ones(len(at))
    for _ in range(steps):
        excess = np.sqrt(np.maximum(at[:, 1], LEAST**2))
        offsets = at[:, 0] + np.array([[0.0], [OFFSET_STEP], [0.0]])
        beyond = excess + np.array([[0.0], [0.0], [EXCESS_STEP]])
        release = release_of(sticks, law, q, rig, offsets, beyond)
        residual, by_offset, by_excess = _off(sticks, law, q, rig, np.stack([offsets, release], axis=-1))
        by_square = (by_excess - residual) / (EXCESS_STEP * (2 * excess + EXCESS_STEP))[:, None]
        A = np.stack([(by_offset - residual) / OFFSET_STEP, by_square], axis=-1)
        residual = residual + (at[:, 1] - excess**2)[:, None] * by_square
        normal = np.einsum("nka,nkb->nab", A, A)
        right = np.einsum("nka,nk->na", A, residual)
        scale = np.sqrt(np.maximum(np.einsum("naa->na", normal), 1e-300))
        even = normal / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(2)
        moved = -np.linalg.solve(even, (right / scale)[..., None])[..., 0] / scale
        moved[:, 1] = np.clip(moved[:, 1], -LONGEST_STEP, LONGEST_STEP)
        at = at + moved
        weight = normal[:, 1, 1] * (1 - even[:, 0, 1] ** 2)
        inside = (release[0] > sticks.time[:, 0] + STEP) & (release[0] < sticks.time[:, -1] - STEP)
        good = inside & (np.abs(moved[:, 1]) < FOUND) & (at[:, 1] < HIGHEST**2)
        if np.all(np.abs(moved[:, 1]) < SETTLED):
            break
    return StickSearch(at, weight, good)


def release_of(
    sticks: Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, offset: np.ndarray, excess: np.ndarray
) -> np.ndarray:
    """When the stick carries mu(0) + x: t_r (..., n), s. offset: (..., n) rad, theta_0; excess: (..., n), x."""
    release = np.broadcast_to(sticks.ends, offset.shape)
    for _ in range(NEWTON):
        beyond, growth = _excess(sticks, law, q, rig, offset, release)
        release = np.clip(release + (excess - beyond) / growth, sticks.time[:, 0], sticks.time[:, -1])
    return release


def _off(sticks: Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, at: np.ndarray) -> np.ndarray:
    """Model minus measurement (3, n, K), rad, at theta_0 and t_r (3, n, 2)."""
    offset, release = at[..., 0], at[..., 1]
    count = sticks.speed.shape[1]
    sign = sticks.sign

    def drive(elapsed: float) -> np.ndarray:
        position = np.clip((release + elapsed - sticks.grid) / STEP, 0, count - 1.001)
        index = position.astype(int)
        low, high = (np.take_along_axis(sticks.speed, indices.T, axis=1).T for indices in (index, index + 1))
        return low + (position - index) * (high - low)

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
    places, speeds = (np.stack([state[i] for state in path], axis=-1) for i in (0, 1))
    elapsed = (sticks.time[None] - release[..., None]) / STEP
    index = np.clip(elapsed.astype(int), 0, count - 2)
    s = np.clip(elapsed - index, 0.0, 1.0)
    p0, p1 = (np.take_along_axis(places, index + shift, axis=-1) for shift in (0, 1))
    m0, m1 = (STEP * np.take_along_axis(speeds, index + shift, axis=-1) for shift in (0, 1))
    bend = s**2 * (3 - 2 * s)
    slipped = p0 + bend * (p1 - p0) + s * (1 - s) * ((1 - s) * m0 - s * m1)
    model = np.where(elapsed < 0, offset[..., None] + rig.r / rig.R * sticks.turned, slipped)
    return np.where(sticks.used, model - sticks.seen, 0.0)


def _turned(sticks: Sticks, release: np.ndarray) -> np.ndarray:
    """Phi - Phi_0 at t_r (..., n), rad; samples are even."""
    position = (release - sticks.time[:, 0]) / (sticks.time[:, 1] - sticks.time[:, 0])
    index = np.clip(position.astype(int), 0, sticks.time.shape[1] - 2)
    rows = np.arange(len(sticks.time))
    low, high = sticks.turned[rows, index], sticks.turned[rows, index + 1]
    return low + (position - index) * (high - low)


def _excess(
    sticks: Sticks, law: FittableLaw, q: np.ndarray, rig: RigValues, offset: np.ndarray, release: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What each stick carries beyond the law at rest (..., n), and how fast that grows, 1/s."""
    level, growth = carried(sticks, rig, offset, release)
    return level - law.value(law.along(np.zeros(len(sticks.sign)), sticks.sign), q), growth


def carried(sticks: Sticks, rig: RigValues, offset: np.ndarray, release: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Friction coefficient of the force that each stick carries when it lets go (..., n), and its growth, 1/s."""
    position = np.clip((release - sticks.grid) / STEP, 0, sticks.speed.shape[1] - 1.001)
    index, rows = position.astype(int), np.arange(release.shape[-1])
    low, high = ((sticks.speed[rows, column], sticks.ramp[rows, column]) for column in (index, index + 1))
    speed, ramp = (a + (position - index) * (b - a) for a, b in zip(low, high, strict=True))
    turned = rig.r / rig.R * _turned(sticks, release)
    level = (rig.r / rig.R * (rig.J * ramp + rig.c * speed) + rig.k * (offset + turned)) / (rig.R * rig.N)
    return sticks.sign * level, np.maximum(sticks.sign * rig.spring * rig.r / rig.R * speed, SLOWEST)
