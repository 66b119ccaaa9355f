"""Who made an FMU and under which licence it may be handed on.

The engine inside every FMU is this suite's and keeps its licence; what the author says holds for the model.
"""

import os
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from fmu_models.base.errors import StickslipError
from fmu_models.base.shipped import ROOM

ENGINE_LICENSE = "BSD-3-Clause"
# of the folder that both versions of the standard name for this
FOLDER = "documentation/licenses"


@dataclass(frozen=True)
class Rights:
    """What the head of an FMU's description says of its origin; ``None`` leaves it out.

    Attributes:
        author: name and organization.
        copyright: a line such as "(c) 2026 A. Author".
        license: name of the model's licence, such as "MIT" or "proprietary", or a file with its text.
    """

    author: str | None = None
    copyright: str | None = None
    license: str | None = None

    @property
    def attributes(self) -> dict[str, str | None]:
        """Attributes of the root of modelDescription.xml. StickslipError: SOURCE_DATE_EPOCH, the date that reproducible
        builds state, is no number of seconds."""
        return {
            "author": self.author,
            "copyright": self.copyright,
            "license": self._name,
            "generationDateAndTime": _stated_date(),
        }

    @property
    def files(self) -> dict[str, str]:
        """Texts of the licences by their names in the archive. StickslipError: the file with the licence is not
        text."""
        engine = _engine_license()
        if self.license is None:
            return {f"{FOLDER}/license.txt": engine}
        holder = f" {self.copyright}" if self.copyright else ""
        head = f"The model:{holder}\n\n{self._text}\n\n\nThe engine (sources/ and what is compiled of it):\n\n"
        return {f"{FOLDER}/license.txt": head + engine}

    @property
    def _name(self) -> str:
        if self.license is None:
            return ENGINE_LICENSE
        terms = "see documentation/licenses/license.txt" if Path(self.license).is_file() else self.license
        return f"{terms}; engine {ENGINE_LICENSE}"

    @property
    def _text(self) -> str:
        path = Path(str(self.license))
        if not path.is_file():
            return f"Licence: {self.license}"
        try:
            return path.read_text("utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise StickslipError(f"The licence '{path}' cannot be read as text: {error}.") from error


def _engine_license() -> str:
    """Text of this suite's licence: beside the packages in a checkout, with the metadata of what is installed."""
    if (ROOM / "LICENSE").is_file():
        return (ROOM / "LICENSE").read_text("utf-8")
    from importlib import metadata  # takes a tenth of the start of a command that builds nothing

    text = metadata.distribution("stickslip").read_text("licenses/LICENSE")
    if text is None:
        raise StickslipError("The licence of the engine is missing. Install stickslip again, by pip install.")
    return text


def _stated_date() -> str | None:
    """The date of SOURCE_DATE_EPOCH; without it none is told, so that the same model gives the same bytes."""
    stated = os.environ.get("SOURCE_DATE_EPOCH")
    if stated is None:
        return None
    try:
        return datetime.fromtimestamp(int(stated), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    except (ValueError, OverflowError, OSError):
        raise StickslipError(
            f"SOURCE_DATE_EPOCH is '{stated}', not a number of seconds since 1970. Mend or unset it."
        ) from None
