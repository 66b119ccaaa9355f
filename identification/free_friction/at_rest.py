"""What releases of sticks say of friction at rest, as one row beside the slips.

    0 = mean x^2 (mu, constants) +- deviation,    x^2 of each stick as in `estimators.sticks`, for a breakaway of no age

A stick lets go where it carries mu(0), and creeps away from there: what follows, up to the slip speeds that slips are
followed from, tells the curve below these. The deviation is the scatter of the sticks, whatever sensors make it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.estimators.sticks import (
    FEWEST,
    STEPS,
    Sticks,
    carried,
    first_guess,
    first_releases,
    only,
    searched,
    sensed,
    sticks_of,
)
from identification.free_friction.guess import MODES, STARTS, WRONG, Guess
from identification.free_friction.result import COEFFICIENTS
from identification.free_friction.slips import Slips
from identification.laws import find_law
from identification.laws.law import FittableLaw

SHARE = 1e-3  # by which values and logarithms are moved for a derivative
CREEP = 0.02  # m/s, up to which sticks are followed


@dataclass(eq=False)
class Releases:
    """Sticks that let go, followed with the curve of slips. at: (n, 2) of each, where they were found last."""

    slips: Slips
    sticks: Sticks
    at: np.ndarray

    @classmethod
    def of(cls, slips: Slips) -> Releases | None:
        """None where there are too few, the contact gives way, a disturbance acts on it, or nothing but an encoder
        shows the angle."""
        ready = slips.ready
        if slips.terms or any(motion.passes is not None for motion in ready.motions):
            return None
        sticks = sticks_of(ready)
        if sticks is None or slips.soft:
            return None
        return cls(slips, sticks, np.zeros((0, 2)))

    def rough(self, guess: Guess) -> float:
        """Friction coefficient at rest as the force that sticks carried last, to some percent."""
        _, rig, seen = self._bench(guess)
        return float(np.median(carried(seen, rig, *first_releases(seen, rig, self.slips.ready))[0]))

    def begun(self, guess: Guess) -> Releases | None:
        """Those that can be followed at a guess; None where too few can."""
        q, rig, seen = self._bench(guess)
        search = searched(seen, self._law, q, rig, first_guess(seen, self._law, q, rig, self.slips.ready), STEPS)
        if np.count_nonzero(search.good) < FEWEST:
            return None
        return Releases(self.slips, only(self.sticks, search.good), search.at[search.good])

    def row(self, guess: Guess, tau: float, whole: bool) -> tuple[float, np.ndarray]:
        """Residual and its derivative (m,) by what slips share, whitened; whole: by constants too. tau: deviation of
        torques that no term explains, which move the level of all sticks."""
        self.at, weight = self._followed(guess, STEPS)
        squares, names = self.at[:, 1], self.slips.names
        mean, nothing = float(weight @ squares), np.zeros((len(self.slips.segments), STARTS + MODES))
        felt = np.arange(COEFFICIENTS) <= np.argmax(self.slips.curve.weights(np.array(CREEP))) + 1
        slope = np.zeros(COEFFICIENTS + len(names))
        for column, name in enumerate([*felt, *names]):
            if isinstance(name, str) and name.endswith(WRONG):
                slope[column] = slope[COEFFICIENTS + names.index(name.removesuffix(WRONG))]
            elif name if column < COEFFICIENTS else whole and name != "delay":
                moved = guess.moved(SHARE * np.eye(len(slope))[column], nothing, names)
                slope[column] = (weight @ self._followed(moved, 1)[0][:, 1] - mean) / SHARE
        spare = len(squares) / (len(squares) - 2)
        variance = spare * float(weight**2 @ (squares - mean) ** 2) + (tau * float(np.sum(slope[:COEFFICIENTS]))) ** 2
        return mean / float(np.sqrt(variance)), slope / np.sqrt(variance)

    def _followed(self, guess: Guess, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """theta_0 and x^2 of each (n, 2), by steps from where they were last; weights (n,) of the latter."""
        q, rig, seen = self._bench(guess)
        search = searched(seen, self._law, q, rig, self.at, steps)
        return search.at, search.weight / search.weight.sum()

    @cached_property
    def _law(self) -> FittableLaw:
        curve = self.slips.curve
        return replace(find_law("free"), value=lambda speed, q: curve.value(q[:-1], speed))

    def _bench(self, guess: Guess):
        """Values of the law, rig and what is seen at a guess."""
        slips, sensors = self.slips, self.slips.ready.sensors
        rig = slips.rig(guess)
        gain = sensors.gain + sum(guess.shared.get(name, 0.0) for name in ("gain", "gain" + WRONG))
        seen = sensed(self.sticks, {"gain": gain, "R": rig.R}, slips.ready)
        return np.append(guess.coefficients, slips.curve.greatest), rig, seen
