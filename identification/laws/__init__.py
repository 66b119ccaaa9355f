"""Friction laws that can be fitted: one file each, with the law as ``LAW``.

Coulomb is the simplest to copy for a new one.
"""

from __future__ import annotations

from fmu_models.errors import StickslipError, nearest
from identification.laws import conti, conti_viscous, coulomb, coulomb_viscous, stribeck
from identification.laws.law import FittableLaw

LAWS = {m.LAW.name: m.LAW for m in (coulomb, coulomb_viscous, conti, conti_viscous, stribeck)}
"""By name, the simplest first."""


def find_law(name: str) -> FittableLaw:
    """A law by its name.

    Raises:
        StickslipError: there is none of that name.
    """
    if name not in LAWS:
        raise StickslipError(f"There is no friction law '{name}'.{nearest(name, LAWS)}")
    return LAWS[name]
