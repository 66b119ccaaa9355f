"""Half a period of the hinge with clearance, to rounding, and its derivative by a complex step.

In the free arc the motion is linear. In a stop, x = side (delta + z^2), and time runs as dt = 2 z ds, so that all that
is left are polynomials and a sine, from z = 0 to z = 0 again:

    dz/ds = u,   dt/ds = 2 z,   du/ds = 2 z (-2 zeta u - delta - z^2 - k0 z^3 (1 + mu u/v0) + side sin(w t))

with u the speed into the stop and v0 that at its entry: Taylor series of any order.
"""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from typing import Any

ZETA, DELTA, K0, MU = 0.2, 0.01, 300.0, 0.1425
ORDER, STEP = 18, 0.03
TINY = 1e-40

# time, displacement, speed
State = tuple[Any, Any, Any]


def flight(at: State, omega: Any, time: Any) -> State:
    """Between the stops."""
    t, x, v = at
    a, b = 1 - omega**2, 2 * ZETA * omega
    size = a**2 + b**2

    def forced(time: Any) -> tuple[Any, Any]:
        s, c = cmath.sin(omega * time), cmath.cos(omega * time)
        return (a * s - b * c) / size, omega * (a * c + b * s) / size

    own = cmath.sqrt(1 - ZETA**2)
    (x0, v0), (x1, v1) = forced(t), forced(time)
    p, q, since = x - x0, v - v0, time - t
    decay, s, c = cmath.exp(-ZETA * since), cmath.sin(own * since), cmath.cos(own * since)
    moved = decay * (p * c + (q + ZETA * p) / own * s)
    moving = decay * (q * c - (p + ZETA * q) / own * s)
    return time, x1 + moved, v1 + moving


def product(a: Sequence[Any], b: Sequence[Any], k: int) -> Any:
    return sum(a[i] * b[k - i] for i in range(k + 1))


def series(z0: Any, u0: Any, t0: Any, omega: Any, side: int, v0: Any) -> tuple[list[Any], list[Any], list[Any]]:
    """Taylor coefficients of z, u and t in s."""
    z, u, t = [z0], [u0], [t0]
    s, c = [cmath.sin(omega * t0)], [cmath.cos(omega * t0)]
    squared, cubed, pushed, rate = [], [], [], []
    for k in range(ORDER):
        squared.append(product(z, z, k))
        cubed.append(product(squared, z, k))
        pushed.append((1 if k == 0 else 0) + MU * u[k] / v0)
        hertz = product(cubed, pushed, k)
        rate.append(-2 * ZETA * u[k] - (DELTA if k == 0 else 0) - squared[k] - K0 * hertz + side * s[k])
        z.append(u[k] / (k + 1))
        t.append(2 * z[k] / (k + 1))
        u.append(2 * product(z, rate, k) / (k + 1))
        turned = [(i + 1) * omega * t[i + 1] for i in range(k + 1)]
        s.append(product(turned, c, k) / (k + 1))
        c.append(-product(turned, s, k) / (k + 1))
    return z, u, t


def value(coefficients: Sequence[Any], s: Any) -> Any:
    total = 0.0
    for one in reversed(coefficients):
        total = total * s + one
    return total


def contact(at: State, omega: Any, side: int) -> State:
    """From the entry of a stop, 1 right or -1 left, to its end."""
    time, _, v = at
    v0 = side * v
    z, u, t = 0.0, v0, time
    while True:
        coefficients = series(z, u, t, omega, side, v0)
        after = [value(one, STEP) for one in coefficients]
        if after[0].real > 0.0:
            z, u, t = after
            continue
        s = -z / u
        for _ in range(8):
            s = s - value(coefficients[0], s) / value(coefficients[1], s)
        _, u, t = (value(one, s) for one in coefficients)
        return t, side * DELTA, side * u


def to_wall(at: State, omega: Any, side: int, guess: float) -> State:
    """Where a free arc meets a stop, about at a time."""
    for _ in range(8):
        _, x, v = flight(at, omega, guess)
        guess = guess - (x - side * DELTA) / v
    return flight(at, omega, guess)


def half(x: Any, v: Any, omega: Any, begin: Any, entries: Sequence[tuple[int, float]]) -> tuple[Any, Any]:
    """Displacement and speed half a period after a time; stops and about when they are entered are given."""
    at: State = (begin, x, v)
    for side, guess in entries:
        at = contact(to_wall(at, omega, side, guess), omega, side)
    _, x, v = flight(at, omega, begin + cmath.pi / omega)
    return x, v


def broken(x: float, v: float, omega: float, begin: float, entries: Sequence[tuple[int, float]]) -> list[float]:
    """What is zero where a motion with x(t + T/2) = -x(t) loses its symmetry: by how much it misses that, and
    det(1 - M), M the derivative over half a period."""
    ends = [half(x + dx, v + dv, omega, begin, entries) for dx, dv in ((TINY * 1j, 0j), (0j, TINY * 1j))]
    (a, c), (b, d) = ([one.imag / TINY for one in end] for end in ends)
    return [ends[0][0].real + x, ends[0][1].real + v, (1.0 - a) * (1.0 - d) - b * c]
