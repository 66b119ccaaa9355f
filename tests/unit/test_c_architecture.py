"""The rooms of the C and their arrows: includes and calls point down, between files too, without a circle."""

from __future__ import annotations

import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path, PurePosixPath

import pytest

from fmu_models.codegen.c_source import sources
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load
from fmu_models.toolchain.compiler import compile_shared, engine_sources

ROOT = Path(__file__).parents[2] / "fmu_models"

# room -> rooms that it may use; the engine knows nobody outside
ARROWS = {
    "engine/model": set(),
    "engine/step": {"engine/model"},
    "engine/events": {"engine/model", "engine/step"},
    "engine/tangents": {"engine/model", "engine/step", "engine/events"},
    "engine/fmi": {"engine/model", "engine/step", "engine/events", "engine/tangents"},
    "engine/whole_run": {"engine/model", "engine/step", "engine/events", "engine/tangents", "engine/fmi"},
    "engine/ensemble": {
        *("engine/model", "engine/step", "engine/events", "engine/tangents", "engine/fmi", "engine/whole_run")
    },
    "importer/c": {"engine/model", "engine/step"},
    # beside the FMU: it knows the numbers of the model and the contract with ensembles
    "lanes/c": {"engine/model", "engine/ensemble"},
    # the part of a model's library that whole runs reach
    "fmu/c": {"engine/model", "engine/whole_run"},
    # one instance in a page, by the calls of whole runs
    "explorer/c": {"engine/model", "engine/fmi", "engine/whole_run"},
}
# made per model, beside the rooms of the engine; what they include is of the room of the model
GENERATED = {"engine/model_sizes.h", "engine/model_kind.c", "engine/model_variation.c", "engine/model_lanes.h"}
GENERATED |= {"engine/model_discs.c"}
GENERATED |= {"explorer/c/explore_period.h", "fmu/c/all.c"}
# stands for the C library in a page: its functions are called by the standard's headers
LIBRARY = "explorer/c/freestanding.c"

INCLUDE = re.compile(r'^\s*#\s*include "([^"]+)"', re.MULTILINE)
NOT_CODE = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:[^"\\\n]|\\.)*"', re.DOTALL)
DEFINITION = re.compile(
    r"^(?!static\b|typedef\b|struct\b|enum\b)[A-Za-z_][\w \t*]*?\b(\w+)\([^;{}]*\)\s*\{", re.MULTILINE
)
STANDARD = re.compile(r"fmi[123]\w+\.h")


@cache
def texts() -> dict[str, str]:
    """Every C file and header by its path below fmu_models."""
    found = sorted(path for path in ROOT.rglob("*") if path.suffix in (".c", ".h"))
    return {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in found}


def module(file: str) -> str:
    return file.rpartition(".")[0]


def room(file: str) -> str:
    return str(PurePosixPath(file).parent)


def resolved(file: str, name: str) -> str:
    """The file that an include means, from the folder of the one that includes it."""
    parts: list[str] = []
    for part in (PurePosixPath(file).parent / name).parts:
        parts = parts[:-1] if part == ".." else [*parts, part]
    return "/".join(parts)


def included() -> set[tuple[str, str]]:
    """Pairs of files: who includes whom, what is generated and the headers of the standard left out."""
    pairs = {
        (file, resolved(file, name))
        for file, text in texts().items()
        for name in INCLUDE.findall(text)
        if not STANDARD.fullmatch(name)
    }
    return {pair for pair in pairs if pair[1] not in GENERATED}


@cache
def owners() -> dict[str, set[str]]:
    """The files that define each function that is not static."""
    found: dict[str, set[str]] = {}
    for file, text in texts().items():
        if file == LIBRARY:
            continue
        for name in DEFINITION.findall(NOT_CODE.sub(" ", text)):
            found.setdefault(name, set()).add(file)
    return found


def used() -> set[tuple[str, str]]:
    """Pairs of files: who names a function of whom."""
    pairs = set()
    for file, text in texts().items():
        for name in set(re.findall(r"\b[A-Za-z_]\w*\b", NOT_CODE.sub(" ", text))) & owners().keys():
            (owner,) = owners()[name]
            pairs.add((file, owner))
    return {(a, b) for a, b in pairs if module(a) != module(b)}


def test_every_file_is_in_a_room() -> None:
    assert {room(file) for file in texts()} == set(ARROWS)


def test_what_is_included_is_there() -> None:
    assert [pair for pair in sorted(included()) if pair[1] not in texts()] == []


def test_a_function_is_defined_once() -> None:
    assert len(owners()) > 100
    assert {name: files for name, files in owners().items() if len(files) > 1} == {}


@pytest.mark.parametrize("arrows", [included, used])
def test_arrows_between_rooms_point_down(arrows) -> None:
    up = [f"{a} -> {b}" for a, b in sorted(arrows()) if room(b) != room(a) and room(b) not in ARROWS[room(a)]]
    assert not up, f"these lean on a room above or beside them: {up}"


def test_no_circle_between_files() -> None:
    graph: dict[str, set[str]] = {}
    for a, b in included() | used():
        if module(a) != module(b):
            graph.setdefault(module(a), set()).add(module(b))
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"a circle between files: {' -> '.join(reversed(error.args[1]))}")


@pytest.mark.nightly
def test_every_file_compiles_by_itself(tmp_path: Path) -> None:
    system = lower(load("woodpecker"))
    rooms = {name: text for name, text in engine_sources().items() if name != "fmi/fmi2.c"}
    nominal = '#include "model/model.h"\nconst double model_nominal_states[MODEL_ROOM(MODEL_NX)] = {1.0};\n'
    everything = {**rooms, **sources(system), "nominal.c": nominal}
    included = ("model_kind.c", "model_variation.c", "model_discs.c")
    files = [name for name in everything if name.endswith(".c") and name not in included]
    compile_shared(everything, tmp_path / "library", files=files)
