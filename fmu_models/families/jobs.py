"""Many runs as data: what is asked for, the chunks it is cut into, and the rows that come of it.

    jobs -> chunks -> rows

A chunk is made by one call and fills rows of its own; it knows nothing of the others, but for links of chains that
begin where the links before them ended. The result does not depend on who makes which chunk, nor when: a thread,
another process, another machine (``execution``).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Flags, Varied, Vector
from fmu_models.base.cache import digest
from fmu_models.simulation.ensemble import Targets
from fmu_models.simulation.rows import RunRows

# steps of a section in a chunk: at least (3 ms of work with the smallest models), at least if it is stored or travels
# (a cluster has 10 ms of work with each), at most; how many chunks there are between these; rows in one, at most
CHUNK, FAR_CHUNK, MOST_CHUNK = 5000, 40_000, 2_000_000
CHUNKS, ROWS = 64, 400_000
EARLY = 50  # steps after which a run that may end early has ended, as a rule
# how a run ended
FINISHED, SETTLED, ABSORBED, ESCAPED, LOST, BROKEN, STOPPED = range(7)
OUTCOMES = ("finished", "settled", "absorbed", "to infinity", "section not met", "error", "stopped")


def reason(rows: RunRows, i: int) -> str:
    """Why a run ended early, or how it ended."""
    return rows.messages.get(i) or OUTCOMES[int(rows.outcomes[i])]


@dataclass(frozen=True)
class Chunk:
    """Runs from ``begin`` up to ``end``; ``follows``: its chains go on where those of the chunk before ended."""

    begin: int
    end: int
    follows: bool = False


@dataclass(frozen=True, eq=False)
class Jobs:
    """Runs over many steps of a section.

    Attributes:
        starts: (m, n) points.
        varied: values (m,) of parameters by name that differ from run to run.
        transient: steps that are not recorded.
        rows, batch: rows that are, of so many steps each.
        chain: runs of which each begins where the one before it ended.
        beside: chains that are made by one call: their first runs, then the second ones, and so on.
        resumed: of the first run of each of these, whether its start is the end of another run, to the last digit.
        longest: period up to which a motion is asked whether it repeats itself, and then followed no farther; 0: none.
        settled: relative distance below which two points are one.
        targets: orbits at which a run may end.
        tangents: how many differences are followed; their growth is recorded. ``flow``: the first along the motion.
        derivatives: record the derivative of each step instead.
    """

    starts: Vector
    varied: Varied = field(default_factory=dict)
    transient: int = 0
    rows: int = 1
    batch: int = 1
    chain: int = 1
    beside: int = 1
    resumed: Sequence[bool] | Flags = ()
    longest: int = 0
    settled: float = 1e-11
    targets: Targets | None = None
    tangents: int = 0
    flow: bool = False
    derivatives: bool = False

    def __len__(self) -> int:
        return len(self.starts)

    @property
    def settings(self) -> dict[str, Any]:
        """What the engine is asked for, as in ``EnsembleRuns``."""
        names = ("transient", "rows", "batch", "resumed", "longest", "settled", "flow")
        settings = {name: getattr(self, name) for name in names}
        return settings | {"follow": self.beside if self.chain > 1 else 0, "jacobians": self.derivatives}

    @property
    def block(self) -> int:
        """How many runs the chains are that are made by one call."""
        return self.chain * self.beside

    def part(self, begin: int, end: int) -> Jobs:
        """The jobs from ``begin`` up to ``end``."""
        varied = {name: values[begin:end] for name, values in self.varied.items()}
        return dataclasses.replace(self, starts=self.starts[begin:end], varied=varied)

    def chunks(self, together: int = 1, pace: int = 1, *, far: bool = False) -> list[Chunk]:
        """Of at least so many runs, at this pace, 0 where these are worth a chunk; ``far``: to be stored, or to travel,
        and worth the while."""
        steps = self.transient + self.rows * self.batch
        if self.targets is not None or self.longest:
            steps = min(steps, EARLY)
        cost = max(1, steps * (1 + 2 * self.tangents))
        target = max(FAR_CHUNK if far else CHUNK, min(len(self) * cost // CHUNKS // max(pace, 1), MOST_CHUNK)) * pace
        if self.chain == 1:
            size = max(together, min(target // cost, ROWS // max(self.rows, 1)), 1)
            return [Chunk(begin, min(begin + size, len(self))) for begin in range(0, len(self), size)]
        links = [*range(0, self.block, self.beside * max(target // (self.beside * cost), 1)), self.block]
        return [
            Chunk(first + begin, first + end, begin > 0)
            for first in range(0, len(self), self.block)
            for begin, end in pairwise(links)
        ]

    def digest(self) -> str:
        """Hash of all that is asked for."""
        pieces: list[str | bytes] = []
        for attribute in dataclasses.fields(self):
            value = getattr(self, attribute.name)
            if attribute.name == "varied":
                pieces += [item for name in value for item in (name, value[name].tobytes())]
            elif isinstance(value, Targets):
                pieces += [getattr(value, item_field.name).tobytes() for item_field in dataclasses.fields(value)]
            else:
                pieces.append(value.tobytes() if isinstance(value, np.ndarray) else repr(value))
        return digest(*pieces)


class System(Protocol):
    """What makes a chunk; see ``section_system``. alone: no two threads may run it, so that processes share the work,
    and an interrupt leaves rows that say how far they came; pace: 0 where ``together`` runs are worth a chunk."""

    together: int
    pace: int
    alone: bool

    def run(self, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows: ...
    def check(self, name: str, values: Vector) -> None: ...
    def identity(self) -> dict[str, Any]: ...
