"""The floors of the house: imports point downwards only, and never in a circle, those for types alone included."""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# from the ground up; a room may import rooms of lower floors, not its neighbours
FLOORS = (
    ("fmu_models.base",),
    ("fmu_models.toolchain", "fmu_models.language"),
    ("fmu_models.lowering", "fmu_models.oscillators", "fmu_models.maps"),
    ("fmu_models.codegen",),
    ("fmu_models.fmu",),
    ("fmu_models.lanes",),
    ("fmu_models.simulation",),
    ("fmu_models.importer",),
    ("fmu_models.families", "fmu_models.coupling"),
    ("fmu_models.sections",),
    ("fmu_models.continuation",),
    ("fmu_models.analyses",),
    ("fmu_models.scene",),
    ("fmu_models.report",),
    ("fmu_models.explorer", "fmu_models.validation"),
    ("fmu_models.commands",),
    ("rig_io.logs",),
    ("rig_io.readers", "rig_io.repair", "rig_io.sensors"),
    ("rig_io.joining",),
    ("rig_io.packages",),
    ("rig_io.description",),
    ("rig_io.bench",),
    ("rig_io.commands",),
    ("identification.inference",),
    ("identification.laws", "identification.measurement"),
    ("identification.disturbances",),
    ("identification.calibration", "identification.estimators", "identification.slips"),
    ("identification.hysteresis",),
    ("identification.machines",),
    ("identification.free_friction", "identification.series"),
    ("identification.fit",),
    ("identification.fitted_model",),
    ("identification.model_check", "identification.next_step", "identification.transfer"),
    ("identification.report", "identification.watch"),
    ("identification.studio",),
    ("identification.commands",),
    ("identification.cli",),
)
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
PACKAGES = ("fmu_models", "rig_io", "identification")


def _name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


FILES = {_name(path): path for top in PACKAGES for path in sorted((ROOT / top).rglob("*.py"))}


def room_of(module: str) -> str:
    """The first two names: a room, or a package's own root."""
    return ".".join(module.split(".")[:2])


def imports(module: str) -> Iterator[str]:
    """Modules of ours that a module imports, wherever in it; ``from a import b`` is a.b where that is a module."""
    for node in ast.walk(ast.parse(FILES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative imports hide the floor they reach"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in FILES else node.module or "" for name in names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@cache
def arrows() -> dict[str, set[str]]:
    """Modules that each module imports."""
    return {module: {target for target in imports(module) if target in FILES} - {module} for module in FILES}


@pytest.mark.parametrize("module", [module for module in FILES if module not in PACKAGES])
def test_imports_point_downwards(module):
    room = room_of(module)
    assert room in FLOOR, f"{module} is in no room: give it one in FLOORS"
    for target in arrows()[module]:
        if target in PACKAGES or room_of(target) == room:
            continue
        assert FLOOR[room_of(target)] < FLOOR[room], f"{module} may not import {target}, which is not below it"


def test_no_circle():
    try:
        TopologicalSorter(arrows()).prepare()
    except CycleError as error:
        pytest.fail(f"files import each other in a circle: {' -> '.join(error.args[1])}")


@pytest.mark.parametrize("package", PACKAGES)
def test_no_loose_files(package):
    loose = {path.name for path in (ROOT / package).glob("*.py")} - {"__init__.py", "cli.py"}
    assert not loose, f"give {', '.join(sorted(loose))} a room"


def test_names_of_tests_are_unique():
    """Pytest collects one of two files of the same name only, whatever folders they are in."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert not [name for name, count in names.items() if count > 1]


def test_the_oracle_of_random_declarations_shares_nothing_with_what_it_judges() -> None:
    allowed = {"numpy", "scipy", "sympy", "oracle", *sys.stdlib_module_names}
    files = sorted((ROOT / "tests" / "oracle").rglob("*.py"))
    assert files
    for path in files:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert {name.split(".")[0] for name in names} <= allowed, f"{path.name}: {names}"
            called = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id
            assert called not in ("__import__", "exec"), path.name
