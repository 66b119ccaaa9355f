"""What scenes of the literature call "computed", of systems that are forced."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
from scipy.linalg import expm
from scipy.optimize import root, root_scalar
from smooth_cycles import cycle, eigenvalues, named


def nordmark() -> dict[str, Any]:
    """Two free steps, one impact: root of one equation for the depth x of the impact."""
    alpha, gamma, tau2, rho = map(mp.mpf, ("0.65", "0.05", "0.9", "0.12"))

    def after(x, y):
        x, y = -mp.sqrt(x) + y + rho, -gamma * tau2 * x
        for _ in range(2):
            x, y = alpha * x + y + rho, -gamma * x
        return x, y

    depth, second = mp.findroot(lambda x, y: [after(x, y)[0] - x, after(x, y)[1] - y], (0.114, 0.001))
    free = mp.matrix([[alpha, 1], [-gamma, 0]])
    slopes = free * free * mp.matrix([[-1 / (2 * mp.sqrt(depth)), 1], [-gamma * tau2, 0]])
    return {"x_min": -mp.sqrt(depth) + second + rho, "x_max": depth, "multiplier1_real": eigenvalues(slopes)[0].real}


def ueda() -> dict[str, Any]:
    def rates(t, x):
        return np.array([x[1], 7.5 * np.cos(t) - 0.05 * x[1] - x[0] ** 3])

    return named(cycle(rates, (2.27, -0.26), 2 * np.pi, forced=True), *"xv", only="x v multiplier1_real")


def duffing() -> dict[str, Any]:
    def rates(t, x):
        return np.array([x[1], 0.1 * np.cos(t) - 0.25 * x[1] + x[0] - x[0] ** 3])

    return named(cycle(rates, (1.1, 0.03), 2 * np.pi, forced=True), *"xv", only="x v")


def den_hartog(mu: float) -> dict[str, Any]:
    """Released from rest at A where cos(omega t) = A - mu, it comes to rest at -A."""
    w, friction = mp.mpf("0.7"), mp.mpf(mu)
    a = 1 / (1 - w * w)

    def misses(A, length):
        t0 = mp.acos(A - friction) / w
        free, rate = A - friction - a * mp.cos(w * t0), a * w * mp.sin(w * t0)
        t, c, s = t0 + length, mp.cos(length), mp.sin(length)
        x = friction + a * mp.cos(w * t) + free * c + rate * s
        return [x + A, -a * w * mp.sin(w * t) - free * s + rate * c]

    return {"x_max": mp.findroot(misses, {0.8: (1.3, 4.18), 0.95: (0.0164, 1.46)}[mu])[0]}


def impact_oscillator() -> dict[str, Any]:
    """x = a cos(omega t) + free motion from the wall back to it: two equations for phase and speed of the impact."""
    w, r = 2.8, 0.8
    a = 1 / (1 - w * w)

    def after(t0, speed, t):
        """Place and speed at t, since an impact at t0 from which it goes at that speed."""
        free = np.array([-a * np.cos(w * t0), speed + a * w * np.sin(w * t0)])
        turn = np.array([[np.cos(t - t0), np.sin(t - t0)], [-np.sin(t - t0), np.cos(t - t0)]])
        return turn @ free + [a * np.cos(w * t), -a * w * np.sin(w * t)]

    period = 2 * np.pi / w
    t0, speed = root(
        lambda u: after(u[0], u[1], u[0] + period) + np.array([0.0, u[1] / r]), [3.06 / w, -0.27], tol=1e-15
    ).x
    x, v = after(t0, speed, period)
    # of x' := -r x' at the wall, with the times of arrival that differ
    push, before = np.cos(w * t0), -speed / r
    jump = np.array([[-r, 0.0], [(1 + r) * push / before, -r]])
    turn = np.array([[np.cos(period), np.sin(period)], [-np.sin(period), np.cos(period)]])
    order = sorted(np.linalg.eigvals(jump @ turn), key=lambda m: -abs(m))
    return {"x": x, "v": v, "multiplier1_real": order[0].real}


# of the buck converter: v' and i' by v and i, the period, the rise of the ramp, how the switch sees v and i
CIRCUIT, SEEN = np.array([[-1 / (22 * 47e-6), 1 / 47e-6], [-50.0, 0.0]]), np.array([-8.4, 0.0])
TICK, RISE = 400e-6, 4.4 / 400e-6


def converter_jump(before: np.ndarray, source: float) -> np.ndarray:
    """What a comparison makes of a deviation: the source comes, or goes (< 0), where the rates before are these."""
    return np.eye(2) + np.outer([0.0, 50.0 * source], SEEN) / (RISE + SEEN @ before)


def buck_converter() -> dict[str, Any]:
    """Cycles of 1 and 2 periods, off for a part of each and then on: where -1 is a multiplier."""

    def missed(unknown):
        E, parts = unknown[0], unknown[1:]
        rest, x, turn, late = np.array([E, E / 22]), np.zeros(2), np.eye(2), []
        ways = [(expm(CIRCUIT * TICK * part), expm(CIRCUIT * TICK * (1 - part))) for part in parts]
        for off, on in ways:
            x, turn = rest + on @ (off @ x - rest), on @ off @ turn
        x, slopes = np.linalg.solve(np.eye(2) - turn, x), np.eye(2)
        for part, (off, on) in zip(parts, ways, strict=True):
            x = off @ x
            late.append(3.8 + 4.4 * part - 8.4 * (x[0] - 11.3))
            slopes = on @ converter_jump(CIRCUIT @ x, E) @ off @ slopes
            x = rest + on @ (x - rest)
        return [np.linalg.det(slopes + np.eye(2)), *late]

    guesses = ([24.5, 0.5], [31.1, 0.35, 0.87])
    return {f"flip_{n}": root(missed, guess, tol=1e-14).x[0] for n, guess in enumerate(guesses, 1)}


def buck_chaos() -> dict[str, Any]:
    """Exact flows between comparisons, which are looked for on a grid of times; the sum is the divergence."""
    E, periods, damping = 34.0, 16000, -np.trace(CIRCUIT) / 2
    w = np.sqrt(np.linalg.det(CIRCUIT) - damping**2)
    swing, grid = (CIRCUIT + damping * np.eye(2)) / w, np.linspace(0.0, 1.0, 81)
    x, deviation, growth = np.array([12.0, 0.55]), np.array([1.0, 0.3]), 0.0

    def flow(t):
        return np.exp(-damping * t) * (np.cos(w * t) * np.eye(2) + np.sin(w * t) * swing)

    def ahead(s: Any, t: float, y: float, across: float, rest: float) -> Any:
        v = rest + np.exp(-damping * s) * (np.cos(w * s) * y + np.sin(w * s) * across)
        return 3.8 + RISE * (t + s) - 8.4 * (v - 11.3)

    for k in range(-500, periods):
        t, on = 0.0, 3.8 - 8.4 * (x[0] - 11.3) > 0
        while t < TICK:
            rest = np.array([E, E / 22]) * on
            y = x - rest
            here = (t, y[0], (swing @ y)[0], rest[0])
            times = grid * (TICK - t)
            other = np.flatnonzero((ahead(times[1:], *here) > 0) != on)
            step = TICK - t
            if other.size:
                bracket = (times[other[0]] or 1e-6 * times[1], times[other[0] + 1])
                step = root_scalar(ahead, args=here, bracket=bracket, xtol=1e-18).root
            x, deviation = rest + flow(step) @ y, flow(step) @ deviation
            if not other.size:
                break
            deviation = converter_jump(CIRCUIT @ (x - rest), -E if on else E) @ deviation
            t, on = t + step, not on
        size = np.hypot(deviation[0], 20 * deviation[1])
        deviation, growth = deviation / size, growth + (np.log(size) if k >= 0 else 0.0)
    largest = growth / (periods * TICK)
    return {"exponent1": largest, "exponent2": np.trace(CIRCUIT) - largest}


FORCED = (nordmark, ueda, duffing, den_hartog, impact_oscillator, buck_converter, buck_chaos)
