"""The branch of the equilibrium near the start, over the range of ``values``; a row per value: how many equilibria
there are, and how many stable ones. The first has what is special too, "Hopf_1", "fold_1": values of the parameter,
and, where eigenvalues are a set, the shares at which it bifurcates, "q_imaginary_axis_1". ``of`` is the state that is
drawn, or "eigenvalues"."""

from __future__ import annotations

from typing import Any

from fmu_models.continuation.equilibria import equilibria
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds.branch import counted, special_values
from fmu_models.scene.kinds.kind import Kind, Row, constants_of
from fmu_models.scene.scene import Scene


def _equilibria(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> tuple[Row, ...]:
    how: Any = scene.compute
    low, high = min(how.values), max(how.values)
    given = constants_of(scene, run)
    present = float(given.get(how.over, fmu.variables[how.over].start or 0.0))
    given[how.over] = min(max(present, low), high)
    found = equilibria(fmu, how.over, (low, high), start=run["start"], parameters=given, of=how.settings.get("of"))
    special = special_values(found.special)
    for one in found.special:
        for name, shares in one.crossings.items():
            special |= {f"q_{name.replace(' ', '_')}_{i}": share for i, share in enumerate(shares, 1)}
    rows = []
    for i, value in enumerate(how.values):
        many, stable = counted([found], value)
        values = {"equilibria": many, "stable": stable} | (special if i == 0 else {})
        rows.append(Row(value, values, family=found))
    return tuple(rows)


KIND = Kind(_equilibria, sweeps=True, settings={"of": None})
