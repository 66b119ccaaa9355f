"""Whether an FMU is what its model gives: built once more as it says of itself, and compared byte by byte."""

import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import zip_longest
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.temporary import temporary_folder
from fmu_models.base.version import version
from fmu_models.codegen.package import Packaging, export
from fmu_models.codegen.rights import ENGINE_LICENSE, FOLDER, Rights
from fmu_models.fmu.fmu import Fmu
from fmu_models.oscillators import MODELS


@dataclass(frozen=True)
class Verification:
    """The result of a verification.

    Attributes:
        entries: how many files the archive holds.
        differences: of files, one sentence each; empty if the archives agree to the last byte.
    """

    entries: int
    differences: tuple[str, ...]


def verify(path: str | os.PathLike[str]) -> Verification:
    """Build an FMU of ours once more, with the contacts, start values, rights, date and platforms that it states.
    StickslipError: it cannot be read, is not of this version of the suite, or its model is none of ours."""
    fmu = Fmu.open(path)
    made_by, this_version = fmu.description.generationTool, f"stickslip {version()}"
    if made_by != this_version:
        raise StickslipError(
            f"'{path}' was made by {made_by or 'an unknown tool'}. {this_version} verifies its own FMUs only."
        )
    name = _model(fmu)
    if name is None:
        named = str(fmu.description.modelName)
        raise StickslipError(
            f"There is no model '{named}' here to build '{path}' from.{nearest(named, MODELS.members())} "
            "What is declared in a file is verified by exporting that once more."
        )
    with temporary_folder("verify") as folder, _date(fmu.description.generationDateAndTime):
        rebuilt = export(name, folder / "again.fmu", **_options(fmu, name, folder))
        return _compared(fmu.path, rebuilt)


def _model(fmu: Fmu) -> str | None:
    """The model; with some of its contacts it has their names behind its own."""
    named = str(fmu.description.modelName)
    return max((name for name in MODELS.members() if f"{named}_".startswith(f"{name}_")), key=len, default=None)


def _options(fmu: Fmu, name: str, folder: Path) -> dict[str, Any]:
    """Arguments of ``export`` that an FMU tells."""
    mechanism = MODELS.load(name)
    declared = {p.name: p.value for p in mechanism.parameters}
    starts = {name: float(str(fmu.variables[name].start)) for name in fmu.parameters}
    all_contacts = [contact.name for contact in mechanism.contacts]
    return {
        "contacts": None if set(fmu.contacts) == set(all_contacts) else list(fmu.contacts),
        "values": {key: value for key, value in starts.items() if declared.get(key, value) != value},
        "expose": [name for name, v in fmu.variables.items() if v.causality == "output"],
        "packaging": Packaging(
            _rights(fmu, folder), sorted(folder.name for folder in (fmu.folder / "binaries").iterdir())
        ),
        "fmi_version": f"{fmu.fmi}.0",
    }


def _rights(fmu: Fmu, folder: Path) -> Rights | None:
    stated = fmu.description
    license_ = (stated.license or "").removesuffix(f"; engine {ENGINE_LICENSE}")
    if stated.license in (None, ENGINE_LICENSE):
        return Rights(stated.author, stated.copyright) if stated.author or stated.copyright else None
    if license_.startswith("see "):
        text = (fmu.folder / FOLDER / "license.txt").read_text("utf-8")
        licence = folder / "license.txt"
        licence.write_text(text.partition("\n\n")[2].partition("\n\n\nThe engine (")[0], "utf-8")
        license_ = str(licence)
    return Rights(stated.author, stated.copyright, license_)


@contextmanager
def _date(stated: str | None) -> Iterator[None]:
    """SOURCE_DATE_EPOCH as it was when a date was stated, none without."""
    before = os.environ.pop("SOURCE_DATE_EPOCH", None)
    if stated:
        moment = datetime.strptime(stated, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=UTC)
        os.environ["SOURCE_DATE_EPOCH"] = str(int(moment.timestamp()))
    try:
        yield
    finally:
        os.environ.pop("SOURCE_DATE_EPOCH", None)
        if before is not None:
            os.environ["SOURCE_DATE_EPOCH"] = before


def _compared(path: Path, rebuilt: Path) -> Verification:
    actual, expected = _entries(path), _entries(rebuilt)
    differences = [f"{name}: not what the model gives" for name in sorted(actual.keys() - expected.keys())]
    differences += [f"{name}: missing" for name in sorted(expected.keys() - actual.keys())]
    for name in sorted(actual.keys() & expected.keys()):
        if actual[name] != expected[name]:
            differences.append(f"{name}: {_difference(name, actual[name], expected[name])}")
    if not differences and path.read_bytes() != rebuilt.read_bytes():
        differences = ["all files agree, but the archive was packed by another program"]
    return Verification(len(actual), tuple(differences))


def _entries(path: Path) -> Mapping[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _difference(name: str, actual: bytes, expected: bytes) -> str:
    """Where two files part."""
    if name.startswith("binaries/"):
        at = next((i for i, (a, b) in enumerate(zip(actual, expected, strict=False)) if a != b), len(expected))
        return f"differs from byte {at} on, {len(actual)} bytes for {len(expected)}"
    lines = zip_longest(actual.decode("utf-8", "replace").splitlines(), expected.decode("utf-8").splitlines())
    for number, (actual_line, expected_line) in enumerate(lines, 1):
        if actual_line != expected_line:
            return f"line {number} is {_shown(actual_line)}, the model gives {_shown(expected_line)}"
    return "ends of lines differ"


def _shown(line: str | None) -> str:
    return "missing" if line is None else repr(line.strip()[:200])
