"""A test bench of one driven disc, emulated without anything of ours: what estimators are judged by.

    J theta'' = -k theta (1 + k3 theta^2) - c omega - c2 |omega| omega + M(t, theta) + R F
    slip:  F = s N mu(|v|) A,  v = r w - R omega,  s = sign v;      stick: v = 0 while |F| <= N mu(0) A

A = factor(t, theta, log, angle of the drive) (1 + sided s), M a torque of whatever is beside. A piece of slip is
integrated by SciPy's DOP853, one of stick follows the drive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

RATE = 4000.0  # Hz, of the motion that instruments see
TRANSIENT = 5.0  # s, before the log
TICK = 2e-4  # s, of the search for the end of a stick
LEAST = 1e-9  # m/s, with which a slip begins


@dataclass(frozen=True)
class Bench:
    """The truth in SI units; ripple: of the drive, once and eight times a turn; hunting: rms of its slow unevenness."""

    mu: Callable[[float], float]
    J: float = 0.0548
    k: float = 2.62
    c: float = 0.055
    R: float = 0.125
    r: float = 0.06
    N: float = 4.905
    k3: float = 0.0
    c2: float = 0.0
    factor: Callable[[float, float, int, float], float] = lambda time, angle, log, turned: 1.0
    sided: float = 0.0
    torque: Callable[[float, float], float] = lambda time, angle: 0.0
    ripple: tuple[float, float] = (0.004, 0.001)
    hunting: float = 0.0015

    def free(self, time: float, angle: float, speed: float) -> float:
        """Torque of spring, damping and what is beside, N m."""
        own = -self.k * angle * (1 + self.k3 * angle**2) - (self.c + self.c2 * abs(speed)) * speed
        return own + self.torque(time, angle)

    def most(self, time: float, angle: float, log: int, turned: float, force: float) -> float:
        """Force that breaks a stick away where it carries this one, N."""
        one_sided = 1 + self.sided * float(np.sign(force))
        return self.N * self.mu(0.0) * self.factor(time, angle, log, turned) * one_sided


class Drive:
    """A drive that turns unevenly: times (n,) s, angles (n,) rad, speeds (n,) rad/s."""

    def __init__(self, bench: Bench, speed: float, end: float, rng: np.random.Generator) -> None:
        self.time = np.arange(-TRANSIENT - 1.0, end + 0.5, 1e-3)
        slow = np.zeros(len(self.time))
        for rate in rng.uniform(0.3, 4.0, 8):
            slow += 0.5 * bench.hunting * np.sin(2 * np.pi * (rate * self.time + rng.uniform()))
        once, eighth, first = rng.uniform(0, 2 * np.pi, 3)
        self.angle = first + speed * self.time
        for _ in range(4):
            even = (
                1
                + slow
                + bench.ripple[0] * np.sin(self.angle + once)
                + bench.ripple[1] * np.sin(8 * self.angle + eighth)
            )
            self.angle = first + speed * np.concatenate([[0.0], np.cumsum(0.5e-3 * (even[1:] + even[:-1]))])
        self.speed = np.gradient(self.angle, self.time)
        self.rate = np.gradient(self.speed, self.time)

    def turned(self, time: float) -> float:
        """Angle."""
        return float(np.interp(time, self.time, self.angle))

    def at(self, time: float) -> tuple[float, float]:
        """Speed and acceleration."""
        number = min(max(int((time - self.time[0]) / 1e-3), 0), len(self.time) - 2)
        share = (time - self.time[number]) / 1e-3
        both = (row[number] + share * (row[number + 1] - row[number]) for row in (self.speed, self.rate))
        speed, rate = both
        return float(speed), float(rate)


def slips_and_sticks(
    bench: Bench, drive: Drive, end: float, log: int, let_go: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) s from 0 to ``end`` and angles (n,) rad of a body that begins at rest on its drive, or that is let go
    at an angle in rad while that turns."""
    grid = np.arange(round(-TRANSIENT * RATE), round(end * RATE)) / RATE
    angles = np.zeros(len(grid))
    time, ratio = -TRANSIENT - 0.5, bench.r / bench.R
    angle, speed, sign, sticks = let_go or 0.0, ratio * drive.at(time)[0], 1.0, let_go is None
    while time < end:
        begin = time
        if sticks:
            time, angle, speed, sign, sticks = _stick(bench, drive, (time, angle), end, log)
            base = np.interp(time, drive.time, drive.angle)
            inside = (grid >= begin) & (grid < time)
            angles[inside] = angle + ratio * (np.interp(grid[inside], drive.time, drive.angle) - base)
        else:
            speed, let_go = (bench.r * drive.at(time)[0] - sign * LEAST) / bench.R if let_go is None else 0.0, None
            run = _slip(bench, drive, (time, angle, speed, sign), end, log)
            time, (angle, speed) = float(run.t[-1]), run.y[:, -1]
            inside = (grid >= begin) & (grid < time)
            if inside.any():
                angles[inside] = run.sol(grid[inside])[0]
            force = _held(bench, drive, time, angle)
            sticks = abs(force) <= bench.most(time, angle, log, drive.turned(time), force)
            sign = float(np.sign(force))
    return grid[grid >= 0], angles[grid >= 0]


def _held(bench: Bench, drive: Drive, time: float, angle: float) -> float:
    """Force that keeps the body on its drive, N."""
    speed, rate = drive.at(time)
    ratio = bench.r / bench.R
    return (bench.J * ratio * rate - bench.free(time, angle, ratio * speed)) / bench.R


def _stick(
    bench: Bench, drive: Drive, start: tuple[float, float], end: float, log: int
) -> tuple[float, float, float, float, bool]:
    """Time, angle, speed and direction at which a stick lets go, or as far as it was followed."""
    time, angle = start
    ratio, off = bench.r / bench.R, 0.0

    def over(time: float) -> tuple[float, float, float]:
        there = angle + ratio * float(np.interp(time, drive.time, drive.angle) - off)
        force = _held(bench, drive, time, there)
        return abs(force) - bench.most(time, there, log, drive.turned(time), force), there, force

    off = float(np.interp(time, drive.time, drive.angle))
    before, there, force = over(time)
    while before < 0 and time < end:
        after, there, force = over(time + TICK)
        step = TICK if after < 0 else TICK * before / (before - after)
        time, before = time + step, after
    there = over(time)[1]
    return time, there, ratio * drive.at(time)[0], float(np.sign(force)), time >= end


def _slip(bench: Bench, drive: Drive, start: tuple[float, float, float, float], end: float, log: int):
    """SciPy's solution until the body is as fast as its drive again."""
    time, angle, speed, sign = start

    def rates(time: float, state: np.ndarray) -> list[float]:
        slip = max(sign * (bench.r * drive.at(time)[0] - bench.R * state[1]), 0.0)
        share = bench.factor(time, state[0], log, drive.turned(time)) * (sign + bench.sided)
        return [state[1], (bench.free(time, state[0], state[1]) + bench.R * bench.N * bench.mu(slip) * share) / bench.J]

    def meets(time: float, state: np.ndarray) -> float:
        return sign * (bench.r * drive.at(time)[0] - bench.R * state[1])

    meets.terminal, meets.direction = True, -1  # type: ignore[attr-defined]
    return solve_ivp(
        *(rates, (time, end + 1e-3), [angle, speed], "DOP853"),
        dense_output=True,
        events=meets,
        rtol=1e-9,
        atol=1e-11,
        max_step=0.02,
        first_step=1e-6,
    )


def free_decay(bench: Bench, end: float, start: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) s and angles (n,) rad of a body that nothing touches."""
    grid = np.arange(round(end * RATE)) / RATE
    run = solve_ivp(
        lambda time, state: [state[1], bench.free(time, state[0], state[1]) / bench.J],
        *((0, end), [start, 0.0], "DOP853"),
        t_eval=grid,
        rtol=1e-10,
        atol=1e-12,
    )
    return grid, run.y[0]


class Ruling:
    """An encoder whose lines lie up to ``error`` pitches off."""

    def __init__(self, rng: np.random.Generator, lines: int = 1000, error: float = 0.02) -> None:
        self.pitch, self.phase = 2 * np.pi / lines, rng.random()
        self.errors = error * rng.uniform(-1, 1, lines)

    def read(self, time: np.ndarray, angle: np.ndarray, ticks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Count and time of the last edge at each tick (n,), of a motion that is straight between its times."""
        where = angle / self.pitch + self.phase
        below = np.floor(where).astype(int) - 1
        count = below.copy()
        for edge in (below + 1, below + 2):
            count = np.where(where >= edge + self.errors[edge % len(self.errors)], edge, count)
        stamps, counts = [float(time[0])], [int(count[0])]
        for number in np.flatnonzero(np.diff(count)):
            first, last = int(count[number]), int(count[number + 1])
            for edge in range(first + 1, last + 1) if last > first else range(first, last, -1):
                level = edge + self.errors[edge % len(self.errors)]
                share = (level - where[number]) / (where[number + 1] - where[number])
                stamps.append(float(time[number] + share * (time[number + 1] - time[number])))
                counts.append(edge if last > first else edge - 1)
        latest = np.maximum(np.searchsorted(stamps, ticks, side="right") - 1, 0)
        return np.array(counts)[latest].astype(float), np.floor(np.array(stamps)[latest] * 1e6) / 1e6
