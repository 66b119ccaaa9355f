"""From a mechanism to an FMU file.

    modelDescription.xml                       variables, units, structure
    binaries/<platform>/<model>.so             compiled here
    sources/all.c ...                          the model's generated C and the engine in its folders, for importers
                                               that compile, by CMakeLists.txt too
    documentation/index.html                   equations, contacts, variables, versions, for people
    model.png, or terminalsAndIcons/           pictures, and from FMI 3.0 on what is connected to what in editors
    documentation/licenses/license.txt         under what it may be handed on
    extra/stickslip/signals.json               how often its periodic signals repeat, if it has any

The file depends on its input alone: no paths, and no date but SOURCE_DATE_EPOCH; the same mechanism gives the same
bytes.
"""

from __future__ import annotations

import dataclasses
import functools
import os
import re
import shutil
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import is_sealed, refuse_existing, seal, sealed_text, stamps, write_whole
from fmu_models.base.temporary import temporary_folder
from fmu_models.base.version import version, version_of
from fmu_models.codegen.contents import texts_beside
from fmu_models.codegen.rights import Rights
from fmu_models.language.laws import LAWS
from fmu_models.language.laws import load as load_law
from fmu_models.oscillators import MODELS
from fmu_models.toolchain.compiler import compile_shared, compiler_for
from fmu_models.toolchain.platforms import HOST, this_platform
from fmu_models.toolchain.platforms import platforms as chosen_platforms

if TYPE_CHECKING:
    from fmu_models.language.automaton import Automaton
    from fmu_models.language.maps import Map
    from fmu_models.language.mechanism import Mechanism
    from fmu_models.lowering.hybrid_system import HybridSystem

    Model = str | os.PathLike[str] | Mechanism | Automaton

FMI_VERSIONS = ("2.0", "3.0")


@dataclass(frozen=True)
class Packaging:
    """The parts of an FMU beside its model.

    Attributes:
        rights: author, copyright and licence of the model; the engine's licence alone if None.
        platforms: those it holds a library for, by name, as ``toolchain.platforms``; all are built here.
        advance: called with the part of the libraries that are built.
    """

    rights: Rights | None = None
    platforms: Sequence[str] = (HOST,)
    advance: Callable[[float], None] = lambda _: None

    @property
    def plain(self) -> bool:
        """Whether it is what the user's cache keeps."""
        return self.rights is None and tuple(self.platforms) == (HOST,)


PLAIN = Packaging()


def export(
    model: Model,
    path: str | os.PathLike[str],
    *,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    values: Mapping[str, float] | None = None,
    expose: Sequence[str] = (),
    packaging: Packaging = PLAIN,
    fmi_version: str = "3.0",
    overwrite: bool = False,
) -> Path:
    """Write a model as an FMU with Model Exchange and Co-Simulation.

    Args:
        model: a declaration, or what ``fmu_models.oscillators.load`` takes: a name, a file or a module. The FMU comes
            from the user's cache if it was built before.
        path: ends in ".fmu".
        contacts: names of those to keep; all if None.
        laws: per contact a law to build around its own: a name such as "lugre", a file or a module, as in ``LAWS``.
        values: of parameters, as start values in place of their defaults.
        expose: local variables that are to be outputs, by name; "states" and "clocks" are those of all contacts: the
            states are integers, the clocks of FMI 3 are no numbers, and not every importer reads either.
        packaging: rights, platforms and progress.
        fmi_version: "2.0" or "3.0".

    Returns:
        ``path``.

    Raises:
        StickslipError: unknown model, contact, law, version or thing to expose, ``path`` exists and ``overwrite`` is
            false or cannot be written, a value that the model cannot have, or the compiler fails.
    """
    path = checked(path, fmi_version, overwrite)
    if not values and not expose and packaging.plain and isinstance(model, str | os.PathLike):
        file = built(model, contacts=contacts, laws=laws, fmi_version=fmi_version)
        with write_whole(path, overwrite=overwrite) as temporary:
            shutil.copyfile(file, temporary)
        return path
    system = _lowered(model, contacts, laws)
    system = dataclasses.replace(system, exposed=_exposed(system, expose, fmi_version))
    changed = _with_values(system, values or {})
    return write(changed, path, packaging=packaging, fmi_version=fmi_version, overwrite=overwrite)


def export_map(
    declared: Map,
    path: str | os.PathLike[str],
    *,
    values: Mapping[str, float] | None = None,
    packaging: Packaging = PLAIN,
    fmi_version: str = "3.0",
    overwrite: bool = False,
) -> Path:
    """Write a declared map as an FMU that makes a step at every time event; the rest is as for ``export``.

    Its parameter ``period`` is the time from one step to the next, s; the first comes a period after the start.

    Raises:
        StickslipError: as for ``export``, or the map has a quantity of that name.
    """
    from fmu_models.lowering.iterated import iterated

    path = checked(path, fmi_version, overwrite)
    system = _with_values(iterated(declared), values or {})
    return write(system, path, packaging=packaging, fmi_version=fmi_version, overwrite=overwrite)


def write(
    system: HybridSystem,
    path: str | os.PathLike[str],
    *,
    packaging: Packaging = PLAIN,
    fmi_version: str = "3.0",
    overwrite: bool = False,
) -> Path:
    """Write a lowered system as an FMU; the rest is as for ``export``, errors too."""
    path = checked(path, fmi_version, overwrite)
    texts = texts_beside(system, fmi_version, packaging.rights or Rights())
    _pack({**texts, **_libraries(system.name, texts, fmi_version, packaging)}, path, overwrite)
    return path


def _pack(files: Mapping[str, bytes | str], path: Path, overwrite: bool, method: int = zipfile.ZIP_DEFLATED) -> None:
    with write_whole(path, overwrite=overwrite) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = method
            entry.create_system = 3  # Unix, whatever this machine is: part of the bytes
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, files[name])


def variant(
    model: Model,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    *,
    beside: Path | None = None,
) -> Mechanism:
    """A model with some of its contacts only, or with other laws.

    Args:
        model: a declaration, or what ``fmu_models.oscillators.load`` takes: a name, a file or a module.
        contacts, laws: as for ``export``.
        beside: folder that relative paths start from; the working folder if None.

    Raises:
        StickslipError: unknown model, contact or law.
    """
    # an automaton answers the same calls
    mechanism = cast("Mechanism", MODELS.load(model, beside) if isinstance(model, str | os.PathLike) else model)
    if contacts is not None:
        mechanism = mechanism.restricted_to(contacts)
    with ExitStack() as users:
        for law in (laws or {}).values():
            users.enter_context(LAWS.running(law, beside))
        others = _laws(mechanism, laws or {}, beside)
        return mechanism.with_law(**others) if others else mechanism


def built(
    model: Model,
    *,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    fmi_version: str = "3.0",
    beside: Path | None = None,
) -> Path:
    """The FMU of a ``variant``, from the user's cache if it was built before; of our own without any symbolic work.

    Errors as for ``variant`` and ``export``.
    """
    name, options, lowered = _kept(model, contacts, laws, fmi_version, beside)
    return kept_as(name, options, lowered, fmi_version)


def prepared(
    model: Model,
    *,
    contacts: Sequence[str] | None = None,
    laws: Mapping[str, str] | None = None,
    fmi_version: str = "3.0",
) -> tuple[Path, Callable[[], Path] | None]:
    """The FMU of a ``variant`` and None if it was built before; else it without a library, and what completes it.

    Errors as for ``built``; of the compiler, which may be slow, when it is completed.
    """
    name, options, lowered = _kept(model, contacts, laws, fmi_version, None)
    file = kept_folder(*options) / f"{name}.fmu"
    # no part alone by other compilers than ours, nor for Windows, where what is exported cannot belong to a unit
    if is_sealed(file):
        return file, None
    if not compiler_for().cross or os.name == "nt":
        return kept_as(name, options, lowered, fmi_version), None
    packed = file.parent / "sources" / file.name
    if not is_sealed(packed):
        packed.parent.mkdir(parents=True, exist_ok=True)
        texts = texts_beside(lowered(), fmi_version, Rights())
        _pack(texts, packed, overwrite=True, method=zipfile.ZIP_STORED)  # it is soon read again
        seal(packed)
    return packed, functools.partial(_completed, packed, file, fmi_version)


def _completed(packed: Path, file: Path, fmi_version: str) -> Path:
    """The FMU of one without a library."""
    if not is_sealed(file):
        with zipfile.ZipFile(packed) as archive:
            texts: dict[str, bytes | str] = {name: archive.read(name) for name in archive.namelist()}
        _pack({**texts, **_libraries(file.stem, texts, fmi_version, PLAIN)}, file, overwrite=True)
        seal(file)
    return file


def _kept(
    model: Model, contacts: Sequence[str] | None, laws: Mapping[str, str] | None, fmi_version: str, beside: Path | None
) -> tuple[str, Sequence[str | bytes], Callable[[], HybridSystem]]:
    """The name of a variant, the options under which it is kept, and what lowers it."""
    checked("model.fmu", fmi_version, overwrite=True)
    if not kept_by_name(model, laws):
        system = _lowered(model, contacts, laws, beside)
        return system.name, _options_of(system, fmi_version), lambda: system
    options = (
        str(model),
        "all" if contacts is None else ",".join(sorted(contacts)),
        *(f"{contact}={law}" for contact, law in sorted((laws or {}).items())),
        fmi_version,
    )
    return str(model), options, lambda: _lowered(str(model), contacts, laws)


def _lowered(
    model: Model, contacts: Sequence[str] | None, laws: Mapping[str, str] | None, beside: Path | None = None
) -> HybridSystem:
    from fmu_models.lowering.lower import lower  # brings SymPy, which what is kept does not need

    return lower(variant(model, contacts, laws, beside=beside))


def built_of(system: HybridSystem, fmi_version: str = "3.0") -> Path:
    """The FMU of a lowered system, from the user's cache if one with the same sources was built before. StickslipError:
    unknown version, or the compiler fails."""
    checked("model.fmu", fmi_version, overwrite=True)
    return kept_as(system.name, _options_of(system, fmi_version), lambda: system, fmi_version)


def _options_of(system: HybridSystem, fmi_version: str) -> Sequence[str | bytes]:
    texts = texts_beside(system, fmi_version, Rights())
    return ("sources", *(text for name in sorted(texts) for text in (name, texts[name])))


def kept_as(
    name: str, options: Sequence[str | bytes], lowered: Callable[[], HybridSystem], fmi_version: str = "3.0"
) -> Path:
    """The FMU of these options, from the user's cache if it was built before, else of what ``lowered`` makes."""
    file = kept_folder(*options) / f"{name}.fmu"
    if not is_sealed(file):
        write(lowered(), file, fmi_version=fmi_version, overwrite=True)
        seal(file)
    return file


def kept_by_name(model: Model, laws: Mapping[str, str] | None = None) -> bool:
    """Whether what is made of a model may be kept under its name and those of its laws: ours, whose sources the cache
    knows."""
    shipped = isinstance(model, str) and model in MODELS.members()
    return shipped and all(law in LAWS.members() for law in (laws or {}).values())


def kept_folder(*options: str | bytes) -> Path:
    """The cache folder of these options, with the present sources, tools and machine."""
    date = os.environ.get("SOURCE_DATE_EPOCH", "")
    keys = (_sources_digest(), *options, this_platform().fmi3, date)
    return cache_folder() / "fmus" / digest(*keys)


def checked(path: str | os.PathLike[str], fmi_version: str, overwrite: bool) -> Path:
    """The path of an FMU to be written; refuses before the work what would be refused after it. StickslipError: unknown
    version, another suffix than .fmu, or ``path`` exists and ``overwrite`` is false."""
    if fmi_version not in FMI_VERSIONS:
        raise StickslipError(f"There is no FMI {fmi_version} export. Choose {' or '.join(FMI_VERSIONS)}.")
    path = Path(path)
    if path.suffix != ".fmu":
        raise StickslipError(f"'{path}' must end in .fmu, by which importers know an FMU.")
    refuse_existing(path, overwrite=overwrite)
    return path


def _laws(mechanism: Mechanism, laws: Mapping[str, str], beside: Path | None) -> dict[str, Any]:
    """Law objects by contact, where it has another, around the law it has; parameters end like the contact's name."""
    replaced = {}
    for contact, name in laws.items():
        current, law = mechanism.law_of(contact), load_law(name, beside)
        if type(current) is law:
            continue
        if not hasattr(law, "around"):
            raise StickslipError(f"The law '{name}' cannot be built around another. Declare it in the model instead.")
        digits = re.search(r"\d*$", contact)
        replaced[contact] = law.around(current, digits.group() if digits else "")
    return replaced


def _exposed(system: HybridSystem, expose: Sequence[str], fmi_version: str) -> frozenset[str]:
    """Names of the variables and clocks to expose."""
    from fmu_models.codegen.variables import Variables

    if not expose:
        return frozenset()
    variables = Variables(system)
    clocks, states = ({v.name for v in kind} for kind in (variables.clocks, variables.contact_states))
    groups = {"states": states, "clocks": clocks}
    local = {v.name for v in variables.listed if v.causality in ("local", "output")} | clocks
    for name in expose:
        if name not in groups and name not in local:
            raise StickslipError(f"There is no local '{name}' to expose.{nearest(name, (*groups, *local))}")
    exposed = frozenset().union(*(groups.get(name, {name}) for name in expose))
    if ("clocks" in expose or exposed & clocks) and fmi_version == "2.0":
        raise StickslipError("FMI 2.0 has no clocks to expose. Export FMI 3.0, or expose the states.")
    return exposed


def _with_values(system: HybridSystem, values: Mapping[str, float]) -> HybridSystem:
    """The system with other start values of its parameters."""
    from fmu_models.language.values import check_values

    check_values(system, values)
    parameters = tuple(p.with_value(values[p.name]) if p.name in values else p for p in system.parameters)
    return dataclasses.replace(system, parameters=parameters)


def _libraries(
    model: str, texts: Mapping[str, bytes | str], fmi_version: str, packaging: Packaging
) -> dict[str, bytes | str]:
    """Those of the archive by name; the compiler runs for as many platforms at once as there are processors."""
    # brings logging, which what is kept does not need
    from concurrent.futures import ThreadPoolExecutor, as_completed

    platforms, files = chosen_platforms(packaging.platforms), dict[str, bytes | str]()
    c_files = {name.removeprefix("sources/"): texts[name] for name in texts if name.endswith((".c", ".h"))}
    with temporary_folder("export") as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        built = {
            pool.submit(compile_shared, c_files, folder / platform.target, target=platform.target): platform
            for platform in platforms
        }
        try:
            for done, library in enumerate(as_completed(built)):
                subfolder = built[library].fmi2 if fmi_version == "2.0" else built[library].fmi3
                name = f"binaries/{subfolder}/{model}{built[library].suffix}"
                files[name] = library.result().read_bytes()
                packaging.advance((done + 1) / len(built))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return files


def _sources_digest() -> str:
    """Hash of every file of this package that an FMU depends on, and of the versions of the tools."""
    tools = (*(version_of(name) for name in ("fmpy", "sympy")), version(), compiler_for().name)
    return digest(_files_digest(), *tools)


@functools.cache  # a process goes on with the modules that it began with
def _files_digest() -> str:
    root = Path(__file__).parent.parent
    folders = ("base", "codegen", "engine", "language", "lowering", "oscillators", "toolchain")
    stamped = sorted(line for folder in folders for line in stamps(root / folder))

    def contents() -> str:
        files = [Path(line.partition("\n")[0]) for line in stamped]
        return digest(*(text for path in files for text in (str(path.relative_to(root)), path.read_bytes())))

    return sealed_text(cache_folder() / "sources" / f"{digest(*stamped)}.txt", contents)
