"""Poincaré sections: where one motion, or several, meet the section."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.declaration import Analysis, Option
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.sections.system import SectionSystem


@dataclass(frozen=True, eq=False)
class PoincareSection(Pictured):
    """Points at the section.

    Attributes:
        model: its name.
        states, contacts: names of the numbers of a point, and of the contacts.
        points: (k, n) one after the other.
        times: (k,) since the point before.
        began: (k, contacts) how often each contact or stick began since then.
        how: of ``SectionSystem``.
        units: of the states.
    """

    COLUMNS: ClassVar = ("{states}=points", "time=times", "{contacts}_began=began")
    RECORD: ClassVar = ("model", "states", "points", "how")

    model: str
    states: tuple[str, ...]
    contacts: tuple[str, ...]
    points: Vector
    times: Vector
    began: NDArray[np.int32]
    how: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    def _heading(self) -> str:
        return f"Section of {self.model}: {len(self.points)} points"

    def _contents(self) -> Mapping[str, Any]:
        return {name: self.points[:, i] for i, name in enumerate(self.states)} | {"how": self.how or None}


def poincare_section(
    system: SectionSystem,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    points: Annotated[int, Option("Points of the section.", minimum=1)] = 5000,
    transient: Annotated[int, Option("Steps before that.", minimum=0)] = 500,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> PoincareSection:
    """Take a Poincaré section of a motion.

    Raises:
        StickslipError: unknown states or values out of their range, no points asked for, or a motion that ends before;
            says why.
    """
    if points < 1 or transient < 0:
        raise StickslipError(
            f"{points} points after {transient} steps: ask for one point at least, and no step below 0."
        )
    rows = system.motion(start, transient, points, progress)
    names = system.name, tuple(system.states), tuple(system.contacts)
    origin = system.how, system.units(*system.states)
    return PoincareSection(*names, rows.points[0], rows.times[0], rows.began[0], *origin)


def _numbers(result: PoincareSection) -> dict[str, float]:
    values: dict[str, float] = {}
    for name, column in zip(result.states, result.points.T, strict=True):
        extremes = {"min": column.min(), "max": column.max(), "mean": column.mean()}
        values |= {f"{name}_{extreme_name}": float(extreme) for extreme_name, extreme in extremes.items()}
    return {**values, "time_mean": float(result.times.mean())}


ANALYSIS = Analysis(
    function=poincare_section,
    numbers=_numbers,
    results="`<state>_min`, `<state>_max`, `<state>_mean`, `time_mean`",
    example="discontinuous_support --forcing omega --set ks=300 --set omega=0.94 --figure section.png",
    label="section",
    page=False,
)
