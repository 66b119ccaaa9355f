"""What tells an event of a co-simulation that changes something: discrete variables, and states that jump."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fmu_models.coupling.histories import Vector

COUNTING, COUNTING_FIXED = 60, 3  # changes in a row that are no events any more; in steps of one length
CONTINUOUS = 1e-9  # of 1 + |x|: a state that moves by no more does not jump


class Watch:
    """Discrete variables and moving states in the rows that a run reads.

    Args:
        owners: of every discrete variable, the name of its unit.
        first: its place in a row; behind it come all of them, the states, and the rates of these.
        n_states: number of states.
        fixed: all steps are of one length, so that none is repeated to find an event.
    """

    def __init__(self, owners: Sequence[str], first: int, n_states: int, fixed: bool) -> None:
        n = len(owners)
        self.owners, self._discrete = list(owners), slice(first, first + n)
        self._states = slice(first + n, first + n + n_states)
        self._rates = slice(first + n + n_states, first + n + 2 * n_states)
        self._changes, self._counting = np.zeros(n, dtype=int), COUNTING_FIXED if fixed else COUNTING

    def count(self, before: Vector, after: Vector) -> None:
        """Note what a step has changed: a variable that changes in every one, as a count does, tells no event."""
        changed = before[self._discrete] != after[self._discrete]
        if changed.any() or self._changes.any():
            self._changes = np.where(changed | (self._changes >= self._counting), self._changes + changed, 0)

    def same(self, before: Vector, after: Vector) -> bool:
        """Whether all discrete variables are as before."""
        return bool((before[self._discrete] == after[self._discrete]).all())

    def switched(self, before: Vector, after: Vector) -> str:
        """The first unit that has changed a discrete variable; empty where none has."""
        changed = (before[self._discrete] != after[self._discrete]) & (self._changes < self._counting)
        return self.owners[int(np.argmax(changed))] if changed.any() else ""

    def is_void(self, before: Vector, after: Vector, h: float) -> bool:
        """Whether all discrete variables are the same, and no state has jumped in the time h."""
        x = after[self._states]
        rates = np.maximum(np.abs(before[self._rates]), np.abs(after[self._rates]))
        smooth = np.abs(x - before[self._states]) <= 2.0 * rates * h + CONTINUOUS * (1.0 + np.abs(x))
        return self.same(before, after) and bool(smooth.all())
