"""A run once more by scipy's DOP853, piece by piece between the events, with the equations typed out as in a paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

Rates = Callable[[float, NDArray[np.float64]], list[float]]


def replay(
    run: Trajectory,
    states: list[str],
    rates_within: Callable[[float, Mapping[str, int]], Rates],
    bends: Iterable[float] = (),
) -> NDArray[np.float64]:
    """The final states, from the first ones and the events.

    Args:
        rates_within: from a time in the middle of a piece and the contact states in it, rates(t, x) for that piece.
        bends: times at which rates are not smooth for another reason than an event.
    """
    x = np.array([run[name][0] for name in states])
    contacts = {name.removesuffix("_state"): int(run[name][0]) for name in run.values if name.endswith("_state")}
    t = float(run.time[0])
    steps = [*((event.time, event) for event in run.events), *((bend, None) for bend in (*bends, run.time[-1]))]
    for stop, event in sorted(steps, key=lambda step: step[0]):
        if stop > t:
            rates = rates_within((t + stop) / 2, dict(contacts))
            x = solve_ivp(rates, (t, stop), x, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
            t = stop
        if event is not None:
            contacts[event.contact] = event.after
    return x


def straight(signal: Signal, middle: float) -> tuple[Callable[[float], float], float]:
    """The straight line of a signal through the piece around ``middle``: its value over time, and its slope."""
    i = int(np.searchsorted(signal.time, middle)) - 1
    slope = (signal.value[i + 1] - signal.value[i]) / (signal.time[i + 1] - signal.time[i])
    return lambda t: signal.value[i] + slope * (t - signal.time[i]), slope
