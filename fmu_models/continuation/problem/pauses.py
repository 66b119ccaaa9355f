"""Where in a period nothing happens, and a run may begin."""

from collections.abc import Iterable, Sequence

import numpy as np

from fmu_models.base.arrays import Vector
from fmu_models.continuation.problem.problem import Passing
from fmu_models.language.contact_kinds import STICK, TOUCHING
from fmu_models.simulation.trajectory import Event

# share of the orbit's length that an event must keep from the strobe, beyond which the strobe moves to another phase;
# less where pauses are shorter
CLEAR = 0.01
PLACES = 128  # at which a period without events may be divided

Pauses = Sequence[tuple[bool, float, float]]


def pauses(events: Sequence[Passing | Event], length: float) -> Pauses:
    """Pauses of a period with these events: whether a contact holds, sticks or remembers, begin and length; longest
    first, those in which one does last."""
    times = [event.time for event in events]
    last = {event.contact: event.after for event in events}
    gaps = []
    for i, event in enumerate(events):
        last[event.contact] = event.after
        after = times[i + 1] if i + 1 < len(times) else times[0] + length
        gaps.append((_held(last.values()), times[i] - after, times[i]))
    return [(holding, pause_start, -negative) for holding, negative, pause_start in sorted(gaps)]


def held_at_start(events: Sequence[Passing | Event]) -> bool:
    """Whether a period with these events begins in a contact that closes, sticks or remembers."""
    return _held({event.contact: event.after for event in events}.values())


def _held(states: Iterable[int]) -> bool:
    return any(state in (STICK, TOUCHING) for state in states)


def is_clear(time: float, gaps: Pauses, margin: float, length: float) -> bool:
    """Whether a time lies in a pause in which nothing holds, away from its ends."""
    relative = ((holding, (time - begin) % length, pause) for holding, begin, pause in gaps)
    return not gaps or any(not holding and margin <= elapsed <= pause - margin for holding, elapsed, pause in relative)


def clear_places(gaps: Pauses, margin: float, length: float) -> Vector:
    """(k,) times where nothing holds, well away from events."""
    free = [(begin, pause) for holding, begin, pause in gaps if not holding] if gaps else [(0.0, length)]
    rows = (
        np.linspace(begin + 2.0 * margin, begin + pause - 2.0 * margin, 3 + int(PLACES * pause / length))
        for begin, pause in free
        if pause > 4.0 * margin
    )
    return np.concatenate([*rows, np.zeros(0)])
