"""How far a fit is: its stages take shares of the time that are roughly known, its searches some evaluations each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from identification.inference.choice import Inference
from identification.inference.problem import Progress

Told = Callable[[float], None]

USUAL = 4.0  # evaluations of a search
# time of the stages over that of a plain search
CONCLUSION, CAUSES, AGAIN = 0.25, 0.5, 1.5
DRAW, PROFILES = 0.1, 4.0


class Stages:
    """Stages of a fit in their order. progress: called with the share of the whole that is done, or None."""

    def __init__(self, progress: Told | None, times: Mapping[str, float]) -> None:
        self.progress, self.times = progress, times

    @classmethod
    def of_fit(cls, progress: Told | None, inference: Inference, causes: bool) -> Stages:
        """The stages of a fit: with or without disturbances."""
        end = CONCLUSION + (inference.draws * DRAW if inference.covariance == "bootstrap" else 0.0)
        end += PROFILES if inference.profile else 0.0
        between = {"causes": CAUSES, "search again": AGAIN} if causes else {}
        return cls(progress, {"search": 1.0, **between, "end": end})

    def of(self, name: str) -> Told:
        """The callback that takes the fraction done of one stage."""
        every = list(self.times)
        before = sum(self.times[stage] for stage in every[: every.index(name)])
        total = sum(self.times.values())

        def report(done: float) -> None:
            if self.progress is not None:
                self.progress((before + self.times[name] * done) / total)

        return report


def by_evaluations(shares: Sequence[float], progress: Told, also: Progress | None = None) -> Progress:
    """What searches call (see `inference.problem`), one after the other, each with a share of the time.

    also: called too, with the same.
    """
    search, last = 0, 0

    def evaluated(count: int, squares: float) -> None:
        nonlocal search, last
        if also is not None:
            also(count, squares)
        search, last = search + (count <= last), count
        index = min(search, len(shares) - 1)
        progress(sum(shares[:index]) + shares[index] * count / (count + 0.5 * USUAL))

    return evaluated
