"""The support and the hinge once more, by formulas of their own in numba: exact flow between the events of the support
and in the free flight of the hinge, Runge-Kutta in the square root of the time of its contacts.

Nothing here knows of the engine: equations as in the papers, roots by bisection. Needs the extra `bench`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]  # of the extra `bench`


@njit(cache=True)
def _linear(stiffness, damping, offset, amplitude, omega, x, v, begin, end):
    """x'' + damping x' + stiffness x = amplitude cos(omega t) + offset, from one time to another."""
    size = (stiffness - omega**2) ** 2 + (damping * omega) ** 2
    a, b = amplitude * (stiffness - omega**2) / size, amplitude * damping * omega / size
    d, since = 0.5 * damping, end - begin
    w = math.sqrt(stiffness - d * d)
    c, s = math.cos(omega * begin), math.sin(omega * begin)
    y, u = x - a * c - b * s - offset / stiffness, v - omega * (b * c - a * s)
    q, e, cw, sw = (u + d * y) / w, math.exp(-d * since), math.cos(w * since), math.sin(w * since)
    c, s = math.cos(omega * end), math.sin(omega * end)
    return (
        e * (y * cw + q * sw) + a * c + b * s + offset / stiffness,
        e * (u * cw - (d * q + w * y) * sw) + omega * (b * c - a * s),
    )


@njit(cache=True)
def _on_support(c, f0, ks, cs, g, omega, touches, x, v, begin, end):
    if touches:
        return _linear(1.0 + ks, c + cs, ks * g, f0, omega, x, v, begin, end)
    return _linear(1.0, c, 0.0, f0, omega, x, v, begin, end)


@njit(cache=True)
def support_strobe(x, v, periods, c, f0, ks, cs, g, omega):
    """x, v and the number of touches after so many periods of the support, from phase 0."""
    period, touches, count = 2.0 * math.pi / omega, ks * (x - g) + cs * v > 0.0 and x >= g, 0
    # no faster than its free motion turns: a tenth of a half turn, and a touch is seen by its least height
    for _ in range(periods):
        t = 0.0
        side = ks * (x - g) + cs * v if touches else g - x
        while t < period:
            scan = 0.3 / math.sqrt(1.0 + ks if touches else max(1.0, omega**2))
            t0, x0, v0, found = t, x, v, False
            while t < period and not found:
                t1 = min(t + scan, period)
                x1, v1 = _on_support(c, f0, ks, cs, g, omega, touches, x0, v0, t0, t1)
                value = ks * (x1 - g) + cs * v1 if touches else g - x1
                if not touches and side > 0.0 and value > 0.0 and v > 0.0 > v1:
                    # the highest point on the way, by bisection of the speed
                    low, high = t, t1
                    middle, xm, vm = t1, x1, v1
                    for _b in range(60):
                        middle = 0.5 * (low + high)
                        xm, vm = _on_support(c, f0, ks, cs, g, omega, touches, x0, v0, t0, middle)
                        low, high = (middle, high) if vm > 0.0 else (low, middle)
                    if xm > g:
                        t1, x1, v1, value = middle, xm, vm, g - xm
                if side > 0.0 and value <= 0.0:
                    low, high = t, t1
                    for _b in range(70):
                        middle = 0.5 * (low + high)
                        x1, v1 = _on_support(c, f0, ks, cs, g, omega, touches, x0, v0, t0, middle)
                        value = ks * (x1 - g) + cs * v1 if touches else g - x1
                        low, high = (middle, high) if value > 0.0 else (low, middle)
                    t1, found = high, True
                    x1, v1 = _on_support(c, f0, ks, cs, g, omega, touches, x0, v0, t0, t1)
                else:
                    side = value
                t, x, v = t1, x1, v1
            if found:
                # a touch begins with a force; after it the mass is beyond the gap
                touches = not touches
                side = 1.0 if touches else 0.0
                count += touches
    return x, v, count


@njit(cache=True)
def support_strobes(starts, periods, c, f0, ks, cs, g, omega):
    """(m, 2) points after so many periods."""
    ends = np.empty_like(starts)
    for i in range(len(starts)):
        ends[i, 0], ends[i, 1], _ = support_strobe(starts[i, 0], starts[i, 1], periods, c, f0, ks, cs, g, omega)
    return ends


ZETA, DELTA, K0, MU = 0.2, 0.01, 300.0, 0.75 * (1.0 - 0.9**2)


@njit(cache=True)
def _hinge_flight(f, x, v, begin, end):
    # sin(w t) = cos(w t - pi/2): the same formula with time a quarter of a turn later
    late = 0.25 / f
    return _linear(1.0, 2.0 * ZETA, 0.0, 1.0, 2.0 * math.pi * f, x, v, begin - late, end - late)


@njit(cache=True)
def _hinge_rate(f, side, entry, t, x, v):
    depth = max(side * x - DELTA, 0.0)
    force = K0 * depth * math.sqrt(depth) * (side + MU * v / entry)
    return math.sin(2.0 * math.pi * f * t) - 2.0 * ZETA * v - x - force


@njit(cache=True)
def _hinge_step(f, side, entry, t0, s, h, x, v):
    """A step of Runge and Kutta in s, t = t0 + s^2."""
    k1x, k1v = 2 * s * v, 2 * s * _hinge_rate(f, side, entry, t0 + s * s, x, v)
    m = s + 0.5 * h
    x2, v2 = x + 0.5 * h * k1x, v + 0.5 * h * k1v
    k2x, k2v = 2 * m * v2, 2 * m * _hinge_rate(f, side, entry, t0 + m * m, x2, v2)
    x3, v3 = x + 0.5 * h * k2x, v + 0.5 * h * k2v
    k3x, k3v = 2 * m * v3, 2 * m * _hinge_rate(f, side, entry, t0 + m * m, x3, v3)
    e = s + h
    x4, v4 = x + h * k3x, v + h * k3v
    k4x, k4v = 2 * e * v4, 2 * e * _hinge_rate(f, side, entry, t0 + e * e, x4, v4)
    return x + h / 6 * (k1x + 2 * k2x + 2 * k3x + k4x), v + h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v)


@njit(cache=True)
def hinge_strobes(x, v, periods, f, steps):
    """(periods, 2) points of the hinge at phase 0 and (periods,) impacts until then, from a start in free flight.

    steps: in the square root of a unit of time, in contact.
    """
    points, impacts = np.empty((periods, 2)), np.zeros(periods, np.int64)
    period, side, entry, began, s, count = 1.0 / f, 0.0, 0.0, 0.0, 0.0, 0
    h = 1.0 / steps
    for i in range(periods):
        t = 0.0
        while t < period:
            if side == 0.0:
                t0, x0, v0, found = t, x, v, False
                while t < period and not found:
                    t1 = min(t + 0.02, period)
                    x1, v1 = _hinge_flight(f, x0, v0, t0, t1)
                    if abs(x1) > DELTA and x1 * v1 > 0.0:
                        low, high = t, t1
                        for _b in range(60):
                            middle = 0.5 * (low + high)
                            xm, vm = _hinge_flight(f, x0, v0, t0, middle)
                            low, high = (low, middle) if abs(xm) > DELTA and xm * vm > 0.0 else (middle, high)
                        t1, found = high, True
                        x1, v1 = _hinge_flight(f, x0, v0, t0, t1)
                    t, x, v = t1, x1, v1
                if found:
                    side, entry, began, s, count = math.copysign(1.0, x), abs(v), t, 0.0, count + 1
                continue
            last = math.sqrt(period - began)
            step = min(h, last - s)
            x1, v1 = _hinge_step(f, side, entry, began, s, step, x, v)
            if side * x1 < DELTA and side * v1 < 0.0:
                low, high = 0.0, step
                for _b in range(60):
                    middle = 0.5 * (low + high)
                    xm, vm = _hinge_step(f, side, entry, began, s, middle, x, v)
                    low, high = (low, middle) if side * xm < DELTA else (middle, high)
                x, v = _hinge_step(f, side, entry, began, s, high, x, v)
                s += high
                t, side = began + s * s, 0.0
                continue
            x, v, s = x1, v1, s + step
            t = period if s >= last * (1.0 - 1e-15) else began + s * s
        began -= period
        points[i, 0], points[i, 1], impacts[i] = x, v, count
    return points, impacts
