"""What the archive of an FMU holds beside its library: sources, descriptions, documents."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from fmu_models.base.layout import SIGNALS
from fmu_models.base.version import version
from fmu_models.codegen.rights import Rights
from fmu_models.toolchain.compiler import engine_sources
from fmu_models.toolchain.platforms import PLATFORMS

if TYPE_CHECKING:
    from fmu_models.lowering.hybrid_system import HybridSystem

LANE_TABLES = "model_lanes.h"  # among the sources of a model that lanes follow


@functools.lru_cache(maxsize=1)  # what is built is first looked for by them
def texts_beside(system: HybridSystem, fmi_version: str, rights: Rights) -> Mapping[str, bytes | str]:
    """What the archive of a system holds beside its library, by name."""
    from fmu_models.codegen.c_source import sources
    from fmu_models.codegen.documentation import documents
    from fmu_models.codegen.lane_tables import lane_tables
    from fmu_models.codegen.model_description import model_description, render
    from fmu_models.codegen.model_structure import ModelStructure
    from fmu_models.codegen.signal_periods import signal_periods

    generated = sources(system)
    token = re.search(r'#define MODEL_TOKEN "([^"]+)"', generated["model_sizes.h"])
    if token is None:
        raise ValueError("model_sizes.h defines no MODEL_TOKEN")
    tool = f"stickslip {version()}"
    structure = ModelStructure(system)
    tables = lane_tables(system)
    lanes = {LANE_TABLES: tables} if tables else {}
    c_files = {**_engine(fmi_version), **generated, **lanes, "all.c": _all_c(system, fmi_version)}
    files: dict[str, bytes | str] = {f"sources/{name}": text for name, text in c_files.items()}
    if fmi_version == "3.0":
        files["sources/buildDescription.xml"] = render("buildDescription.xml.j2", system=system)
    folders = {p.fmi3: p.fmi2 if fmi_version == "2.0" else p.fmi3 for p in PLATFORMS.values()}
    header = f"fmi{fmi_version[0]}Functions.h"
    files["sources/CMakeLists.txt"] = render("CMakeLists.txt.j2", name=system.name, header=header, folders=folders)
    files["modelDescription.xml"] = model_description(structure, token.group(1), fmi_version, tool, rights)
    files |= {SIGNALS: signal_periods(system)} if system.signals else {}
    files |= rights.files
    files |= documents(structure, fmi_version, token.group(1), tool, rights)
    return files


def _engine(fmi_version: str) -> dict[str, str]:
    """The engine's C files for one version of FMI."""
    unused = "fmi/fmi2" if fmi_version == "3.0" else "fmi/fmi3"
    return {name: text for name, text in engine_sources().items() if not name.startswith(unused)}


# of a model with one contact gcc takes accesses to another one for real, behind conditions that rule them out
_ONE_CONTACT = """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Warray-bounds"
#endif
"""


def _all_c(system: HybridSystem, fmi_version: str) -> str:
    """The one file that is compiled."""
    names = ["model.c", *(name for name in _engine(fmi_version) if name.endswith(".c"))]
    includes = "\n".join(f'#include "{name}"' for name in names)
    nominals = ", ".join(repr(state.nominal) for state in system.states)
    return (
        f"/* {system.name}: generated model and engine as one translation unit */\n{_ONE_CONTACT}{includes}\n\n"
        f"const double model_nominal_states[MODEL_ROOM(MODEL_NX)] = {{{nominals}}};\n"
    )
