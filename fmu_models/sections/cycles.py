"""The motion that a run ends in, measured to rounding: its period, its extremes, its shares of stick.

A cycle begins where a contact starts to stick (or, where none ever does, at the last kind of event), and ends where
that happens again in the same state; a coordinate upon which nothing depends need not come back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.arrays import Flags
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.amounts import Measured
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Event, Trajectory

SAMPLES = 2001  # of all marks together
TOLERANCE = 1e-14  # of a run, where it is not said
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

    run: of ``simulate``, errors too.
    """
    events = simulate(fmu, until, output_times=[until], **run).events
    marks = _marks(events)
    if len(marks) < 2:
        return None
    marks = marks[-MOST - 1 :]
    times = np.union1d(marks, np.linspace(marks[0], marks[-1], SAMPLES))
    states = simulate(fmu, until, output_times=times, sides=True, **run)  # to the last digit the run before
    closed = _closed(states, np.isin(times, marks), [name for name in fmu.states if name not in fmu.cyclic])
    if closed is None:
        return None
    start, stop = marks[-1 - closed], marks[-1]
    # a motion that came to rest long ago closes no cycle
    if until - stop > 2.0 * (stop - start):
        return None
    inside, span = tuple(event for event in events if start <= event.time < stop), (float(start), float(stop))
    ends_of = Measured(fmu, tolerance=run.get("tolerance") or TOLERANCE).extremes(span, {"start_time": 0.0, **run})
    drawn = states.drawn
    at = dict(zip(drawn.time.tolist(), drawn[fmu.states[0]], strict=True))
    angles: dict[tuple[str, int], list[float]] = {}
    for event in inside:
        angles.setdefault((event.contact, event.after), []).append(float(at[event.time]))
    minimum, maximum = ({name: ends[i] for name, ends in ends_of.items()} for i in (0, 1))
    stick = _stick_shares(fmu.contacts, inside, *span)
    return Cycle(span[0], float(stop - start), minimum, maximum, stick, angles, inside)


def _marks(events: Sequence[Event]) -> list[float]:
    """Times at which a cycle may begin."""
    landings = [event for event in events if event.after == 0]
    last = (landings or events)[-1:]
    kinds = {(event.contact, event.before, event.after) for event in last}
    if landings:
        return [event.time for event in landings if event.contact == landings[-1].contact]
    return [event.time for event in events if (event.contact, event.before, event.after) in kinds]


def _closed(states: Trajectory, marked: Flags, names: Sequence[str]) -> int | None:
    """How many marks back from the last one the motion was where it is there."""
    at, sizes = {n: states[n][marked] for n in names}, {n: np.abs(states[n]).max() for n in names}
    for lag in range(1, np.count_nonzero(marked)):
        if all(abs(at[n][-1] - at[n][-1 - lag]) <= CLOSED * sizes[n] for n in names):
            return lag
    return None


def _stick_shares(contacts: Sequence[str], events: Sequence[Event], start: float, stop: float) -> dict[str, float]:
    shares = dict.fromkeys(contacts, 0.0)
    for event in events:
        if event.after == 0:
            later = [e.time for e in events if e.contact == event.contact and e.time > event.time]
            shares[event.contact] += (min(later, default=stop) - event.time) / (stop - start)
    return shares
