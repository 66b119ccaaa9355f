"""From what an analysis is given to the section that it is seen at: a model that nothing forces needs none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load, named_map
from fmu_models.language.maps import Map
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

    Subject = SectionSystem | Fmu | Map | Model
else:
    Subject = object


def seen(subject: Subject) -> SectionSystem:
    """The section system itself; of a map every step, of a model its strobe.

    Raises:
        StickslipError: as ``load``; a model that is forced.
    """
    if isinstance(subject, SectionSystem):
        return subject
    model = (named_map(subject) or subject) if isinstance(subject, str) else subject
    if isinstance(model, Map):
        return Iteration.of(model)
    return Strobe(model if isinstance(model, Fmu) else load(model))
