"""The floors of the house: imports point downwards only."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# what each room may import, beside itself, the standard library and third parties; fmu_models means its top floor
BASE = {"fmu_models.base.errors", "fmu_models.base.files"}
ROOMS = {
    "fmu_models.base.errors": set(),
    "fmu_models.base.files": {"fmu_models.base.errors"},
    "fmu_models.base.console": BASE,
    "fmu_models.engine": BASE,
    "fmu_models.language": BASE,
    "fmu_models.oscillators": BASE | {"fmu_models.language"},
    "fmu_models.maps": BASE | {"fmu_models.language"},
    "fmu_models.lowering": BASE | {"fmu_models.language"},
    "fmu_models.codegen": BASE
    | {"fmu_models.language", "fmu_models.lowering", "fmu_models.engine", "fmu_models.oscillators"},
    "fmu_models.simulation": BASE | {"fmu_models.codegen", "fmu_models.engine"},
    "fmu_models.analyses": BASE | {"fmu_models.language", "fmu_models.simulation"},
    "fmu_models.scene": BASE
    | {
        "fmu_models.language",
        "fmu_models.lowering",
        "fmu_models.codegen",
        "fmu_models.engine",
        "fmu_models.simulation",
        "fmu_models.analyses",
    },
    "fmu_models.validation.methods": BASE | {"fmu_models.language", "fmu_models.lowering", "fmu_models.simulation"},
    "fmu_models.validation.bench": BASE
    | {
        "fmu_models.base.console",
        "fmu_models.oscillators",
        "fmu_models.lowering",
        "fmu_models.simulation",
        "fmu_models.validation.methods",
        "fmu_models.scene",
    },
    "fmu_models.report": BASE
    | {"fmu_models.base.console", "fmu_models.language", "fmu_models.lowering", "fmu_models.simulation"},
    "fmu_models.validation.stress": BASE
    | {
        "fmu_models.codegen",
        "fmu_models.base.console",
        "fmu_models.language",
        "fmu_models.lowering",
        "fmu_models.oscillators",
        "fmu_models.report",
        "fmu_models.simulation",
    },
    "fmu_models.commands.models": {"fmu_models"},
    "fmu_models.commands.maps": {"fmu_models"},
    "fmu_models.commands.scene": {"fmu_models"},
    "fmu_models.commands.bench": {"fmu_models"},
    "rig_io": {"fmu_models"},
    "identification": {"fmu_models", "rig_io"},
}
FILES = sorted(path for top in ("fmu_models", "rig_io", "identification") for path in (ROOT / top).rglob("*.py"))


def room_of(module: str) -> str | None:
    """The room a module of ours belongs to; None for a package's own root and for modules of others."""
    return next((room for room in ROOMS if module == room or module.startswith(room + ".")), None)


def imports(path: Path) -> list[str]:
    """Absolute names of every module that the file imports, wherever in it, `from a import b` counted as a.b."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide the floor they reach"
            found += [f"{node.module}.{alias.name}" for alias in node.names]
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_downwards(path):
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    room = room_of(module)
    assert room or module == "fmu_models", f"{module} is in no room: give it one in ROOMS"
    for imported in imports(path):
        target = room_of(imported)
        if target is None or target == room:
            continue
        allowed = ROOMS[room] if room else set()
        assert any(target == a or target.startswith(a + ".") for a in allowed), f"{module} may not import {imported}"
