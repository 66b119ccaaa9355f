"""Flows of piecewise linear oscillators of one coordinate to 40 digits, events included, by their closed forms.

In each mode x'' + c x' + k x = b + f cos(w t). A mode ends where its guard, looked at on even points, has fallen below
zero; the place is Newton's to all digits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
from closed_form import root

# points of a period that a guard is looked at
POINTS = 600
# a guard is zero to rounding where the mode begins
AT_ZERO = 1e-11


@dataclass(frozen=True)
class Field:
    """One mode of the motion."""

    c: Any = 0
    k: Any = 0
    b: Any = 0
    f: Any = 0
    w: Any = 1

    def flow(self, t0: Any, x: Any, v: Any, functions: Any) -> Callable[[Any], tuple[Any, Any]]:
        """Place and speed at a time; functions: mpmath, or NumPy on complex numbers."""
        cos, sin, exp = functions.cos, functions.sin, functions.exp
        if self.c == 0 and self.k == 0:
            if self.f != 0:
                raise ValueError("a free particle is not forced")
            return lambda t: (x + v * (t - t0) + self.b * (t - t0) ** 2 / 2, v + self.b * (t - t0))
        stiff, lossy = self.k - self.w**2, self.c * self.w
        size = stiff**2 + lossy**2
        a, d, rest = self.f * stiff / size, self.f * lossy / size, self.b / self.k
        root = functions.sqrt(functions.mpc(self.c**2 - 4 * self.k))
        one, two = (-self.c + root) / 2, (-self.c - root) / 2
        w = self.w
        x0 = x - rest - a * cos(w * t0) - d * sin(w * t0)
        v0 = v + w * (a * sin(w * t0) - d * cos(w * t0))
        first, second = (v0 - two * x0) / (one - two), (one * x0 - v0) / (one - two)

        def at(t: Any) -> tuple[Any, Any]:
            left, right = first * exp(one * (t - t0)), second * exp(two * (t - t0))
            place = (left + right).real + rest + a * cos(w * t) + d * sin(w * t)
            return place, (one * left + two * right).real + w * (d * cos(w * t) - a * sin(w * t))

        return at


@dataclass(frozen=True)
class Guard:
    """How a mode ends.

    Attributes:
        value: of (t, x, v, functions), positive in the mode.
        jump: where it falls, from (t, x, v) to the next mode, place and speed.
    """

    value: Callable[[Any, Any, Any, Any], Any]
    jump: Callable[[Any, Any, Any], tuple[str, Any, Any]]


@dataclass(frozen=True)
class Mode:
    """A field, and how it ends."""

    field: Field
    guards: tuple[Guard, ...]


class _Numpy:
    cos, sin, exp, sqrt = np.cos, np.sin, np.exp, np.sqrt
    mpc = complex


def _root(guard: Guard, flow: Callable[[Any], tuple[Any, Any]], near: float) -> Any:
    """The fall of a guard that is known to rounding, to all digits, by secants."""
    a, b = mpmath.mpf(near), mpmath.mpf(near) + mpmath.mpf(10) ** -9
    at_a, at_b = (guard.value(t, *flow(t), mpmath) for t in (a, b))
    while at_b != at_a and abs(b - a) > mpmath.mpf(10) ** -36:
        a, b, at_a = b, b - at_b * (b - a) / (at_b - at_a), at_b
        at_b = guard.value(b, *flow(b), mpmath)
    return b


def _fall(guard: Guard, flow: Callable[[Any], tuple[Any, Any]], times: Any) -> float | None:
    """The first fall of a guard between even points, to rounding; at the first of these it may be zero."""

    def value(t: Any) -> Any:
        return guard.value(t, *flow(t), _Numpy)

    values = np.broadcast_to(value(times), times.shape)
    down = np.flatnonzero((values[1:] <= 0.0) & (values[:-1] > AT_ZERO))
    return root(value, times[down[0]], times[down[0] + 1]) if down.size else None


def follow(
    system: Callable[[dict[str, Any]], dict[str, Mode]],
    parameters: dict[str, float],
    start: tuple[str, float, float],
    period: float,
    periods: int,
) -> tuple[float, float]:
    """Place and speed after some periods of the motion that begins at t = 0 in a mode, at a place with a speed."""
    rough = system(parameters)
    with mpmath.workdps(40):
        modes = system({name: mpmath.mpf(value) for name, value in parameters.items()})
        name, place, speed = start[0], mpmath.mpf(start[1]), mpmath.mpf(start[2])
        t, end = mpmath.mpf(0), periods * mpmath.mpf(period)
        while True:
            exact = modes[name].field.flow(t, place, speed, mpmath)
            near = rough[name].field.flow(float(t), float(place), float(speed), _Numpy)
            times = np.linspace(float(t), float(end), max(3, int(POINTS * float(end - t) / period)))
            falls = [(_fall(guard, near, times), i) for i, guard in enumerate(rough[name].guards)]
            met = [(at, i) for at, i in falls if at is not None]
            if not met:
                return tuple(map(float, exact(end)))  # type: ignore[return-value]
            at, i = min(met)
            guard = modes[name].guards[i]
            t = _root(guard, exact, at)
            name, place, speed = guard.jump(t, *exact(t))
