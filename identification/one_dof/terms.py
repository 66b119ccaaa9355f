"""Terms of a linear inverse-dynamics model of one degree of freedom.

    effort = sum_i parameter_i regressor_i(q, q', q'')

| term | regressor | | term | regressor |
|---|---|---|---|---|
| inertia | q'' | | coulomb | sgn q' |
| viscous | q' | | coulomb-arctan | atan(q'/speed) |
| quadratic | q' abs(q') | | coulomb-tanh | tanh(q'/speed) |
| offset | 1 | | coulomb+, coulomb- | max(sgn q', 0), min(sgn q', 0) |
| stiffness | q | | viscous+, viscous- | max(q', 0), min(q', 0) |
| gravity | g sin q | | | |

Source of the form: Khalil, Dombre, Modeling, Identification and Control of Robots (2002), chapter 12.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

GRAVITY = 9.81  # m/s2

Signals = Mapping[str, np.ndarray]  # position, velocity, acceleration, each (n,)


@dataclass(frozen=True)
class Kind:
    """A kind of term. regressor(signals, speed) -> (n,); unit for a body that slides and for one that turns (None: has
    no such term); needs: signals; friction: part of the friction law; positive: a value below zero has no meaning."""

    regressor: Callable[[Signals, float], np.ndarray]
    sliding_unit: str | None
    turning_unit: str
    needs: str | None
    meaning: str
    friction: bool = False
    positive: bool = False
    smoothed: bool = False


@dataclass(frozen=True)
class Speed:
    """A speed as a recipe gives it; unit: m/s or rad/s, None for a plain number, which is in that of the body."""

    value: float
    unit: str | None = None

    def fits(self, turning: bool) -> bool:
        """Whether it is one of a body that turns (or slides)."""
        return self.unit in (None, "rad/s" if turning else "m/s")


@dataclass(frozen=True)
class Term:
    """A term by the name of its parameter. speed: over which a smoothed Coulomb term turns."""

    name: str
    kind: str
    speed: Speed | None = None

    def regressor(self, signals: Signals) -> np.ndarray:
        """Values (n,)."""
        return KINDS[self.kind].regressor(signals, self.speed.value if self.speed else 0.0)

    def unit(self, turning: bool) -> str | None:
        """Of its parameter; None if there is no such term for this kind of motion."""
        return KINDS[self.kind].turning_unit if turning else KINDS[self.kind].sliding_unit


def _viscous(units: tuple[str, str], part: Callable[[np.ndarray], np.ndarray], meaning: str) -> Kind:
    return Kind(lambda s, _: part(s["velocity"]), *units, "velocity", meaning, friction=True, positive=True)


def _coulomb(part: Callable[[np.ndarray, float], np.ndarray], meaning: str, smoothed: bool = False) -> Kind:
    return Kind(
        lambda s, speed: part(s["velocity"], speed),
        "N",
        "N m",
        "velocity",
        meaning,
        friction=True,
        positive=True,
        smoothed=smoothed,
    )


_VISCOUS = ("N s/m", "N m s/rad")
KINDS: Mapping[str, Kind] = {
    "inertia": Kind(lambda s, _: s["acceleration"], "kg", "kg m2", "acceleration", "inertia", positive=True),
    "viscous": _viscous(_VISCOUS, lambda v: v, "viscous friction"),
    "viscous+": _viscous(_VISCOUS, lambda v: np.maximum(v, 0), "viscous friction, forwards"),
    "viscous-": _viscous(_VISCOUS, lambda v: np.minimum(v, 0), "viscous friction, backwards"),
    "quadratic": _viscous(("N s2/m2", "N m s2/rad2"), lambda v: v * np.abs(v), "quadratic friction"),
    "coulomb": _coulomb(lambda v, _: np.sign(v), "Coulomb friction"),
    "coulomb+": _coulomb(lambda v, _: np.maximum(np.sign(v), 0), "Coulomb friction, forwards"),
    "coulomb-": _coulomb(lambda v, _: np.minimum(np.sign(v), 0), "Coulomb friction, backwards"),
    "coulomb-arctan": _coulomb(lambda v, w: np.arctan(v / w), "Coulomb friction times 2/pi, smoothed", True),
    "coulomb-tanh": _coulomb(lambda v, w: np.tanh(v / w), "Coulomb friction, smoothed", True),
    "offset": Kind(lambda s, _: np.ones_like(s["velocity"]), "N", "N m", None, "offset of the effort"),
    "gravity": Kind(
        lambda s, _: GRAVITY * np.sin(s["position"]), None, "kg m", "position", "mass times its distance", positive=True
    ),
    "stiffness": Kind(lambda s, _: s["position"], "N/m", "N m/rad", "position", "stiffness", positive=True),
}

# friction laws that are sums of terms, the names of their parameters in front
LINEAR_LAWS: Mapping[str, Mapping[str, str]] = {
    "Coulomb": {"F_c": "coulomb"},
    "Coulomb+viscous": {"F_c": "coulomb", "F_v": "viscous"},
    "Coulomb+viscous by direction": {
        "F_c+": "coulomb+",
        "F_c-": "coulomb-",
        "F_v+": "viscous+",
        "F_v-": "viscous-",
    },
}


def sign_of(terms: tuple[Term, ...]) -> Callable[[np.ndarray], np.ndarray]:
    """The sign function that goes with the Coulomb term of a model, with the limits -1 and 1."""
    for term in terms:
        speed = term.speed.value if term.speed else 0.0
        if term.kind == "coulomb-arctan":
            return lambda v: 2 / np.pi * np.arctan(v / speed)
        if term.kind == "coulomb-tanh":
            return lambda v: np.tanh(v / speed)
    return np.sign
