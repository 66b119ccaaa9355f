"""Bodies with dry friction and stops, integrated from equations written by hand: a second, independent path.

    M(q) v' = h(q, v) - sum of s F_s J (slip) + sum of lambda J (stick) - sum of D'(x) (k d + c d') (stops, d > 0)

From event to event by DOP853; at each all assignments of slip and stick of the contacts at zero slip are tried.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Bodies:
    """What is to be integrated.

    Attributes:
        inertia, forces: M(q) and h(q, v).
        J: (n_contacts, n) constant levers of the friction contacts, J v their slips; capacity: (n_contacts,) N,
            or (2, n_contacts) against positive and against negative slip.
        stops: (row of J of the depth, place d = row q - place, k, c) of each.
    """

    inertia: Callable[[Vector], Vector]
    forces: Callable[[Vector, Vector], Vector]
    J: Vector
    capacity: Vector
    stops: list[tuple[Vector, float, float, float]] = field(default_factory=list)

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        """Largest forces against positive and against negative slip, (n_contacts,) each."""
        plus, minus = np.broadcast_to(self.capacity, (2, len(self.J)))
        return plus, minus

    def margin(self, i: int, force: float) -> float:
        """What the force of a sticking contact lacks of its nearer bound."""
        plus, minus = self.bounds
        return float(min(minus[i] - force, plus[i] + force))


def _rates(b: Bodies, q: Vector, v: Vector, mode: tuple[int, ...], inside: tuple[bool, ...]) -> tuple[Vector, Vector]:
    """Accelerations and the forces of sticking contacts (0 of others); mode 1, -1 slip, 0 stick."""
    M, h = b.inertia(q), b.forces(q, v)
    for (row, place, k, c), touches in zip(b.stops, inside, strict=True):
        if touches:
            h = h - row * (k * (row @ q - place) + c * row @ v)
    plus, minus = b.bounds
    h = h - b.J.T @ (np.array(mode) * np.where(np.array(mode) > 0, plus, minus))
    free: Vector = np.linalg.solve(M, h).astype(float)
    held = [i for i, s in enumerate(mode) if s == 0]
    force = np.zeros(len(mode))
    if held:
        J = b.J[held]
        force[held] = np.linalg.solve(J @ np.linalg.solve(M, J.T), -J @ free)
        free = free + np.linalg.solve(M, J.T @ force[held])
    return free, force


def _choose(
    b: Bodies, q: Vector, v: Vector, mode: tuple[int, ...], zero: set[int], inside: tuple[bool, ...]
) -> tuple[int, ...]:
    """The mode that fits from here on: sticks within the capacities, and slips that leave zero to their side."""
    options = [(0, 1, -1) if i in zero else (s,) for i, s in enumerate(mode)]
    for trial in sorted(itertools.product(*options), key=lambda t: sum(map(abs, t))):
        a, force = _rates(b, q, v, trial, inside)
        slips = b.J @ a
        if all((b.margin(i, force[i]) > 0) if trial[i] == 0 else trial[i] * slips[i] > 0 for i in zero):
            return trial
    raise AssertionError("no mode fits")


def integrate(b: Bodies, q: Vector, v: Vector, times: Vector) -> Vector:
    """States (len(times), 2 n) at times from 0 on."""
    n, contacts = len(q), range(len(b.J))
    out = np.empty((len(times), 2 * n))
    t, y = 0.0, np.concatenate([q, v]).astype(float)
    slips = b.J @ v
    inside = tuple(bool(row @ q > place) for row, place, _, _ in b.stops)
    zero = {i for i in contacts if slips[i] == 0}
    mode = _choose(b, y[:n], y[n:], tuple(int(np.sign(s)) for s in slips), zero, inside)
    while True:

        def rate(_: float, y: Vector, mode=mode, inside=inside) -> Vector:
            return np.concatenate([y[n:], _rates(b, y[:n], y[n:], mode, inside)[0]])

        def event(f: Callable[[float, Vector], float], direction: int) -> Callable[[float, Vector], float]:
            f.terminal, f.direction = True, direction  # pyright: ignore[reportFunctionMemberAccess]
            return f

        events = []
        for i in contacts:
            if mode[i] == 0:

                def margin(_: float, y: Vector, i=i, mode=mode, inside=inside) -> float:
                    return b.margin(i, _rates(b, y[:n], y[n:], mode, inside)[1][i])

                events.append(event(margin, -1))
            else:
                events.append(event(lambda _, y, i=i, s=mode[i]: float(s * (b.J[i] @ y[n:])), -1))
        for (row, place, _, _), touches in zip(b.stops, inside, strict=True):
            events.append(event(lambda _, y, row=row, place=place: float(row @ y[:n] - place), -1 if touches else 1))
        part = solve_ivp(
            rate, (t, times[-1]), y, "DOP853", rtol=1e-12, atol=1e-14, events=events, dense_output=True, max_step=0.02
        )
        now = (times >= t) & (times <= part.t[-1])
        if now.any():
            out[now] = part.sol(times[now]).T
        if part.status == 0:
            return out
        t, y = part.t[-1], part.y[:, -1].copy()
        fired = next(i for i, found in enumerate(part.t_events) if len(found))
        if fired >= len(b.J):
            which = fired - len(b.J)
            inside = tuple(not touches if i == which else touches for i, touches in enumerate(inside))
            zero = {i for i in contacts if mode[i] == 0}
        else:
            zero = {i for i in contacts if mode[i] == 0} | {fired}
        J, M = b.J[sorted(zero)], b.inertia(y[:n])
        if zero:
            y[n:] -= np.linalg.solve(M, J.T) @ np.linalg.solve(J @ np.linalg.solve(M, J.T), J @ y[n:])
        before = mode[fired] if fired < len(b.J) else None
        if before == 0:
            # at its limit it slips the way it is pulled
            pull = -int(np.sign(_rates(b, y[:n], y[n:], mode, inside)[1][fired]))
            mode = tuple(pull if i == fired else s for i, s in enumerate(mode))
            zero -= {fired}
        mode = _choose(b, y[:n], y[n:], mode, zero, inside)
