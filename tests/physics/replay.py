"""A run once more by scipy's DOP853, piece by piece between the events, with the equations typed out as in a paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fmu_models.simulation.trajectory import Trajectory

Rates = Callable[[float, NDArray[np.float64], Mapping[str, int]], list[float]]


def replay(run: Trajectory, states: list[str], rates: Rates, bends: Iterable[float] = ()) -> NDArray[np.float64]:
    """The final states, from the first ones, the events and ``rates(t, x, contact states)``.

    ``bends`` are times at which the rates are not smooth for another reason.
    """
    x = np.array([run[name][0] for name in states])
    contacts = {name.removesuffix("_state"): int(run[name][0]) for name in run.values if name.endswith("_state")}
    t = float(run.time[0])
    steps = [*((event.time, event) for event in run.events), *((bend, None) for bend in (*bends, run.time[-1]))]
    for stop, event in sorted(steps, key=lambda step: step[0]):
        if stop > t:
            now = dict(contacts)
            solution = solve_ivp(
                lambda s, y, now=now: rates(s, y, now), (t, stop), x, method="DOP853", rtol=3e-14, atol=1e-15
            )
            x, t = solution.y[:, -1], stop
        if event is not None:
            contacts[event.contact] = event.after
    return x
