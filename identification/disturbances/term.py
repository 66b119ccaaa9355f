"""Parameters of disturbances, and how friction and sensors depend on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import reduce
from types import ModuleType
from typing import Any

import numpy as np

from identification.inference.problem import Prior, Unknown

LARGEST = 0.9  # of a relative term: what it is a share of does not change its sign
WIDTH = 0.03  # of a relative term, the deviation that a contest of explanations assumes beforehand
FRICTION, SPRING, DAMPING, DRIVE = "friction", "spring", "damping", "drive"  # what has factors
ANGLE, LASER = "angle", "laser"  # sensors that a disturbance may change
SENSOR_UNITS = {ANGLE: "rad", LASER: "m"}


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """Where and when friction acted, as arrays that broadcast to one shape.

    Attributes:
        turned: angle of the drive, rad.
        angle: angle of the body, rad; in a formula, from the reference of its term.
        share: of the log that is gone, -1/2 to 1/2.
        log: number of the log.
        load: normal force by a load cell over its mean.
        duration: of the log, s.
        speed: of the body, rad/s.
        side: 1 where the disc is the faster one, -1 where the body is.
        warmer: temperature over its mean in all logs, K.
    """

    turned: np.ndarray
    angle: np.ndarray
    share: np.ndarray
    log: np.ndarray
    load: np.ndarray
    duration: np.ndarray
    speed: np.ndarray
    side: np.ndarray
    warmer: np.ndarray

    @classmethod
    def seen(cls, log: np.ndarray, number: int, time: np.ndarray, angle: np.ndarray, speed: np.ndarray) -> Whereabouts:
        """Of the samples of a sensor (n,), for which the drive does not count. log: times of all, s, of its number."""
        one, lasts = np.ones(len(time)), log[-1] - log[0]
        return cls(0 * one, angle, (time - log[0]) / lasts - 0.5, number * one, one, lasts * one, speed, one, 0 * one)

    @classmethod
    def joined(cls, pieces: Sequence[Whereabouts]) -> Whereabouts:
        """Arrays of several joined along the first axis."""
        return cls(*(np.concatenate([getattr(piece, name.name) for piece in pieces]) for name in fields(cls)))

    def map(self, function: Callable[[np.ndarray], np.ndarray]) -> Whereabouts:
        """The same whereabouts with a function of each array."""
        return Whereabouts(*(function(getattr(self, name.name)) for name in fields(self)))


@dataclass(frozen=True)
class Effect:
    """How a term acts.

    Attributes:
        name: of its parameters in the disturbed oscillator, before their order.
        formula: (whereabouts, order, functions) -> what the term multiplies. ``functions`` is `numpy` for a column of
            the regression and `sympy` for the oscillator of the shooting, with symbols as whereabouts. What a laser
            shows too much is over R.
        meaning: of the parameter of that order.
        factor: terms of one factor are added, and the factors multiplied; its name if left out.
        acts: on what: the factor of friction, spring, damping or speed of the drive (`FRICTION`, `SPRING`, `DAMPING`,
            `DRIVE`), or what a sensor shows too much (`ANGLE`, `LASER`).
        angular: whether the unit is 1/rad to the power of the order.
        measure: the unit where it is another.
        limits: of the search.
        width: of the parameter of an order, the deviation that a contest of explanations assumes beforehand.
    """

    name: str
    formula: Callable[[Any, int, ModuleType], Any]
    meaning: Callable[[int], str] = lambda order: ""
    factor: str = ""
    acts: str = FRICTION
    angular: bool = False
    measure: str = ""
    limits: tuple[float, float] = (-LARGEST, LARGEST)
    width: Callable[[int], float] = lambda order: WIDTH

    @property
    def sensor(self) -> str:
        """The sensor that shows too much; empty if there is none."""
        return self.acts if self.acts in SENSOR_UNITS else ""

    def unit(self, order: int) -> str:
        """The unit of the parameter of an order."""
        if self.angular:
            return "1/rad" if order == 1 else f"1/rad^{order}"
        return self.measure or ("rad" if self.sensor == ANGLE else "1")


@dataclass(frozen=True)
class DisturbanceTerm:
    """One parameter of a disturbance.

    Attributes:
        log: the only one that it is of; None: all.
        reference: angle of the body that its effect is counted from, rad.
        prior: what is assumed beforehand.
        words: what it means.
        cause: name of the disturbance.
        random: whether it is one of many that are normal with the width of its effect, in a fit of a law too.
    """

    name: str
    effect: Effect
    order: int = 0
    log: int | None = None
    reference: float = 0.0
    prior: Prior | None = None
    words: str = ""
    cause: str = field(default="", kw_only=True)
    random: bool = field(default=False, kw_only=True)

    @classmethod
    def told(
        cls, name: str, effect: Effect, order: int, reading: tuple[float, float] | None, source: str
    ) -> DisturbanceTerm:
        """A term of which a value and its deviation are known from elsewhere, if they are."""
        prior = None if reading is None else Prior(name, reading[0], effect.unit(order), reading[1], source)
        return cls(name, effect, order, prior=prior)

    def shape(self, where: Whereabouts) -> np.ndarray:
        """The shape that the term's value multiplies."""
        at = replace(where, angle=where.angle - self.reference) if self.reference else where
        value = self.effect.formula(at, self.order, np)
        if self.effect.sensor == ANGLE:
            value = np.full_like(where.angle, value)
        elif self.effect.sensor == LASER:
            value = value / np.cos(where.angle)
        return value if self.log is None else value * (where.log == self.log)

    @property
    def of_sensor(self) -> bool:
        """Whether it changes what a sensor shows, and not friction."""
        return bool(self.effect.sensor)

    @property
    def by_inverse_dynamics(self) -> bool:
        """Whether inverse dynamics can show it: it changes friction or a sensor, and not the motion itself."""
        return self.of_sensor or self.effect.acts == FRICTION

    @property
    def first(self) -> float:
        """Value where a search begins."""
        return self.prior.value if self.prior else 0.0

    @property
    def parameter(self) -> str:
        """The term's parameter in the disturbed oscillator."""
        return f"{self.effect.name}{self.order}"

    @property
    def unknown(self) -> Unknown:
        """The term as an unknown of a problem."""
        unit, prior = self.effect.unit(self.order), self.prior
        if self.random:
            prior = Prior(self.name, 0.0, unit, self.effect.width(self.order), self.cause, many=True)
        return Unknown(self.name, unit, *self.effect.limits, self.words, prior)


def disturbed(
    terms: Sequence[DisturbanceTerm], x: np.ndarray, where: Whereabouts, acts: str = FRICTION
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Factor of the friction, or of what else terms act on, where it acted, and its derivative by each term. x: (m,)
    values."""
    mine = [term.effect.acts == acts for term in terms]
    shapes = [term.shape(where) if acting else np.zeros(1) for term, acting in zip(terms, mine, strict=True)]
    factors = [term.effect.factor or term.effect.name for term in terms]
    sums: dict[str, np.ndarray] = {}
    for value, shape, factor, acting in zip(x, shapes, factors, mine, strict=True):
        if acting:
            sums[factor] = sums.get(factor, np.ones(1)) + value * shape
    products = {factor: _product([sums[name] for name in sums if name != factor]) for factor in sums}
    slopes = [
        shape * products[factor] if acting else shape
        for shape, factor, acting in zip(shapes, factors, mine, strict=True)
    ]
    return _product(list(sums.values())), slopes


def misread(terms: Sequence[DisturbanceTerm], x: np.ndarray, where: Whereabouts) -> tuple[np.ndarray, list[np.ndarray]]:
    """Angle (rad) that the sensor showed too much, and its derivative by each term. x: (m,) values."""
    slopes = [term.shape(where) if term.of_sensor else np.zeros(1) for term in terms]
    return sum((value * slope for value, slope in zip(x, slopes, strict=True)), np.zeros(1)), slopes


def _product(factors: Sequence[np.ndarray]) -> np.ndarray:
    return reduce(np.multiply, factors, np.ones(1))
