"""Terms of a linear inverse-dynamics model of one degree of freedom, and how a recipe names them.

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

from fmu_models.base.errors import StickslipError, nearest
from identification.laws import slip_laws
from identification.measurement.recipe import EFFORT, VELOCITY, Recipe, Speed, speed
from identification.measurement.signals import GRAVITY, Prepared

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

# a friction law that is no function of slip speed alone, as the terms that it is the sum of, by their parameters
BY_DIRECTION = "Coulomb+viscous by direction"
DIRECTIONS: Mapping[str, str] = {"F_c+": "coulomb+", "F_c-": "coulomb-", "F_v+": "viscous+", "F_v-": "viscous-"}


def comparable() -> tuple[str, ...]:
    """Names of the laws that a recipe may compare."""
    return (*slip_laws(), BY_DIRECTION)


@dataclass(frozen=True)
class Model:
    """What a recipe says that the effort is. terms: the sum; laws: of friction, to be compared in place of the friction
    terms; normal_force: N, None where it is not known."""

    terms: tuple[Term, ...]
    laws: tuple[str, ...] = ()
    normal_force: float | None = None


def read_model(recipe: Recipe) -> Model:
    """The tables [terms] and [friction] of a recipe.

    Raises:
        StickslipError: there are no terms, or what is wrong in them, with its line.
    """
    terms = tuple(_term(recipe, name) for name in recipe.document.table("terms"))
    if not terms:
        raise StickslipError(f"Recipe {recipe.name} has no [terms]; it is one for 'stickslip slips'.")
    return Model(terms, *_friction(recipe))


def check_terms(recipe: Recipe, prepared: Prepared, terms: tuple[Term, ...]) -> None:
    """Refuse terms that the log has no signal for, or that this kind of motion does not have.

    Raises:
        StickslipError: which, and what is missing.
    """
    for term in terms:
        needs = KINDS[term.kind].needs
        if needs and needs not in recipe.signals:
            raise StickslipError(
                f"{recipe.name}: term '{term.name}' ({term.kind}) needs the signal '{needs}'. Add [signals.{needs}]."
            )
        if term.unit(prepared.turning) is None:
            raise StickslipError(
                f"{recipe.name}: term '{term.name}' ({term.kind}) is one of a body that turns; this one slides."
            )
        if term.speed:
            prepared.check_speed(recipe, term.name, term.speed)
    for name in (EFFORT, VELOCITY):
        if name not in recipe.signals:
            raise StickslipError(f"{recipe.name} has no signal '{name}'. Add [signals.{name}].")


def sign_of(terms: tuple[Term, ...]) -> Callable[[np.ndarray], np.ndarray]:
    """The sign function that goes with the Coulomb term of a model, with the limits -1 and 1."""
    for term in terms:
        speed = term.speed.value if term.speed else 0.0
        if term.kind == "coulomb-arctan":
            return lambda v: 2 / np.pi * np.arctan(v / speed)
        if term.kind == "coulomb-tanh":
            return lambda v: np.tanh(v / speed)
    return np.sign


def _term(recipe: Recipe, name: str) -> Term:
    document = recipe.document
    raw = document.table("terms")[name]
    place: tuple[str, ...] = ("terms", name)
    over = None
    if isinstance(raw, dict):
        document.check_keys(("term", "speed"), *place)
        kind = document.text("term", *place)
        if "speed" in raw:
            over = speed(document, raw["speed"], *place, "speed")
    elif isinstance(raw, str):
        kind = raw
    else:
        raise document.fault(
            f"term '{name}' must be the name of a term, such as \"viscous\", or a table with it; found {raw!r}.", *place
        )
    if kind not in KINDS:
        raise document.fault(f"'{kind}' is not a term.{nearest(kind, KINDS)}", *place)
    if KINDS[kind].smoothed != (over is not None) or (over is not None and over.value <= 0):
        what = "needs 'speed', the speed over which it turns, above 0" if KINDS[kind].smoothed else "has no 'speed'"
        raise document.fault(f"term '{name}' ({kind}) {what}.", *place)
    return Term(name, kind, over)


def _friction(recipe: Recipe) -> tuple[tuple[str, ...], float | None]:
    document = recipe.document
    document.check_keys(("compare", "normal_force"), "friction")
    table = document.table("friction")
    laws = document.names("compare", "friction") or ()
    for law in laws:
        if law not in comparable():
            hint = nearest(law, comparable())
            raise document.fault(f"there is no friction law '{law}'.{hint}", "friction", "compare")
    if len(laws) == 1:
        raise document.fault("'compare' needs two laws or more.", "friction", "compare")
    if "normal_force" not in table:
        return laws, None
    normal_force = document.value(table["normal_force"], "N", "friction", "normal_force")
    if normal_force <= 0:
        raise document.fault("'normal_force' must be above 0 N.", "friction", "normal_force")
    return laws, normal_force
