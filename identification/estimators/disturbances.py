"""What a real bench adds to the law: disturbances of one driving disc and of the angle sensor, as terms of few
parameters.

    F = N mu(|v|) (1 + sum_n a_n cos(n phi) + b_n sin(n phi)) (1 + sum_n g_n (theta - theta_0)^n) (1 + s_i + t_i u)
    laser: sin(theta + z) + o_i + d_i1 u + d_i2 (u^2 - 1/12) + sum_n d_in cos((n - 2) pi (u + 1/2)),   n = 3 .. 6
    angle sensor: theta + z

phi angle of the drive (n = 1, 2: a disc that runs out of true, a bent shaft), theta angle of the body (n = 1, 2, 3),
i number of the log and u the share of it that is gone, from -1/2 to 1/2 (wear; s_1 = 0); z zero of the sensor, o_i and
d_in slow drift of the laser over R (cosines converge fast once a parabola has taken the slopes at both ends). So mu is
the friction at theta_0 in the middle of the first log, on average over a turn of the drive. What a sensor shows too
much counts as friction k z/(R N), whichever way the disc slips: drives that all turn one way do not tell it from mu.
Then o_1 is only known to be of the size of the drift (half of the greatest), which it had in a free decay too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from identification.inference.problem import Prior, Unknown
from identification.measurement.pooled import Pool
from identification.measurement.stated import weighed

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.lowering.hybrid_system import HybridSystem

HARMONICS = (1, 2)
POWERS = (1, 2, 3)
CURVES = 6  # of a drift in each log, as many as `measurement.laser_drift` takes
FORCE, FORCE_EACH, ANGLE, WEAR = "normal-force", "normal-force-each", "angle", "wear"
ZERO, DRIFT = "zero", "drift"
CAUSES: Mapping[str, str] = {
    FORCE: "the normal force changes with the angle of the drive (run-out of the disc or its shaft)",
    FORCE_EACH: "the normal force changes with the angle of the drive, whose counter was reset between the logs",
    ANGLE: "friction depends on the angle of the body (a worn or dirty place)",
    WEAR: "friction changes with time, within the logs or from one to the next (wear, heat, humidity)",
    ZERO: "the zero of the angle sensor is off, as drives that turn both ways tell",
    DRIFT: "the laser drifts, and no encoder shows how: told by friction alone it is known poorly",
}
MIDDLE_ANGLE = "middle_angle"  # of the disturbed oscillator
WHERE = ("turned", "angle", "share", "log", "load")  # fields of a place
CELL, SURE = "load", 0.01  # the force of a load cell as a term: 1 of it, give or take so much
LARGEST = 0.9  # of a relative term: friction does not change its sign
FURTHEST = 0.1  # rad, of what a sensor shows too much
LEAST_TURN = np.pi  # rad that a drive turns in slip, the least that shows what its angle does
LEAST_SWING = 5e-3  # rad, the same of the body
DRIFTING, LEAST_DRIFT = 2e-4, 1e-5  # m, of a laser: assumed until it is found, and at least
SAME_SPEED = 0.05  # relative difference of drive speeds


@dataclass(frozen=True, eq=False)
class Place:
    """Where and when friction acted, arrays that broadcast to one shape. turned: rad, angle of the drive; angle: rad,
    of the body; share: of the log that is gone, -1/2 to 1/2; log: number of the log; load: normal force by a load
    cell over its mean."""

    turned: np.ndarray
    angle: np.ndarray
    share: np.ndarray
    log: np.ndarray
    load: np.ndarray

    def of(self, rows: np.ndarray | slice) -> Place:
        """Rows (k,) of the first axis."""
        return Place(*(getattr(self, name)[rows] for name in WHERE))


@dataclass(frozen=True)
class Term:
    """One parameter of a disturbance. moves: what it changes: friction by "cos" or "sin" of ``order`` turns, by "angle"
    to that power or "time" to the power 0 or 1; or what the sensor shows, "zero" of the angle or "drift" by the
    curve of that number; log: the only one that it is of (None: all); reference: rad, theta_0; known: standard
    uncertainty about 0 that is assumed beforehand (0: nothing is)."""

    name: str
    cause: str
    moves: str
    order: int
    log: int | None = None
    reference: float = 0.0
    known: float = 0.0

    def shape(self, place: Place) -> np.ndarray:
        """What it multiplies."""
        match self.moves:
            case "cos":
                value = np.cos(self.order * place.turned)
            case "sin":
                value = np.sin(self.order * place.turned)
            case "angle":
                value = (place.angle - self.reference) ** self.order
            case "load":
                value = place.load - 1
            case "time":
                value = place.share**self.order
            case "zero":
                value = np.ones_like(place.angle)
            case _:
                value = self.drift(place.share) / np.cos(place.angle)
        return value if self.log is None else value * (place.log == self.log)

    def drift(self, share: np.ndarray) -> np.ndarray:
        """What the laser shows too much, over R, for a value of 1. share: (n,) of the log that is gone, from -1/2."""
        match self.order:
            case 0:
                return np.ones_like(share)
            case 1:
                return share
            case 2:
                return share**2 - 1 / 12
            case _:
                return np.cos((self.order - 2) * np.pi * (share + 0.5))

    @property
    def of_sensor(self) -> bool:
        """Whether it changes what the sensor shows, and not friction."""
        return self.moves in ("zero", "drift")

    @property
    def first(self) -> float:
        """Value where a search begins."""
        return float(self.moves == "load")

    @property
    def parameter(self) -> str:
        """Of the disturbed oscillator."""
        return f"{self.moves}{self.order}"

    @property
    def unknown(self) -> Unknown:
        """As an unknown of a problem."""
        if self.moves == "load":
            prior = Prior(self.name, 1.0, "1", SURE, "load cell")
            return Unknown(self.name, "1", 0.0, 2.0, "share of what the load cell shows that friction follows", prior)
        if self.moves == "angle":
            unit, reach = ("1/rad" if self.order == 1 else f"1/rad^{self.order}"), np.inf
        elif self.of_sensor:
            unit, reach = ("rad" if self.moves == "zero" else "1"), FURTHEST
        else:
            unit, reach = "1", LARGEST
        prior = Prior(self.name, 0.0, unit, self.known, "half of the drift") if self.known else None
        return Unknown(self.name, unit, -reach, reach, CAUSES[self.cause], prior)


def terms_of(ready: Pool, causes: Sequence[str], drift: float = DRIFTING) -> tuple[Term, ...]:
    """The terms of these causes for pooled logs. drift: m, its size where it is known.

    Raises:
        StickslipError: an unknown cause, two discs, or logs that cannot show one.
    """
    for cause in causes:
        if cause not in CAUSES:
            raise StickslipError(f"There is no disturbance '{cause}'.{nearest(cause, CAUSES)}")
    if causes and len(ready.contacts) > 1:
        raise StickslipError("Disturbances are estimated with one driving disc. Fit the logs of each disc by itself.")
    if FORCE in causes and FORCE_EACH in causes:
        raise StickslipError(f"'{FORCE}' and '{FORCE_EACH}' are one disturbance. Name one of them.")
    for cause in causes:
        why = hidden(ready, cause)
        if why:
            raise StickslipError(f"These logs cannot show a disturbance '{cause}': {why}")
    loaded = (Term(CELL, CELL, "load", 1),) if len(ready.contacts) == 1 and weighed(ready.motions) else ()
    return (*loaded, *(term for cause in CAUSES if cause in causes for term in _terms(ready, cause, drift)))


def hidden(ready: Pool, cause: str) -> str:
    """Why pooled logs of one disc cannot show a disturbance, and what would; nothing where they can."""
    match cause:
        case "normal-force" | "normal-force-each":
            turned = sum(abs(float(np.sum(segment.drive))) * segment.motion.step for segment in ready.segments)
            if cause == FORCE_EACH and len(ready.motions) == 1:
                return f"there is one log. Name '{FORCE}'."
            if turned < LEAST_TURN:
                return f"the drive turns by {turned:.2g} rad in all slips together. Record for a turn or more."
        case "angle":
            swing = float(np.ptp(np.concatenate([segment.angle for segment in ready.segments])))
            if swing < LEAST_SWING:
                return f"in slip the body turns by {1e3 * swing:.2g} mrad only. Record with lower drive speeds."
            speeds = np.array([np.mean(motion.drive) for motion in ready.motions])
            if np.ptp(speeds) < SAME_SPEED * np.max(np.abs(speeds)):
                return (
                    "all are at one drive speed, where the same slip speeds always come at the same angles. Add logs "
                    "at other drive speeds."
                )
        case "zero":
            if not turns_both_ways(ready):
                return (
                    "all drives turn one way, and friction takes up all that a wrong zero does. Add one log with the "
                    "drive reversed, or a free decay, which shows the zero at rest."
                )
        case "drift":
            if any(motion.log.has("angle") or not motion.log.has("laser") for motion in ready.motions):
                return "not all have their angle from a laser."
            if ready.sensors.lines:
                return "an encoder is beside the laser, and what drift it showed has been taken off."
    return ""


def turns_both_ways(ready: Pool) -> bool:
    """Whether discs slip forward in some of the slips and backward in others."""
    return len({segment.sign for segment in ready.segments}) > 1


def _terms(ready: Pool, cause: str, drift: float) -> list[Term]:
    logs = range(len(ready.motions))
    if cause == FORCE:
        return [Term(f"N_{f}{n}", cause, f, n) for n in HARMONICS for f in ("cos", "sin")]
    if cause == FORCE_EACH:
        return [Term(f"N_{f}{n}_{i + 1}", cause, f, n, i) for i in logs for n in HARMONICS for f in ("cos", "sin")]
    if cause == ANGLE:
        angles = np.concatenate([segment.angle for segment in ready.segments])
        middle = round(0.5 * float(angles.min() + angles.max()), 2)
        return [Term(f"angle{n}", cause, "angle", n, None, middle) for n in POWERS]
    if cause == ZERO:
        return [Term("zero_of_angle", cause, "zero", 0)]
    if cause == DRIFT:
        known = 0.0 if turns_both_ways(ready) else 0.5 * max(drift, LEAST_DRIFT) / ready.values.R
        offsets = [Term(f"drift0_{i + 1}", cause, "drift", 0, i, known=0.0 if i else known) for i in logs]
        curves = [Term(f"drift{n}_{i + 1}", cause, "drift", n, i) for i in logs for n in range(1, CURVES + 1)]
        return [*offsets, *curves]
    scales = [Term(f"scale_{i + 1}", cause, "time", 0, i) for i in logs if i]
    return [*scales, *(Term(f"trend_{i + 1}", cause, "time", 1, i) for i in logs)]


def disturbed(terms: Sequence[Term], x: np.ndarray, place: Place) -> tuple[np.ndarray, list[np.ndarray]]:
    """Factor of the friction where it acted, and its derivative by each term. x: (m,) values."""
    shapes = [np.zeros(1) if term.of_sensor else term.shape(place) for term in terms]
    causes = [term.moves if term.moves not in ("cos", "sin") else "turn" for term in terms]
    sums: dict[str, np.ndarray] = {}
    for value, shape, cause in zip(x, shapes, causes, strict=True):
        sums[cause] = sums.get(cause, np.ones(1)) + value * shape
    others = {cause: _product([one for other, one in sums.items() if other != cause]) for cause in sums}
    slopes = [shape * others[cause] for shape, cause in zip(shapes, causes, strict=True)]
    return _product(list(sums.values())), slopes


def misread(terms: Sequence[Term], x: np.ndarray, place: Place) -> tuple[np.ndarray, list[np.ndarray]]:
    """Angle (rad) that the sensor showed too much, and its derivative by each term. x: (m,) values."""
    slopes = [term.shape(place) if term.of_sensor else np.zeros(1) for term in terms]
    return sum((value * slope for value, slope in zip(x, slopes, strict=True)), np.zeros(1)), slopes


def _product(factors: Sequence[np.ndarray]) -> np.ndarray:
    return reduce(np.multiply, factors, np.ones(1))


def disturbed_oscillator(disc: str, law: str, parameters: tuple[tuple[str, int], ...]) -> Fmu:
    """The rig with one disc ("disc0") whose normal force has these factors (what, order): parameters cos1, sin1, cos2,
    sin2, angle1, angle2, angle3 with ``middle_angle``, rad, time0, time1, an input ``turned``, rad, the drive's angle,
    and with time1 ``middle`` and ``duration`` of the log, s."""
    from fmu_models.codegen.package import built_of, kept_as, kept_by_name
    from fmu_models.fmu.fmu import Fmu

    name = "_".join(["disturbed", *(f"{what}{order}" for what, order in parameters)])

    def made() -> HybridSystem:
        return _disturbed_oscillator(name, disc, law, parameters)

    if not kept_by_name("disc_rig", {disc: law}):
        return Fmu.open(built_of(made()))
    return Fmu.open(kept_as(name, (name, disc, law, Path(__file__).read_bytes()), made))


def _disturbed_oscillator(name: str, disc: str, law: str, parameters: tuple[tuple[str, int], ...]) -> HybridSystem:
    import sympy

    from fmu_models.codegen.package import variant
    from fmu_models.language.contacts import Friction
    from fmu_models.language.laws.conti import Conti
    from fmu_models.language.quantities import TIME, Input, Parameter
    from fmu_models.lowering.lower import lower

    rig = variant("disc_rig", [disc])
    (contact,), (theta,) = rig.contacts, rig.coordinates
    assert isinstance(contact, Friction) and isinstance(contact.law, Conti)
    turned = Input("turned", 0.0, "rad", "angle of the drive")
    of = {"cos": sympy.cos, "sin": sympy.sin}
    middle = Parameter("middle", 0.0, "s", "middle of the log")
    share = (TIME - middle) / Parameter("duration", 1.0, "s", "duration of the log", positive=True)
    away = theta - Parameter(MIDDLE_ANGLE, 0.0, "rad", "angle at which friction is that of the law")
    turn, bend, wear, load = (sympy.Integer(1) for _ in range(4))
    for what, order in parameters:
        if what == "angle":
            unit = "1/rad" if order == 1 else f"1/rad{order}"
            bend += Parameter(f"angle{order}", 0.0, unit, f"of power {order} of the angle") * away**order
        elif what == "load":
            cell = Input("load", 1.0, "1", "normal force by a load cell over its mean")
            load += Parameter(f"load{order}", 1.0, "1", "share of it that friction follows") * (cell - 1)
        elif what == "time":
            wear += Parameter(f"time{order}", 0.0, "1", f"of power {order} of the share of the log") * share**order
        else:
            amplitude = Parameter(f"{what}{order}", 0.0, "1", f"of the {what} of {order} turns of the drive")
            turn += amplitude * of[what](order * turned)
    own = replace(rig.with_law(**{disc: replace(contact.law, N=contact.law.N * turn * bend * wear * load)}), name=name)
    return lower(variant(own, laws={disc: law}))
