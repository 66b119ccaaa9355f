"""Friction laws that can be fitted: those of ``fmu_models/language/laws`` and the user's own."""

import re
from functools import cache
from pathlib import Path

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.codegen.law_functions import own_laws
from fmu_models.language.laws import LAWS
from identification.laws.law import FittableLaw, fittable

__all__ = ["FittableLaw", "bristled", "find_law", "slip_laws"]

# by what a steady law is called, the one with bristles before it
_BRISTLED = {"Conti": "LuGre", "Stribeck+viscous": "LuGre+Stribeck"}


@cache
def _own() -> dict[str, FittableLaw]:
    """Our own by what people call them, the simplest first."""
    return {law.name: fittable(law.reference) for law in own_laws().values()}


def slip_laws() -> dict[str, FittableLaw]:
    """Those of our own whose steady friction every estimator can fit, whichever way the slips go, but for a curve of no
    form; of those that share it the first."""
    first = {
        law.steady: name for name, law in reversed(_own().items()) if law.sticks and not (law.directed or law.spans)
    }
    return {name: law for name, law in _own().items() if name in first.values()}


def bristled(law: FittableLaw) -> tuple[FittableLaw, FittableLaw] | None:
    """Of a law with bristles, or of one that they can be put before: the steady one and that with bristles."""
    for steady, elastic in _BRISTLED.items():
        if law.reference in (find_law(steady).reference, find_law(elastic).reference):
            return find_law(steady), find_law(elastic)
    return None


def find_law(name: str) -> FittableLaw:
    """A law by what people call it, or by its name, file or module as in ``LAWS``. StickslipError: there is none, it
    fails, or it cannot be fitted."""
    if name in _own():
        return _own()[name]
    if re.search(r"\.py(:\w+)?$", name):
        return fittable(str(Path(name).absolute()))
    if ":" not in name and name not in LAWS.names():
        raise StickslipError(f"There is no friction law '{name}'.{nearest(name, _own())}")
    return fittable(name)
