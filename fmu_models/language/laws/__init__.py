"""Contact laws: one file each, with the class as ``LAW``. ``coulomb`` is the smallest to copy for a new one."""

from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Registry

LAWS: Registry[Any] = Registry(kind="law", package=__name__, attribute="LAW", group="stickslip.laws")


def load(reference: str, beside: Path | None = None) -> type[Any]:
    """The class of a law, as `Registry.load` finds it. StickslipError: as there, or it is none."""
    law = LAWS.load(reference, beside)
    if not (isinstance(law, type) and is_dataclass(law) and hasattr(law, "force")):
        raise StickslipError(
            f"'{reference}' is no law: it must be a class, a dataclass with 'force' or 'magnitude', such as Coulomb in "
            "fmu_models/language/laws/coulomb.py. Copy that for one of your own."
        )
    return law
