"""Special points of the branch near the start, over the second of ``axes``, as curves in both. "fold_1_at_2": the
second parameter on the first curve of folds at the second value of the first axis; "cusp_1_NAME": where a curve has a
cusp."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fmu_models.analyses.declaration import PARAMETERS
from fmu_models.base.formula import Formula
from fmu_models.continuation.branches import branch, branches
from fmu_models.continuation.curves.curve import closed_form_of
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, section_of
from fmu_models.scene.scene import Scene


def _curves(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    how: Any = scene.compute
    (second, seconds), (over, values) = how.axes.items()
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    settled = "settle" not in how.settings or bool(how.settings["settle"])
    first = branch(system, over, (min(values), max(values)), start=run["start"], settle=settled)
    specials = branches(first, switch=bool(how.settings.get("switch", 0)))
    only = how.settings.get("special")
    whole = specials.curves(second, (min(seconds), max(seconds)), only=only)
    found = whole.curves
    text = how.settings.get("closed_form")
    form = closed_form_of(found[0], Formula.read(text), scene.parameters) if text else None
    told: dict[str, float] = {"curves": float(len(found))}
    counted: dict[str, int] = {}

    def numbered(kind: str) -> str:
        name = kind.replace(", ", "_").replace(" ", "_")
        counted[name] = counted.get(name, 0) + 1
        return f"{name}_{counted[name]}"

    for one in found:
        name = numbered(one.kind)
        told |= {f"{name}_at_{i}": at[0].parameters[over] for i, x in enumerate(seconds, 1) if (at := one.at(x))}
        if form is not None:
            told[f"{name}_from_closed_form"] = form.error(one)
        for met in one.meetings:
            place = numbered(met.kind)
            told |= {f"{place}_{parameter}": value for parameter, value in met.parameters.items()}
    return Row(None, told, family=replace(whole, closed_form=form))


KIND = Kind(
    _curves, periodic=True, axes=PARAMETERS, settings={"settle": 1, "switch": 0, "special": None, "closed_form": None}
)
