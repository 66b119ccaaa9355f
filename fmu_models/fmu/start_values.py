"""An FMU with other start values of its parameters: a copy, changed in those places only.

    modelDescription.xml    the attribute ``start`` of each parameter; every other byte stays
    our own FMUs            the start values in sources/model.c too; the library for this machine is compiled anew from
                            there, those for others are left out (importers build them from the sources)
    FMUs of others          a library has its own start values in it. Where it does not take them from the description,
                            the copy would say one thing and do another: it is refused

The library of somebody else is asked in a process of its own.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import write_whole
from fmu_models.base.processes import isolated
from fmu_models.base.temporary import temporary_folder
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import LIBRARIES, library, this_folder

if TYPE_CHECKING:
    from fmpy.model_description import ScalarVariable

DESCRIPTION = "modelDescription.xml"
MODEL = "sources/model.c"
PATIENCE = 60.0  # s that a library may take to say its start values
SAME = 1e-9  # relative difference up to which it has taken them
_TAG = re.compile(rb"""(?:[^>"']|"[^"]*"|'[^']*')*>""")  # a '>' in the quotes of an attribute does not end it


def check_parameter(fmu: Fmu, name: str, value: float) -> ScalarVariable:
    """The parameter of an FMU that is to have a start value. StickslipError: there is none of this name, it is no real
    parameter, or the value is out of its range."""
    variable = fmu.variables.get(name)
    if variable is None or variable.causality != "parameter":
        role = f"is a {variable.causality} of" if variable is not None else "is no variable of"
        raise StickslipError(f"'{name}' {role} '{fmu.path}', not a parameter.{nearest(name, fmu.parameters)}")
    if str(variable.type) not in ("Real", "Float64", "Float32"):
        raise StickslipError(f"'{name}' of '{fmu.path}' is of type {variable.type}; a real parameter is needed.")
    if variable.start is None:
        raise StickslipError(f"'{name}' of '{fmu.path}' has no start value: the FMU computes it. Set it at a run.")
    for limit, sense in ((variable.min, -1), (variable.max, 1)):
        if limit is not None and sense * (value - float(limit)) > 0:
            word = "at most" if sense > 0 else "at least"
            raise StickslipError(f"'{name}' of '{fmu.path}' must be {word} {float(limit):g}, found {value:g}.")
    return variable


def copy_with_start_values(fmu: Fmu, path: str | Path, values: Mapping[str, float], *, overwrite: bool = False) -> Path:
    """Write a copy of an FMU whose parameters have other start values, in its own units. StickslipError: see
    `check_parameter`; the library keeps its own start values; or ``path`` exists and ``overwrite`` is false, or cannot
    be written."""
    target = Path(path)
    if target.suffix != ".fmu":
        raise StickslipError(f"'{target}' must end in .fmu, by which importers know an FMU.")
    for name, value in values.items():
        check_parameter(fmu, name, value)
    changed = {DESCRIPTION: _description((fmu.folder / DESCRIPTION).read_bytes(), values, fmu)}
    if fmu.ours:
        changed |= _compiled(fmu, values)
    else:
        _check_library(fmu, values)
    with write_whole(target, overwrite=overwrite) as temporary:
        _repack(fmu.path, temporary, changed, drop_libraries=fmu.ours)
        written = Fmu.open(temporary)
        for name, value in values.items():
            if float(str(written.variables[name].start)) != value:
                raise StickslipError(f"'{fmu.path}': the start value of '{name}' could not be changed.")
    return target


def _description(xml: bytes, values: Mapping[str, float], fmu: Fmu) -> bytes:
    """The text of modelDescription.xml with other attributes ``start``."""
    places = _places(xml, set(values))
    pattern = re.compile(rb"""(\sstart\s*=\s*)("[^"]*"|'[^']*')""")
    for position, name in sorted(((position, name) for name, position in places.items()), reverse=True):
        tag = _TAG.match(xml, position)
        assert tag is not None  # expat has read it
        end = tag.end()
        new, count = pattern.subn(
            lambda m, name=name: m[1] + quoteattr(repr(float(values[name]))).encode(), xml[position:end], count=1
        )
        if count != 1:
            raise StickslipError(f"'{fmu.path}': '{name}' has no start attribute where one was expected.")
        xml = xml[:position] + new + xml[end:]
    return xml


def _places(xml: bytes, names: set[str]) -> dict[str, int]:
    """Byte at which the tag begins that holds the start value of each variable."""
    positions: dict[str, int] = {}
    scalar: list[str] = []
    parser = expat.ParserCreate()

    def opened(tag: str, attributes: dict[str, str]) -> None:
        if tag in ("Float64", "Float32") and attributes.get("name") in names:
            positions[attributes["name"]] = parser.CurrentByteIndex
        elif tag == "ScalarVariable":
            scalar[:] = [attributes.get("name", "")]
        elif tag == "Real" and scalar and scalar[0] in names:
            positions[scalar[0]] = parser.CurrentByteIndex

    def closed(tag: str) -> None:
        if tag == "ScalarVariable":
            scalar.clear()

    parser.StartElementHandler = opened
    parser.EndElementHandler = closed
    parser.Parse(xml, True)
    return positions


def _compiled(fmu: Fmu, values: Mapping[str, float]) -> dict[str, bytes]:
    """Sources and library of an FMU of this suite with other start values."""
    import shutil

    source = (fmu.folder / MODEL).read_text("utf-8")
    table = re.search(r"(const double model_start_parameters\[[^\]]*\] = \{)([^}]*)(\};)", source)
    if table is None:
        raise StickslipError(f"'{fmu.path}' has no table of start values in its sources. Export its model again.")
    numbers = table[2].split(", ")
    for name, value in values.items():
        numbers[fmu.parameters.index(name)] = repr(float(value))
    text = source[: table.start()] + table[1] + ", ".join(numbers) + table[3] + source[table.end() :]
    identifier = str(fmu.description.coSimulation.modelIdentifier if fmu.description.coSimulation else "")
    with temporary_folder("start") as room:
        folder = room / "fmu"
        shutil.copytree(fmu.folder, folder, ignore=shutil.ignore_patterns("binaries"))
        shutil.copytree(fmu.sources, folder / "sources", dirs_exist_ok=True)
        (folder / MODEL).write_text(text, "utf-8")
        binary = library(Fmu.unpacked(fmu.path, folder), identifier).read_bytes()
        suffix = next((folder / "binaries" / this_folder(fmu)).iterdir()).suffix
    page = fmu.folder / "documentation" / "index.html"
    pages = {"documentation/index.html": _page(page.read_text("utf-8"), values).encode()} if page.is_file() else {}
    return {MODEL: text.encode(), f"binaries/{this_folder(fmu)}/{identifier}{suffix}": binary, **pages}


def _page(page: str, values: Mapping[str, float]) -> str:
    """The page for people with the new start values."""
    for name, value in values.items():
        page = re.sub(rf"(<tr><td>{re.escape(name)}</td><td>)[^<]*", lambda m, v=value: f"{m[1]}{v!r}", page, count=1)
    return page


def _repack(source: Path, target: Path, changed: Mapping[str, bytes], *, drop_libraries: bool) -> None:
    """Copy an archive entry by entry, some with other contents."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        remaining = dict(changed)
        for entry in {entry.filename: entry for entry in old.infolist()}.values():
            if entry.is_dir():
                continue
            content = remaining.pop(entry.filename, None)
            if content is None and drop_libraries and entry.filename.endswith(LIBRARIES):
                continue
            new.writestr(entry, old.read(entry) if content is None else content)
        for name, content in remaining.items():
            added = zipfile.ZipInfo(name)  # of 1980, whatever the clock says
            added.compress_type = zipfile.ZIP_DEFLATED
            added.external_attr = 0o100644 << 16
            new.writestr(added, content)


def _check_library(fmu: Fmu, values: Mapping[str, float]) -> None:
    """Refuse where the library of somebody else would not have the new start values.

    Where it cannot be asked (no library for this machine), nothing can be said and nothing is refused.
    """
    with temporary_folder("start") as room:
        trial = room / fmu.path.name
        changed = {DESCRIPTION: _description((fmu.folder / DESCRIPTION).read_bytes(), values, fmu)}
        _repack(fmu.path, trial, changed, drop_libraries=False)
        try:
            mismatch = isolated(library_starts, str(trial), list(values), limits=Limits(time=PATIENCE))
        except IsolatedFailure as error:
            raise StickslipError(f"'{fmu.path}' cannot be asked for its start values: {error}") from error
    for name, value in values.items():
        if mismatch is not None and abs(mismatch[name] - value) > SAME * max(abs(value), 1e-300):
            raise StickslipError(
                f"The library in '{fmu.path}' keeps its own start value {mismatch[name]:g} of '{name}' whatever the "
                "description says, so that a copy with another one would be wrong. Hand over a parameter set (.ssv) "
                "instead, or set the values at each run."
            )


def library_starts(path: str, names: list[str]) -> dict[str, float] | None:
    """Values of parameters as the library has them after instantiation; None if there is none for this machine."""
    from fmpy import instantiate_fmu
    from fmpy.fmi1 import FMICallException

    fmu = Fmu.open(path)
    description = fmu.description
    interface = description.coSimulation or description.modelExchange
    if interface is None:
        return None
    try:
        library(fmu, str(interface.modelIdentifier))
    except StickslipError:
        return None
    stepping = description.coSimulation is not None
    instance: Any = instantiate_fmu(str(fmu.folder), description, "CoSimulation" if stepping else "ModelExchange")
    try:
        if fmu.adapted:
            instance.initialize()
        else:
            if fmu.fmi == 2:
                instance.setupExperiment(startTime=0.0)
            instance.enterInitializationMode()
        references = [fmu.variables[name].valueReference for name in names]
        read = instance.getReal if fmu.fmi == 2 else instance.getFloat64
        return dict(zip(names, map(float, read(references)), strict=True))
    except FMICallException as error:
        raise StickslipError(f"'{path}' cannot be asked for its start values: {error}") from error
