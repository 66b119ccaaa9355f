"""An FMU file, unpacked and described."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import weakref
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from fmu_models.errors import StickslipError

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription, ScalarVariable

# an FMU is a few hundred kB; these only keep a hostile archive from filling the disk
MAX_FILES = 10_000
MAX_BYTES = 1 << 30


@dataclass(frozen=True, eq=False)
class Fmu:
    """An opened FMU. Its files stay unpacked in a temporary folder until the object is collected.

    Attributes:
        path: the file it came from.
        folder: where it is unpacked.
        description: modelDescription.xml as fmpy reads it.
        variables: every variable by name, in order of declaration.
    """

    path: Path
    folder: Path
    description: ModelDescription
    variables: dict[str, ScalarVariable]

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Fmu:
        """Unpack and read an FMU 2.0 or 3.0.

        Raises:
            StickslipError: no such file, not an FMU, of another FMI version, or an archive that is unsafe to unpack.
        """
        path = Path(path)
        if not path.is_file():
            raise StickslipError(f"There is no file '{path}'. Export a model first: stickslip export MODEL")
        folder = Path(tempfile.mkdtemp(prefix="stickslip-fmu-"))
        try:
            unpack(path, folder)
            description = _describe(path, folder)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        fmu = cls(path, folder, description, {v.name: v for v in description.modelVariables})
        weakref.finalize(fmu, shutil.rmtree, folder, ignore_errors=True)
        return fmu

    @property
    def fmi(self) -> int:
        """Version of the standard: 2 or 3."""
        return int(str(self.description.fmiVersion)[0])

    @property
    def parameters(self) -> list[str]:
        """Names of the parameters."""
        return [name for name, v in self.variables.items() if v.causality == "parameter"]

    @property
    def inputs(self) -> list[str]:
        """Names of the inputs, without their rates."""
        names = [name for name, v in self.variables.items() if v.causality == "input"]
        return [name for name in names if not (name.endswith("_rate") and name.removesuffix("_rate") in names)]

    @property
    def states(self) -> list[str]:
        """Names of the continuous states."""
        derivatives = (unknown.variable for unknown in self.description.derivatives)
        return [str(v.derivative.name) for v in derivatives if v is not None and v.derivative is not None]

    @property
    def memories(self) -> list[str]:
        """Names of the speeds at which stops were entered, for the stops that remember them."""
        return [f"{name}_memory" for name in self.contacts if f"{name}_memory" in self.variables]

    @property
    def outputs(self) -> list[str]:
        """Names of the outputs, without the states of contacts."""
        return [name for name, v in self.variables.items() if v.causality == "output" and v.variability == "continuous"]

    @property
    def contacts(self) -> list[str]:
        """Names of the contacts."""
        states = [name for name, v in self.variables.items() if v.causality == "output" and v.variability == "discrete"]
        return [name.removesuffix("_state") for name in states]

    @property
    def impacts(self) -> list[str]:
        """Names of the rigid contacts, their friction left out."""
        from fmu_models.codegen.contact_states import STATES

        described = ((name, self.variables[f"{name}_state"].description or "") for name in self.contacts)
        return [name for name, description in described if description.endswith(STATES["impact"])]


def unpack(path: Path, folder: Path) -> None:
    """Unpack an archive from somebody else into ``folder``.

    Raises:
        StickslipError: not a zip archive, or a file in it leaves the folder, is a link, or is too large.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            if len(entries) > MAX_FILES:
                raise StickslipError(f"'{path}' holds {len(entries)} files, more than {MAX_FILES}; it is not unpacked.")
            room = MAX_BYTES
            for entry in entries:
                room -= _unpack_entry(archive, entry, path, folder, room)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise StickslipError(f"'{path}' is not an FMU: {error}. An FMU is a zip archive.") from error


def _unpack_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, folder: Path, room: int) -> int:
    """Unpack one entry; the number of bytes written."""
    inside = PurePosixPath(entry.filename)
    if inside.is_absolute() or ".." in inside.parts or "\\" in entry.filename or ":" in entry.filename:
        raise StickslipError(f"'{path}' holds '{entry.filename}', which would be written outside its folder.")
    if stat.S_ISLNK(entry.external_attr >> 16):
        raise StickslipError(f"'{path}' holds the link '{entry.filename}'; an FMU has plain files only.")
    target = folder / inside
    if entry.is_dir():
        target.mkdir(parents=True, exist_ok=True)
        return 0
    target.parent.mkdir(parents=True, exist_ok=True)
    written = 0
    with archive.open(entry) as source, target.open("wb") as file:
        # count what comes out: the sizes stated in the archive may lie
        while block := source.read(1 << 20):
            written += len(block)
            if written > room:
                raise StickslipError(f"'{path}' unpacks to more than {MAX_BYTES >> 20} MB; it is not an FMU of ours.")
            file.write(block)
    return written


def _describe(path: Path, folder: Path) -> ModelDescription:
    from fmpy import read_model_description

    xml = folder / "modelDescription.xml"
    if not xml.is_file():
        raise StickslipError(f"'{path}' is not an FMU: it holds no modelDescription.xml.")
    if b"<!DOCTYPE" in xml.read_bytes():
        raise StickslipError(f"'{path}': modelDescription.xml has a document type, which no FMU needs; it is not read.")
    try:
        description = read_model_description(str(folder), validate=False)
    except Exception as error:  # fmpy raises whatever its parser raised
        raise StickslipError(f"'{path}': modelDescription.xml cannot be read: {error}") from error
    if not str(description.fmiVersion).startswith(("2.", "3.")):
        raise StickslipError(f"'{path}' is an FMU {description.fmiVersion}; only 2.0 and 3.0 can be used.")
    return description
