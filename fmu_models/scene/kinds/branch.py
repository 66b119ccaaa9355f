"""The branch of the periodic motion near the start, over the range of ``values``; a row per value: how many motions
there are, and how many stable ones. The first has what is special too, "fold_1", "flip_1": values of the parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_models.continuation.branches import all_branches
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.kind import Kind, Row, section_of
from fmu_models.scene.scene import Scene


def _branch(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> tuple[Row, ...]:
    how: Any = scene.compute
    low, high = min(how.values), max(how.values)
    system = section_of(scene, fmu, run["parameters"], run["inputs"])
    settled = "settle" not in how.settings or bool(how.settings["settle"])
    found = all_branches(
        system.at(**_inside(system, how.over, low, high)),
        how.over,
        (low, high),
        start=run["start"],
        settle=settled,
        of=how.settings.get("of"),
        switch=bool(how.settings.get("switch", 0)),
    )
    special = special_values(found.special)
    rows = []
    for i, value in enumerate(how.values):
        motions, stable = counted(found.branches, value)
        rows.append(Row(value, {"motions": motions, "stable": stable} | (special if i == 0 else {}), family=found))
    return tuple(rows)


def _inside(system: Any, over: str, low: float, high: float) -> dict[str, float]:
    """The parameter, brought into its range."""
    value = system.values.get(over)
    value = float(system.fmu.variables[over].start or 0.0) if value is None else value
    return {over: min(max(value, low), high)}


def special_values(specials: Sequence[Any]) -> dict[str, float]:
    """Values of the parameter by kind and number."""
    numbers: dict[str, int] = {}
    values = {}
    for special in specials:
        kind = special.kind.replace(", ", "_").replace(" ", "_")
        numbers[kind] = numbers.get(kind, 0) + 1
        values[f"{kind}_{numbers[kind]}"] = special.value
    return values


def counted(branches: Sequence[Any], value: float) -> tuple[float, float]:
    """Points of branches at a value, and stable ones."""
    found = stable = 0
    for one in branches:
        before, after = one.values[:-1] - value, one.values[1:] - value
        for i in np.flatnonzero((before <= 0.0) != (after <= 0.0)):
            found += 1
            stable += bool(one.stable[i] and one.stable[i + 1])
    return float(found), float(stable)


KIND = Kind(_branch, periodic=True, sweeps=True, settings={"settle": 1, "switch": 0, "of": None})
