"""Logs of a bench whose normal force and temperature are driven, and recorded by sensors with noise of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig_io.bench.disturbances import Disturbances
from rig_io.bench.emulation import LOAD_STEP, Emulation
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog

MEAN = 4.905  # N
ROOM = 295.0  # K
CELL, THERMOMETER = 0.005, 0.05  # N, K: deviations of the noise of the sensors
Course = Callable[[np.ndarray], np.ndarray]

COURSES: dict[str, Course] = {
    "steps": lambda t: 1 + 0.3 * np.sign(np.sin(2 * np.pi * (t / 2.6 - 0.0123))),
    "ramps": lambda t: 1 + 0.4 * (2 * np.abs((t / 4.1) % 1 - 0.5) - 0.5),
    "sine": lambda t: 1 + 0.3 * np.sin(2 * np.pi * 0.45 * t),
    "none": lambda t: 1 + 0 * t,
}


@dataclass(frozen=True, init=False)
class Driven(Disturbances):
    """Friction follows a factor of the normal force, and (1 + a (T - ROOM))."""

    def __init__(self, load: Course, warmth: Course, a: float) -> None:
        super().__init__()
        for name, value in {"course": load, "warmth": warmth, "a": a}.items():
            object.__setattr__(self, name, value)

    def load(self, time: np.ndarray, angle: np.ndarray, duration: float, number: int, specimen: object) -> np.ndarray:
        course, warmth, a = (getattr(self, name) for name in ("course", "warmth", "a"))
        return course(time) * (1 + a * (warmth(time) - ROOM))


def weighed_logs(
    loads: Sequence[str],
    a: float = 0.0,
    *,
    rise: float = 8.0,
    speeds: Sequence[float] = (0.41, 0.83, 1.4),
    duration: float = 8.0,
    transient: float = 3.0,
    seed: int = 0,
    **settings: object,
) -> list[RigLog]:
    """Logs at several speeds, rad/s, with a course of the normal force each, and a free decay; each begins where the
    last one's temperature was, and all together it rises by ``rise`` K. a: 1/K."""
    logs = []
    plain: list[Emulation] = standard_set("paper/rubber", speeds, duration=duration, transient=transient, **settings)
    for number, one in enumerate(plain):
        noise = np.random.default_rng([seed, number, 99])
        if not one.discs:
            logs.append(emulate(one, seed, number))
            continue
        course = COURSES[loads[number]]

        def warmth(time: np.ndarray, number: int = number) -> np.ndarray:
            return ROOM + rise * ((number + np.clip(time / duration, 0, 1)) / len(speeds) - 0.5)

        log = emulate(replace(one, disturbances=Driven(course, warmth, a)), seed, number)
        knots = np.arange(
            -one.transient, duration, LOAD_STEP
        )  # those of the bench, between which a step takes its time
        columns = {
            **log.columns,
            "load0": MEAN * np.interp(log.time, knots, course(knots)) + CELL * noise.standard_normal(len(log.time)),
            "temperature": warmth(log.time) + THERMOMETER * noise.standard_normal(len(log.time)),
        }
        logs.append(replace(log, columns=columns, units={**log.units, "load0": "N", "temperature": "K"}))
    return logs
