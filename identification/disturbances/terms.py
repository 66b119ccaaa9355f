"""The terms of disturbances for pooled logs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.trust import is_place
from identification.disturbances import DISTURBANCES, drift, load_cell, temperature
from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DAMPING, FRICTION, SPRING, DisturbanceTerm, Whereabouts, disturbed, misread
from identification.measurement.pooled import Pool, RigValues
from identification.measurement.stated import weighed

UNSIZED: Mapping[str, float] = MappingProxyType({})


def undisturbed(
    terms: Sequence[DisturbanceTerm],
    x: np.ndarray,
    friction: np.ndarray,
    sign: np.ndarray,
    at: Whereabouts,
    rig: RigValues,
) -> np.ndarray:
    """Friction coefficients (n,) by inverse dynamics as they would be without these terms of values x (m,). sign: (n,)
    of the slip."""
    factor, stiffer, damped = (disturbed(terms, x, at, acts)[0] for acts in (FRICTION, SPRING, DAMPING))
    shown = misread(terms, x, at)[0]
    torque = rig.k * at.angle * (stiffer - 1) + rig.c * at.speed * (damped - 1)
    return (friction + sign * (torque / (rig.R * rig.N) - rig.spring * shown)) / factor


def ranked(names: Sequence[str] | None = None) -> dict[str, Disturbance]:
    """Disturbances by name in the order of their terms; those of our own and of installed packages if None.
    StickslipError: there is none of a name."""
    for name in names or ():
        if not (is_place(name) or name in DISTURBANCES.members() or name in DISTURBANCES.names()):
            raise StickslipError(f"There is no disturbance '{name}'.{nearest(name, DISTURBANCES.names())}")
    loaded = {name: DISTURBANCES.load(name) for name in (DISTURBANCES.names() if names is None else names)}
    return dict(sorted(loaded.items(), key=lambda item: item[1].rank))


def measured(ready: Pool) -> list[DisturbanceTerm]:
    """Terms of what sensors of pooled logs of one disc show of its friction: its load cell, and a temperature that
    changes."""
    if len(ready.contacts) > 1:
        return []
    cell = [load_cell.TERM] if weighed(ready.motions) else []
    return [*cell, temperature.TERM] if ready.warms else cell


def terms_of(ready: Pool, causes: Sequence[str], sizes: Mapping[str, float] = UNSIZED) -> tuple[DisturbanceTerm, ...]:
    """The terms of these causes for pooled logs. sizes: of causes, where an earlier fit found them. StickslipError: an
    unknown cause, two discs, or logs that cannot show one."""
    disturbances = ranked(causes)
    if causes and len(ready.contacts) > 1:
        raise StickslipError("Disturbances are estimated with one driving disc. Fit the logs of each disc by itself.")
    for name, disturbance in disturbances.items():
        if disturbance.same_as in causes:
            raise StickslipError(f"'{disturbance.same_as}' and '{name}' are one disturbance. Name one of them.")
    for name in causes:
        reason = disturbances[name].hidden(ready)
        if reason:
            raise StickslipError(f"These logs cannot show a disturbance '{name}': {reason}")
    if len(ready.contacts) > 1:
        return ()
    terms = [*measured(ready), *drift.shifts(ready)]
    for name, disturbance in disturbances.items():
        with DISTURBANCES.running(name):
            for term in disturbance.terms(ready, sizes.get(name)):
                terms.append(replace(term, cause=name, words=term.words or disturbance.words))
    return tuple(terms)
