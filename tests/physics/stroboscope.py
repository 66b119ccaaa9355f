"""Forced oscillators seen once per period of their forcing, and exactly where they turn."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Trajectory


def after_transient(fmu: Fmu, T: float, transient: int, *, periods: int = 48, **run: Any) -> Trajectory:
    """A run recorded once per forcing period T from the end of the transient on."""
    times = T * np.arange(transient, transient + periods + 1)
    return simulate(fmu, float(times[-1]), output_times=times, **run)


def period(run: Trajectory, *, within: float, most: int = 16) -> int:
    """After how many samples the states recur, 0 if they do not."""
    states = np.stack([run["x"], run["v"]], axis=1)
    recur = (n for n in range(1, most + 1) if np.abs(states[n:] - states[:-n]).max() < within)
    return next(recur, 0)


def entries(run: Trajectory, contact: str) -> int:
    """How often a stop was entered while the run was recorded."""
    return sum(e.contact == contact and e.after == 3 and run.time[0] < e.time <= run.time[-1] for e in run.events)


def turning_points(fmu: Fmu, stop: float, **run: Any) -> NDArray[np.float64]:
    """Values of x where v is zero, by Newton's method on the run itself."""
    events = [event.time for event in simulate(fmu, stop, **run).events if event.time <= stop]
    times = np.unique(np.concatenate([np.linspace(0.0, stop, 401), *(e + np.linspace(0, 0.01, 41) for e in events)]))
    times = times[times <= stop]
    coarse = simulate(fmu, stop, output_times=times, **run)
    found = []
    for i in np.flatnonzero(np.sign(coarse["v"][:-1]) * np.sign(coarse["v"][1:]) < 0):
        time, x, late = times[i], coarse["x"][i], coarse["v"][i] / coarse["der(v)"][i]
        for _ in range(5):
            time = float(np.clip(time - late, times[i], times[i + 1]))
            at = simulate(fmu, stop, output_times=[time], **run)
            x, late = at["x"][0], at["v"][0] / at["der(v)"][0]
        found.append(x)
    return np.array(found)
