"""Event times of methods that go over a boundary without stopping: the sides are looked at after every step."""

from collections.abc import Callable
from typing import Any

from scipy.optimize import brentq

from fmu_models.base.arrays import Vector
from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.validation.methods.equations import Equations, Mode
from fmu_models.validation.methods.result import CLOSED, MINUS, OPEN, PLUS, RELEASED, STICK, SwitchEvent


class Sides:
    """Which side of its boundaries every contact is on along a path, and when that changed.

    Roots are those of the interpolant that the method has between two steps; two within one step are missed.
    """

    def __init__(self, equations: Equations) -> None:
        self.contacts = equations.contacts
        depths = [0 if c.depth is None else c.depth for c in self.contacts]
        signs = equations.signs((STICK,) * len(self.contacts))
        releases = [0 if c.release is None else equations.place(c.release, signs) for c in self.contacts]
        self._values = equations.function([*(c.slip for c in self.contacts), *depths, *releases])
        self.switches: list[SwitchEvent] = []
        self.states: list[int] = []

    def read(self, t: float, z: Vector | list[float]) -> tuple[list[float], list[float], list[float]]:
        """Slips, depths and release functions of all contacts, each a list (n_contacts,)."""
        values, n = self._values(t, z), len(self.contacts)
        return values[:n], values[n : 2 * n], values[2 * n :]

    def begin(self, t: float, z: Vector) -> None:
        """States at the start, without stick."""
        self.switches = []
        slips, depths, releases = self.read(t, z)
        self.states = []
        for c, y, d, r in zip(self.contacts, slips, depths, releases, strict=True):
            if c.kind.normal:
                inside = d > 0.0 or (d == 0.0 and y > 0.0)
                self.states.append((CLOSED if c.release is None or r >= 0.0 else RELEASED) if inside else OPEN)
            else:
                self.states.append(_side(c, y, d))

    def step(self, t0: float, t1: float, between: Callable[[float], Any], mode: Mode | None = None) -> None:
        """Take in a step from t0 to t1; ``mode`` has the stick that the method saw at its end, at t1."""
        values = self.read(t1, between(t1))
        for i, (contact, y, d, r) in enumerate(zip(self.contacts, *values, strict=True)):
            old = self.states[i]
            if contact.kind.normal:
                self._stop(i, d, r, t0, t1, between)
                continue
            new = mode[i] if mode is not None and mode[i] in (STICK, OPEN) else _side(contact, y, d)
            if new != old:
                slot = 0 if OPEN not in (new, old) else 1
                self._change(i, new, t1 if STICK in (new, old) else self._root(slot, i, t0, t1, between))

    def _stop(self, i: int, d: float, r: float, t0: float, t1: float, between: Callable[[float], Any]) -> None:
        old, pushing = self.states[i], self.contacts[i].release is None or r >= 0.0
        if old == OPEN and d > 0.0:
            self._change(i, CLOSED, self._root(1, i, t0, t1, between))
            old = CLOSED
        elif old == RELEASED and d > 0.0 and pushing:
            self._change(i, CLOSED, self._root(2, i, t0, t1, between))
        if old == CLOSED and not pushing:
            self._change(i, RELEASED, self._root(2, i, t0, t1, between))
            old = RELEASED
        if old != OPEN and d <= 0.0:
            self._change(i, OPEN, self._root(1, i, t0, t1, between))

    def _change(self, i: int, new: int, t: float) -> None:
        self.switches.append(SwitchEvent(t, self.contacts[i].name, self.states[i], new))
        self.states[i] = new

    def _root(self, kind: int, i: int, t0: float, t1: float, between: Callable[[float], Any]) -> float:
        """Zero of slip, depth or release (``kind`` 0, 1, 2) between two times; the later one if the signs are alike."""

        def value(t: float) -> float:
            return self.read(t, between(t))[kind][i]

        if value(t0) * value(t1) > 0.0:
            return t1
        root: Any = brentq(value, t0, t1, xtol=1e-15 * max(abs(t1), t1 - t0))
        return float(root)


def _side(contact: ContactDynamics, slip: float, depth: float) -> int:
    return OPEN if contact.depth is not None and depth < 0.0 else MINUS if slip < 0.0 else PLUS
