"""A mass on sliders and dry friction by other means: event-split DOP853, one mode after another.

m x'' = a sin(w t) - k x - sum k_i z_i - friction; |friction| <= mu N in stick, z_i' = x' unless it yields at +-D_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from fmu_models import TIME, Coordinate, Mechanism, Parameter

NEAR = 1e-11  # of a bound: there

m = Parameter("m", 1.0, "kg", "mass", positive=True)
k = Parameter("k", 1.0, "N/m", "spring")
a = Parameter("a", 2.0, "N", "drive")
w = Parameter("w", 1.3, "rad/s", "frequency")
N = Parameter("N", 1.0, "N", "normal force", positive=True)
x = Coordinate("x", "m", "displacement", velocity="v")


def driven_mass(name: str, *contacts: object) -> Mechanism:
    """A mass on a spring, shaken by a sine, with contacts of its own."""
    return Mechanism(
        name=name,
        title="driven mass held by forces with memory",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        applied={x: a * sympy.sin(w * TIME)},
        contacts=list(contacts),  # type: ignore[arg-type]
    )


@dataclass(frozen=True)
class MassOnSliders:
    """m, k: of the body; stiffness, bound: (n,) of the sliders; hold: N, of friction; a, w: of the drive."""

    m: float
    k: float
    stiffness: np.ndarray
    bound: np.ndarray
    hold: float
    a: float
    w: float

    def force(self, t: float, y: np.ndarray) -> float:
        """Without friction."""
        return self.a * np.sin(self.w * t) - self.k * y[0] - self.stiffness @ y[2:]

    def run(self, end: float, x: float, v: float) -> tuple[np.ndarray, int]:
        """States (2 + n,) at the end, from unloaded sliders, and the number of changes of mode."""
        t, y, changes = 0.0, np.array([x, v, *np.zeros(len(self.bound))]), 0
        while True:
            sense, yields = self._mode(t, y)
            events = self._events(sense, yields)
            for event in events:
                event.terminal, event.direction = True, -1
            run = solve_ivp(
                self._rates(sense, yields), (t, end), y, "DOP853", events=events, rtol=1e-13, atol=1e-14, max_step=0.05
            )
            t, y, changes = run.t[-1], run.y[:, -1].copy(), changes + 1
            if run.status != 1:
                return y, changes
            for i, room in enumerate(self.bound):
                if abs(abs(y[2 + i]) - room) < NEAR:
                    y[2 + i] = np.sign(y[2 + i]) * room
            if abs(y[1]) < NEAR:
                y[1] = 0.0

    def _mode(self, t: float, y: np.ndarray) -> tuple[int, np.ndarray]:
        """Sense of slip, 0 in stick; and which sliders yield."""
        sense = int(np.sign(y[1]))
        if sense == 0 and abs(self.force(t, y)) > self.hold - NEAR:
            sense = int(np.sign(self.force(t, y)))
        return sense, (np.abs(y[2:]) == self.bound) & (np.sign(y[2:]) == sense)

    def _rates(self, sense: int, yields: np.ndarray):
        def rates(t: float, y: np.ndarray) -> np.ndarray:
            if sense == 0:
                return np.zeros(len(y))
            return np.array([y[1], (self.force(t, y) - sense * self.hold) / self.m, *np.where(yields, 0.0, y[1])])

        return rates

    def _events(self, sense: int, yields: np.ndarray) -> list:
        if sense == 0:
            return [lambda t, y: self.hold - self.force(t, y), lambda t, y: self.hold + self.force(t, y)]
        rooms = [lambda t, y, i=i: self.bound[i] - sense * y[2 + i] for i in range(len(self.bound)) if not yields[i]]
        return [lambda t, y: sense * y[1], *rooms]
