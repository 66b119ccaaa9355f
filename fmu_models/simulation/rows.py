"""What comes of many runs, row by row."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.base.arrays import Integers, Vector


@dataclass(frozen=True, eq=False)
class RunRows:
    """Results of m runs.

    Attributes:
        points: (m, rows, n) at the section; nan where a run has fewer.
        times: (m, rows) since the row before.
        held: (m, rows, contacts) time in contact or stick; began: how often that began.
        growth: (m, rows, tangents) logarithms; derivatives: (m, rows, n, n).
        filled, steps, outcomes, periods, orbits: (m,) rows that there are; steps made; how the run ended (an index of
            ``jobs.OUTCOMES``); its period, 0 where none was found; the target that it came to, or -1.
        in_lanes: (m,) how many of the steps the exact flow in lanes made.
        messages: of the runs that ended in an error, by number.
    """

    points: Vector
    times: Vector
    held: Vector
    began: NDArray[np.int32]
    growth: Vector
    derivatives: Vector
    filled: Integers
    steps: Integers
    outcomes: NDArray[np.int32]
    periods: Integers
    orbits: Integers
    in_lanes: Integers
    messages: dict[int, str]

    @classmethod
    def empty(
        cls, runs: int, rows: int, width: int, contacts: int, *, growth: int = 0, derivatives: tuple[int, int] = (0, 0)
    ) -> RunRows:
        """Room for what is to come; ``width`` numbers a point."""
        points, times, grown, matrices = (
            np.full((runs, rows, *inner), np.nan) for inner in ((width,), (), (growth,), derivatives)
        )
        held, began = np.zeros((runs, rows, contacts)), np.zeros((runs, rows, contacts), np.int32)
        filled, steps, periods, in_lanes = (np.zeros(runs, np.int64) for _ in range(4))
        ended = np.zeros(runs, np.int32), periods, np.full(runs, -1, np.int64)
        return cls(points, times, held, began, grown, matrices, filled, steps, *ended, in_lanes, {})

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """All but the messages, by name; the first direction of each is the runs."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self) if field.name != "messages"}

    def only(self, indices: Integers) -> RunRows:
        """The rows of some runs."""
        here = enumerate(indices.tolist()) if self.messages else ()
        messages = {k: self.messages[i] for k, i in here if i in self.messages}
        return RunRows(**{name: array[indices] for name, array in self.arrays().items()}, messages=messages)  # type: ignore[arg-type]

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes integers go in as few bytes as they need, and what is the same everywhere goes once."""
        return _arrived, ([_told(array) for array in self.arrays().values()], self.messages)

    @property
    def ends(self) -> Vector:
        """(m, n) the last point of each run; nan where it has none."""
        last = np.maximum(self.filled - 1, 0)
        points = self.points[np.arange(len(last)), last] if self.points.shape[1] else self.points.sum(axis=1)
        return np.where(self.filled[:, None] > 0, points, np.nan)


def _told(array: NDArray[Any]) -> tuple[NDArray[Any], str, tuple[int, ...]]:
    """Numbers (k,) or (1,), their type, and the shape of the array."""
    flat = np.ascontiguousarray(array).reshape(-1)
    bits = flat.view(f"i{array.itemsize}")
    if flat.size and (bits == bits[0]).all():
        flat = flat[:1]
    elif flat.size and array.dtype.kind == "i":
        flat = flat.astype(np.result_type(*map(np.min_scalar_type, (flat.min(), flat.max()))))
    return flat, array.dtype.str, array.shape


def _arrived(told: Sequence[tuple[NDArray[Any], str, tuple[int, ...]]], messages: dict[int, str]) -> RunRows:
    """The rows that were told."""
    arrays = [np.empty(shape, dtype) for _, dtype, shape in told]
    for array, (numbers, _, _) in zip(arrays, told, strict=True):
        array.reshape(-1)[:] = numbers
    return RunRows(*arrays, messages=messages)


def joined(pieces: Sequence[RunRows], begins: Sequence[int]) -> RunRows:
    """The rows of all chunks, which begin at these runs."""
    if len(pieces) == 1:
        return pieces[0]
    messages = {b + i: text for piece, b in zip(pieces, begins, strict=True) for i, text in piece.messages.items()}
    arrays = [piece.arrays() for piece in pieces]
    return RunRows(**{name: np.concatenate([piece[name] for piece in arrays]) for name in arrays[0]}, messages=messages)  # type: ignore[arg-type]
