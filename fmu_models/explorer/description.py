"""What a page knows of its model: quantities with unit, meaning and range, contacts, and how a command names it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.version import version
from fmu_models.explorer.subject import ExplorerSubject
from fmu_models.fmu.fmu import Fmu
from fmu_models.language import contact_kinds

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

PLANES = 6  # phase planes that a page offers
SPAN = 3.0  # of a range without bounds, in parts of the value
DECADES = 2.0  # of a logarithmic range without bounds, to either side


def describe(subject: ExplorerSubject, plot: Sequence[str] | None = None) -> dict[str, Any]:
    """All of it, as JSON takes it.

    Args:
        plot: names of the coordinates to draw; all if None.

    Raises:
        StickslipError: more than six coordinates without a choice, or a choice of what there is none of.
    """
    fmu = subject.fmu

    def listed(names: Sequence[str]) -> list[dict[str, Any]]:
        return [_quantity(subject, fmu.variables[name]) for name in names]

    return {
        "name": fmu.description.modelName,
        "title": fmu.description.description or fmu.description.modelName,
        "version": version(),
        "model": subject.model,
        "arguments": subject.arguments,
        "sceneContacts": None if subject.contacts is None else list(subject.contacts),
        "laws": dict(subject.laws),
        "until": subject.until,
        "notes": list(subject.notes),
        "parameters": listed(fmu.parameters),
        "inputs": listed(fmu.inputs),
        "states": listed(fmu.states),
        "memories": listed(fmu.memories),
        "outputs": [_named(fmu.variables[name]) for name in fmu.outputs],
        "contacts": [_contact(fmu.variables[f"{name}_state"]) for name in fmu.contacts],
        "coordinates": len(_coordinates(fmu)),
        "planes": _planes(fmu, plot),
    }


def _coordinates(fmu: Fmu) -> list[str]:
    """Names of the states that have a velocity; none of a system without a body."""
    sizes = (fmu.folder / "sources/model_sizes.h").read_text("utf-8")
    match = re.search(r"#define MODEL_NQ (\d+)", sizes)
    return fmu.states[: int(match[1])] if match else []


def _planes(fmu: Fmu, plot: Sequence[str] | None) -> list[list[int]]:
    """Pairs of states to draw one over the other: a coordinate and its velocity, or neighbours without a body."""
    coordinates = _coordinates(fmu)
    drawn = coordinates or fmu.states[:-1] or fmu.states
    if plot is None and len(drawn) > PLANES:
        listing = ", ".join(drawn[:12]) + (", ..." if len(drawn) > 12 else "")
        raise StickslipError(
            f"The model has {len(drawn)} coordinates ({listing}), of which a page draws up to {PLANES}. Say which: "
            f"--plot {','.join(drawn[:2])}"
        )
    if plot is not None and not 1 <= len(plot) <= PLANES:
        raise StickslipError(f"{len(plot)} coordinates are to be drawn. Name one to {PLANES}: --plot {drawn[0]}")
    for name in plot or ():
        refuse_unknown(name, drawn, f"There is no coordinate '{name}' to draw.")
    step = len(coordinates) or 1
    indices = [fmu.states.index(name) for name in (plot or drawn)]
    return [[i, min(i + step, len(fmu.states) - 1)] for i in indices]


def _named(variable: ScalarVariable) -> dict[str, Any]:
    return {"name": variable.name, "unit": variable.unit or "1", "meaning": variable.description or ""}


def _quantity(subject: ExplorerSubject, variable: ScalarVariable) -> dict[str, Any]:
    """A quantity that can be set: its value, its bounds, and the range of its slider."""
    value = float(subject.values.get(variable.name, variable.start or 0.0))
    low, high = (None if bound is None else float(bound) for bound in (variable.min, variable.max))
    size = abs(value) or float(variable.nominal or 1.0)
    lower = -_rounded(SPAN * size) if low is None else low
    upper = _rounded(max(SPAN * size, lower + size)) if high is None else high
    logarithmic = _decades(value, low, high)
    if variable.name in subject.ranges:
        (lower, upper), logarithmic = subject.ranges[variable.name], None
    return {
        **_named(variable),
        **{"value": value, "default": float(variable.start or 0.0), "min": low, "max": high},
        **{"low": lower, "high": upper, "log": logarithmic},
    }


def _decades(value: float, low: float | None, high: float | None) -> list[float] | None:
    """The range of a logarithmic slider; None of what is not positive."""
    if not value > 0.0 or (low is not None and low < 0.0):
        return None
    start = low if low else _rounded(value * 10.0**-DECADES)
    end = high if high is not None else _rounded(value * 10.0**DECADES)
    return [start, end] if start < end else None


def _rounded(value: float) -> float:
    """The end of a range, without the last digits of a product."""
    return float(f"{value:.6g}")


def _contact(variable: ScalarVariable) -> dict[str, Any]:
    declared = variable.declaredType
    kind = contact_kinds.BY_TYPE_NAME[str(declared.name if declared else "")]
    words = {str(number): word for number, word in kind.meanings.items()}
    meaning = str(variable.description or "").partition(":")[0]
    return {"name": variable.name.removesuffix("_state"), "kind": kind.name, "meaning": meaning, "states": words}
