"""The friction of two driving discs as one law to be fitted: a law of one form for each, and where contact changes.

Parameters are named after their disc: mu_s0, mu_k0, p0, mu_s1, mu_k1, p1; the changeover theta_s or alpha (rad) is the
last where the angle decides which disc touches.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.language.law_parameter import LawParameter
from identification.laws.law import FittableLaw
from rig_io.logs.arrangement import CHANGEOVER, Arrangement

DISCS = (0, 1)

# where disc 0 stops and disc 1 begins to touch, as multiples of the changeover: theta < edge_0 x, theta >= edge_1 x
EDGES = {"sequential": (1.0, 1.0), "overlapping": (1.0, -1.0)}

_CHANGEOVERS = {
    "theta_s": LawParameter("theta_s", 0.0, "rad", "angle from which on disc 1 is touched, not disc 0", -1.5, 1.5),
    "alpha": LawParameter("alpha", 0.0, "rad", "both discs are touched at angles from -alpha to alpha", 0.0, 1.5),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class JointLaw(FittableLaw):
    """A law of two discs. ``value`` and ``gradient`` are of slip speeds (..., 2), the last axis the disc.

    single: the form of both; arrangement: of the discs.
    """

    single: FittableLaw
    arrangement: Arrangement

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self.single, self.arrangement, self.parameters)

    def start(self, v: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """First guess, as in `FittableLaw`, disc by disc; v, mu: (n, 2)."""
        return np.concatenate([self.single.start(v[:, d], mu[:, d]) for d in DISCS])

    def warnings(self, q: np.ndarray) -> tuple[str, ...]:
        """Warnings of each disc's law."""
        return tuple(f"Disc {d}: {warning}" for d in DISCS for warning in self.single.warnings(q[self.of_disc(d)]))

    @property
    def changeover(self) -> str | None:
        """Name of the angle at which contact changes, the last parameter; None where both discs touch always."""
        return CHANGEOVER.get(self.arrangement)

    @property
    def edges(self) -> tuple[float, float]:
        """Angles where disc 0 ends and disc 1 begins, as multiples of the changeover."""
        return EDGES[self.arrangement]

    def of_disc(self, disc: int) -> slice:
        """Places of the parameters of one disc."""
        count = len(self.single.parameters)
        return slice(disc * count, (disc + 1) * count)


def joint_law(single: FittableLaw, arrangement: Arrangement) -> JointLaw:
    """A law of this form for each of two discs. StickslipError: it is by direction."""
    if single.directed:
        raise StickslipError(
            f"'{single.name}' is fitted of one driving disc: with two, slips of one way are too few to tell both "
            "halves of both laws. Leave --law out, or fit the discs one by one."
        )
    count = len(single.parameters)

    def value(v: np.ndarray, q: np.ndarray) -> np.ndarray:
        return np.stack([single.value(v[..., d], q[d * count : (d + 1) * count]) for d in DISCS], axis=-1)

    def gradient(v: np.ndarray, q: np.ndarray) -> np.ndarray:
        slopes = np.zeros((len(parameters), *v.shape))
        for d in DISCS:
            slopes[d * count : (d + 1) * count, ..., d] = single.gradient(v[..., d], q[d * count : (d + 1) * count])
        return slopes

    named = CHANGEOVER.get(arrangement)
    parameters = (
        *(
            replace(p, name=f"{p.name}{d}", description=f"{p.description}, disc {d}")
            for d in DISCS
            for p in single.parameters
        ),
        *([] if named is None else [_CHANGEOVERS[named]]),
    )
    changes = {"parameters": parameters, "value": value, "gradient": gradient}
    return JointLaw(**vars(single) | changes, single=single, arrangement=arrangement)


def _again(single: FittableLaw, arrangement: Arrangement, parameters: tuple[LawParameter, ...]) -> JointLaw:
    return replace(joint_law(single, arrangement), parameters=parameters)


def sought_law(single: FittableLaw, contacts: Sequence[str], arrangement: Arrangement) -> FittableLaw:
    """What is to be fitted to logs of these discs: a law of this form, or one for each of two."""
    return single if len(contacts) == 1 else joint_law(single, arrangement)


@dataclass(frozen=True)
class DiscLaw:
    """The law of one driving disc within a fit. disc: its number in the model; place: of its parameters among all;
    force: of its normal force among `RigValues.forces`; suffix: of the names of both in the fit."""

    disc: str
    law: FittableLaw
    place: slice
    force: int
    suffix: str


def laws_of(law: FittableLaw, contacts: Sequence[str]) -> tuple[DiscLaw, ...]:
    """The laws of the discs that touch in a log: of the only one, or the parts of a joint law."""
    if isinstance(law, JointLaw):
        numbers = [int(contact[-1]) for contact in contacts]
        return tuple(DiscLaw(str(d), law.single, law.of_disc(d), d, str(d)) for d in numbers)
    return (DiscLaw(contacts[0][-1], law, slice(0, len(law.parameters)), 0, ""),)


def touching(
    law: FittableLaw, contacts: Sequence[str], q: np.ndarray, angle: np.ndarray, guard: float = 0.0
) -> np.ndarray:
    """Whether each disc of a log touches (n_discs, n) at angles (n,) rad, give or take ``guard`` rad."""
    touch = np.ones((len(contacts), len(angle)), dtype=bool)
    if isinstance(law, JointLaw) and law.changeover is not None and len(contacts) == 2:
        below, above = (edge * q[-1] for edge in law.edges)
        touch[0], touch[1] = angle < below + guard, angle >= above - guard
    return touch
