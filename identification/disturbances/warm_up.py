"""mu (1 + sum_n h_n (exp(-t/T_n) - mean)), t since the log began, T_n = 4 and 16 s: together they stand for any time
constant from 3 to 25 s. The law is that of the mean over a log."""

from types import ModuleType
from typing import Any

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DisturbanceTerm, Effect

TIMES = (4.0, 16.0)  # s


def fade(at: Any, order: int, functions: ModuleType) -> Any:
    """exp(-t/T_n) less its mean."""
    time = TIMES[order]
    mean = time / at.duration * (1 - functions.exp(-at.duration / time))
    return functions.exp(-(at.share + 0.5) * at.duration / time) - mean


FADE = Effect(
    "warming", fade, lambda order: f"of what fades within {TIMES[order]:g} s of a log", width=lambda order: 0.05
)
DISTURBANCE = Disturbance(
    words="friction settles within each log, as that of contacts that grow warm does",
    terms=lambda ready, size: [DisturbanceTerm(f"warming{n + 1}", FADE, n) for n in range(len(TIMES))],
    told_by="logs that begin after pauses of their own",
    rank=8,
    emulated=("warm_up",),
)
