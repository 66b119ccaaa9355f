"""A body on a plane with Coulomb's or another friction, by other means.

    q'' = a(t) - f(|v|) v/|v|; at rest as long as |a| <= f(0)

With a constant drive of size G along x, friction f and k = f/G, from a slip w at the angle p to the drive:

    time of rest    w (f + G cos p)/(f^2 - G^2)
    place of rest   u = tan(p/2), C = w sin(p)/u^k:  C^2/(4 G) (u^(2k-2)/(2k-2) - u^(2k+2)/(2k+2)) along the drive,
                    C^2/(2 G) (u^(2k-1)/(2k-1) + u^(2k+1)/(2k+1)) across it
    on the way      |v| = C tan(q/2)^k/sin(q), q the angle of the slip to the drive
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

Drive = Callable[[float], np.ndarray]
NEAR = 1e-8  # a slip that comes to this rests, by the closed form of its time
YOUNG = 1e-4  # s since its onset: where a slip is taken up


def rest(w: Any, p: Any, f: Any, G: Any) -> tuple[Any, Any, Any]:
    """Time of rest and its place along and across the drive, in mpmath's numbers."""
    k, u = f / G, mpmath.tan(p / 2)
    C = w * mpmath.sin(p) / u**k
    along = C**2 / (4 * G) * (u ** (2 * k - 2) / (2 * k - 2) - u ** (2 * k + 2) / (2 * k + 2))
    across = C**2 / (2 * G) * (u ** (2 * k - 1) / (2 * k - 1) + u ** (2 * k + 1) / (2 * k + 1))
    return w * (f + G * mpmath.cos(p)) / (f**2 - G**2), along, across


def shaken(a: Drive, f: Callable[[float], float], end: float, v: np.ndarray) -> tuple[np.ndarray, list[float]]:
    """Place at the end from rest in the origin with a slip, and the times of its rests and onsets, by DOP853."""
    t, q, times = 0.0, np.zeros(2), []

    def flow(s: float, z: np.ndarray) -> np.ndarray:
        w = np.hypot(z[2], z[3])
        return np.concatenate([z[2:], a(s) - f(w) * z[2:] / w])

    def close(s: float, z: np.ndarray) -> float:
        return np.hypot(z[2], z[3]) - NEAR

    for name, value in (("terminal", True), ("direction", -1)):
        setattr(close, name, value)
    while True:
        run = solve_ivp(
            flow, (t, end), [*q, *v], "DOP853", events=close, rtol=3e-14, atol=1e-16, max_step=0.05, first_step=1e-7
        )
        t, q, v = run.t[-1], run.y[:2, -1], run.y[2:, -1]
        if run.status != 1:
            return q, times
        left = (f(0.0) * NEAR + a(t) @ v) / (f(0.0) ** 2 - a(t) @ a(t))
        q, t = q + v * left / 2, t + left
        times.append(t)
        span = np.linspace(t, end, 5001)
        beyond = np.flatnonzero([np.hypot(*a(s)) > f(0.0) for s in span])
        if not len(beyond):
            return q, times
        onset: Any = brentq(lambda s: np.hypot(*a(s)) - f(0.0), span[beyond[0] - 1], span[beyond[0]], xtol=1e-15)
        t = float(onset)
        times.append(t)
        # slip along the drive, which it follows closely there; |v|' = |a| - f
        ways, weights = np.polynomial.legendre.leggauss(8)
        grown = (
            YOUNG
            / 2
            * sum(c * (np.hypot(*a(t + YOUNG * (s + 1) / 2)) - f(0.0)) for s, c in zip(ways, weights, strict=True))
        )
        v = grown * a(t + YOUNG) / np.hypot(*a(t + YOUNG))
        q, t = q + v * YOUNG / 3, t + YOUNG
