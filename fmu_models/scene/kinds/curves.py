"""Special points of the branch near the start, over the second of ``axes``, as curves in both. "fold_1_at_2": the
second parameter on the first curve of folds at the second value of the first axis; "cusp_1_NAME": where a curve has a
cusp."""

from dataclasses import replace
from typing import Any

from fmu_models.analyses.branch import numbering
from fmu_models.analyses.declaration import PARAMETERS
from fmu_models.base.formula import Formula
from fmu_models.continuation.branches import branches
from fmu_models.continuation.curves.curve import closed_form_of
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, section_of
from fmu_models.scene.scene import Scene


def _curves(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    computation: Any = scene.compute
    (second, seconds), (over, values) = computation.axes.items()
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    settled = "settle" not in computation.settings or bool(computation.settings["settle"])
    switch = bool(computation.settings.get("switch", 0))
    between = (min(values), max(values))
    specials = branches(system, over, between, start=run["start"], settle=settled, switch=switch)
    only = computation.settings.get("special")
    followed = specials.curves(second, (min(seconds), max(seconds)), only=only)
    curves = followed.curves
    text = computation.settings.get("closed_form")
    form = closed_form_of(curves[0].nodes[0], Formula.read(text), scene.parameters) if text else None
    numbers: dict[str, float] = {"curves": float(len(curves))}
    numbered = numbering()
    for curve in curves:
        name = numbered(curve.kind)
        numbers |= {f"{name}_at_{i}": at[0].parameters[over] for i, x in enumerate(seconds, 1) if (at := curve.at(x))}
        if form is not None:
            numbers[f"{name}_from_closed_form"] = form.error(curve)
        for meeting in curve.meetings:
            meeting_name = numbered(meeting.kind)
            numbers |= {f"{meeting_name}_{parameter}": value for parameter, value in meeting.parameters.items()}
    return Row(None, numbers, family=replace(followed, closed_form=form))


KIND = Kind(
    _curves, periodic=True, axes=PARAMETERS, settings={"settle": 1, "switch": 0, "special": None, "closed_form": None}
)
