"""Friction laws that can be fitted: one file each, with the law as ``LAW``.

Coulomb is the simplest to copy for a new one.
"""

from __future__ import annotations

from fmu_models.base.errors import StickslipError, nearest
from identification.laws import conti, conti_viscous, coulomb, coulomb_viscous, lugre, stribeck
from identification.laws.law import FittableLaw

LAWS = {m.LAW.name: m.LAW for m in (coulomb, coulomb_viscous, conti, conti_viscous, stribeck)}
"""By name, the simplest first; each a function of slip speed, which every estimator can fit."""
LUGRE = lugre.LAW
"""More than a function of slip speed: the estimator of its name fits it."""


def find_law(name: str) -> FittableLaw:
    """A law by its name.

    Raises:
        StickslipError: there is none of that name.
    """
    known = {**LAWS, LUGRE.name: LUGRE}
    if name not in known:
        raise StickslipError(f"There is no friction law '{name}'.{nearest(name, known)}")
    return known[name]
