"""Events found by a method against those of the reference: which are missing, and how far off the others are."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from fmu_models.validation.methods.result import OPEN, RELEASED, SwitchEvent

# of the distance to the nearest other event of the contact: a find further away is another event
REACH = 0.5


@dataclass(frozen=True)
class EventErrors:
    """expected: events of the reference; missed: those without a counterpart; extra: finds without one.

    time: s, largest distance of a pair, None without pairs.
    """

    expected: int
    missed: int
    extra: int
    time: float | None


def event_errors(computed: Sequence[SwitchEvent], reference: Sequence[SwitchEvent], stop: float) -> EventErrors:
    """Pair the events of every contact that end in the same state, each with the nearest still free."""
    kinds: dict[tuple[str, int], tuple[list[float], list[float]]] = defaultdict(lambda: ([], []))
    for column, switches in enumerate((computed, reference)):
        for switch in switches:
            if switch.matters:
                # that a body has left its stop says the same whether it is still inside or not
                after = OPEN if switch.after == RELEASED else switch.after
                kinds[switch.contact, after][column].append(switch.time)
    missed, paired = 0, 0
    largest: float | None = None
    for finds, times in kinds.values():
        free = sorted(finds)
        for i, t in enumerate(times):
            around = [abs(t - times[j]) for j in (i - 1, i + 1) if 0 <= j < len(times)]
            reach = REACH * min([d for d in around if d > 0.0], default=stop)
            nearest = min(free, key=lambda candidate, t=t: abs(candidate - t), default=None)
            if nearest is None or abs(nearest - t) > reach:
                missed += 1
                continue
            free.remove(nearest)
            paired += 1
            largest = max(largest or 0.0, abs(nearest - t))
    expected = sum(len(times) for _, times in kinds.values())
    finds = sum(len(finds) for finds, _ in kinds.values())
    return EventErrors(expected, missed, finds - paired, largest)
