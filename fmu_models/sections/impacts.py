"""The contact of an oscillator: its states right after the contact begins, or ends."""

from collections.abc import Mapping
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.oscillator import FmuSection
from fmu_models.sections.point import Begin, Vector
from fmu_models.simulation.ensemble import KINDS, Where
from fmu_models.simulation.run import check_names


class Impacts(FmuSection):
    """The states right after a contact begins: an impact, the touch of a stop, the begin of stick.

    Args:
        contact: its name.
        ends: where it ends instead.
        others: of ``FmuSection``; what is forced must say so.
    """

    def __init__(self, fmu: Fmu, contact: str, *, ends: bool = False, **others: Any) -> None:
        if not fmu.ours:
            raise StickslipError(
                f"'{fmu.description.modelName}' is not of this suite and tells no contacts. Take a level of a state, "
                "as the gap where it is one, or a strobe."
            )
        super().__init__(fmu, **others)
        check_names(fmu, "contact", {contact: None}, fmu.contacts)
        self.contact, self.ends = contact, ends

    def where(self) -> Where:
        return Where(KINDS.END if self.ends else KINDS.BEGIN, contact=self.contacts.index(self.contact))

    def begin(self, point: Vector, values: Mapping[str, float], period: float) -> Begin:
        raise StickslipError(f"'{self.name}' is not of this suite: it has no contacts to be seen at.")
