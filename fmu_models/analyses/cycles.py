"""The motion that a run ends in, measured to rounding: its period, its extremes, its shares of stick.

A cycle begins where a contact starts to stick (or, where none ever does, at the last kind of event), and ends where
that happens again in the same state. Extremes lie where the rate of a state vanishes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Event, Trajectory

SAMPLES = 2001  # of a cycle; cubic pieces between them leave some 1e-13 of the extremes
MOST = 12  # marks in one cycle
CLOSED = 1e-7  # of the size of each state, up to which a motion counts as closed: what a decaying transient leaves


@dataclass(frozen=True, eq=False)
class Cycle(Shown):
    """One period of a motion.

    Attributes:
        start, period: s.
        minimum, maximum: per state, in its unit.
        stick: per contact the share of the period in which it sticks.
        angles: per contact and new state (a key of CONTACT_STATES) the values of the first state at these events.
        events: those within it.
    """

    start: float
    period: float
    minimum: Mapping[str, float]
    maximum: Mapping[str, float]
    stick: Mapping[str, float]
    angles: Mapping[tuple[str, int], Sequence[float]]
    events: tuple[Event, ...]

    @property
    def sticking(self) -> set[str]:
        """The contacts that stick in it."""
        return {contact for contact, share in self.stick.items() if share > 0}


def last_cycle(fmu: Fmu, until: float, **run: Any) -> Cycle | None:
    """Run to ``until`` (s) and measure the last full cycle; None if the motion ends in none, or without events.

    run: of ``simulate``.

    Raises:
        StickslipError: as for ``simulate``.
    """
    events = simulate(fmu, until, output_times=[until], **run).events
    marks = _marks(events)
    if len(marks) < 2:
        return None
    states = simulate(fmu, until, output_times=marks[-MOST - 1 :], **run)
    found = _closed(states, fmu.states)
    if found is None:
        return None
    start, stop = states.time[-1 - found], states.time[-1]
    # a motion that came to rest long ago closes no cycle
    if until - stop > 2.0 * (stop - start):
        return None
    inside = tuple(event for event in events if start <= event.time < stop)
    times = np.unique(np.concatenate([np.linspace(start, stop, SAMPLES), [event.time for event in inside]]))
    trajectory = simulate(fmu, until, output_times=times, **run)
    extremes = {name: _extremes(trajectory, name) for name in fmu.states}
    at = dict(zip(times, trajectory[fmu.states[0]], strict=True))
    angles: dict[tuple[str, int], list[float]] = {}
    for event in inside:
        angles.setdefault((event.contact, event.after), []).append(float(at[event.time]))
    return Cycle(
        start=float(start),
        period=float(stop - start),
        minimum={name: low for name, (low, _) in extremes.items()},
        maximum={name: high for name, (_, high) in extremes.items()},
        stick=_stick_shares(fmu.contacts, inside, float(start), float(stop)),
        angles=angles,
        events=inside,
    )


def _marks(events: Sequence[Event]) -> list[float]:
    """Times at which a cycle may begin."""
    landings = [event for event in events if event.after == 0]
    last = (landings or events)[-1:]
    kinds = {(event.contact, event.before, event.after) for event in last}
    if landings:
        return [event.time for event in landings if event.contact == landings[-1].contact]
    return [event.time for event in events if (event.contact, event.before, event.after) in kinds]


def _closed(states: Trajectory, names: Sequence[str]) -> int | None:
    """How many marks back from the last one the motion was where it is there."""
    for back in range(1, len(states.time)):
        gaps = [abs(states[n][-1] - states[n][-1 - back]) <= CLOSED * np.abs(states[n]).max() for n in names]
        if all(gaps):
            return back
    return None


def _extremes(trajectory: Trajectory, name: str) -> tuple[float, float]:
    """Smallest and largest value of a state, from the cubics through values and rates at neighbouring samples."""
    from scipy.interpolate import CubicHermiteSpline

    curve = CubicHermiteSpline(trajectory.time, trajectory[name], trajectory[f"der({name})"])
    roots = curve.derivative().roots(extrapolate=False)
    values = np.concatenate([trajectory[name], curve(roots[np.isfinite(roots)])])
    return float(values.min()), float(values.max())


def _stick_shares(contacts: Sequence[str], events: Sequence[Event], start: float, stop: float) -> dict[str, float]:
    shares = dict.fromkeys(contacts, 0.0)
    for event in events:
        if event.after == 0:
            later = [e.time for e in events if e.contact == event.contact and e.time > event.time]
            shares[event.contact] += (min(later, default=stop) - event.time) / (stop - start)
    return shares
