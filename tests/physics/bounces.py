"""Motions from impact to impact: speeds after each of them, and the derivative of the map from one to the next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative
from fmu_models.simulation.trajectory import Trajectory

OPEN, CLOSED, CHATTERING = 2, 3, 5


def at_impacts(fmu: Fmu, stop: float, **run: Any) -> tuple[NDArray[np.float64], Trajectory]:
    """Times of the impacts, and the run recorded there, after each."""
    times = np.array([event.time for event in simulate(fmu, stop, **run).impacts])
    times = times[just_after(times) <= stop]
    return times, simulate(fmu, stop, output_times=just_after(times), **run)


def just_after(times: ArrayLike) -> NDArray[np.float64]:
    """As soon after impacts as a run with other output times, whose rounding differs, has them behind it."""
    return np.asarray(times) + 8 * np.spacing(times)


@dataclass(frozen=True, eq=False)
class Flight:
    """From an impact of one particle at a wall to its next one.

    Attributes:
        contact: that is hit next.
        hit: time of that, s.
        after: v after it, m/s.
        derivative: d(time, v after) / d(time, v after).
    """

    contact: str
    hit: float
    after: float
    derivative: NDArray[np.float64]


def fly(
    fmu: Fmu, time: float, place: float, speeds: tuple[float, float], wall: Callable[[str, float], float], **run: Any
) -> Flight | None:
    """The flight from (time, place, v after), or None if the impacts at its end are too close to be told apart.

    A flight x'' = a that begins at (t, v) on a wall that moves with u' passes through (x0, v0) at a fixed time before
    with dx0 = (u' - v) dt and dv0 = dv - a dt. By that the derivative of the flow between two fixed times, which the
    engine gives, becomes that of the map between two walls.

    Args:
        speeds: of the wall and of the particle after the impact that the flight begins with.
        wall: speed of the wall of a contact at a time.
        run: parameters.
    """
    wall_speed, speed = speeds
    begin_at: dict[str, Any] = {"start_time": time, "start": {"x": place, "v": speed}, **run}
    spans = (simulate(fmu, time + span, output_times=[time + span], **begin_at).impacts for span in (10.0, 1000.0))
    first, second, *_ = next(impacts for impacts in spans if len(impacts) > 1)
    hit, pause = first.time, second.time - first.time
    if min(pause, hit - time) < 1e-2:
        return None
    end = hit + pause / 2
    after = simulate(fmu, end, output_times=[float(just_after(hit)), end], **begin_at)
    flow = flow_derivative(fmu, end, **begin_at).by_start
    a = float(after["der(v)"][0])
    begin = np.array([[wall_speed - speed, 0.0], [-a, 1.0]])
    back = np.array([[1.0, -(end - hit)], [0.0, 1.0]])
    finish = np.array([[wall(first.contact, hit) - float(after["v"][0]), 0.0], [-a, 1.0]])
    return Flight(first.contact, hit, float(after["v"][0]), np.linalg.inv(finish) @ back @ flow @ begin)


def predicted_map(
    duration: float, speeds: tuple[float, float, float], next_wall_acceleration: float, e: float, a: float = 0.0
) -> NDArray[np.float64]:
    """The same in closed form, [[q, -D/w], [e a + q C, -e - C D/w]].

    w = v + a D - u2', q = (w + u2' - u1')/w, C = (1 + e) u2'' - e a; duration D of the flight, speeds: (u1', v, u2')
    of the wall that is left, the particle after that impact, and the wall that is hit.
    """
    first, v, second = speeds
    w = v + a * duration - second
    q = (w + second - first) / w
    C = (1 + e) * next_wall_acceleration - e * a
    return np.array([[q, -duration / w], [e * a + q * C, -e - C * duration / w]])
