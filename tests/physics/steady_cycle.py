"""The last cycle of a long run, measured to rounding."""

from __future__ import annotations

from typing import Any

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.cycles import Cycle, last_cycle


def disc_rig(contacts: tuple[str, ...]) -> Fmu:
    return Fmu.open(built("disc_rig", contacts=contacts))


def steady_cycle(fmu: Fmu, *, until: float = 60.0, **run: Any) -> Cycle:
    """Run to ``until`` and take the last full cycle from stick to stick, which there must be."""
    cycle = last_cycle(fmu, until, **run)
    assert cycle is not None
    return cycle
