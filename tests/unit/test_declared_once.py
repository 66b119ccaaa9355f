"""No default of an option is typed twice: help texts, commands and scenes take it from where it is declared."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args

import pytest

from fmu_models.analyses.declaration import ANALYSES
from fmu_models.commands.analysis import command_of
from fmu_models.scene.kinds import KINDS

ROOT = Path(__file__).parents[2]
COMMANDS = [
    path for top in ("fmu_models", "rig_io", "identification") for path in (ROOT / top / "commands").glob("*.py")
]
TYPED = re.compile(r"\bdefault\b[^)\]{]*\d")  # a number behind the word, in a text that no value is put into
# what stands in a module that takes long to import is typed in the help, and compared with that here
SLOW: dict[str, tuple[str, Callable[[Any], str]]] = {
    "(default: 5 s before)": (
        "rig_io.bench.emulation",
        lambda module: f"(default: {module.Emulation.transient:g} s before)",
    ),
    "(default: 0,0,-9.81)": (
        "identification.machines.urdf",
        lambda module: f"(default: {','.join(f'{value:g}' for value in module.GRAVITY)})",
    ),
    "(default: 24)": ("identification.calibration.search", lambda module: f"(default: {module.GUESSES})"),
    "(default: 3)": ("identification.calibration.search", lambda module: f"(default: {module.STARTS})"),
    "(default: 1)": ("identification.machines.scores", lambda module: f"(default: {module.FREE_RUN:g})"),
}


def texts(path: Path) -> Iterator[str]:
    """Constant pieces of the helps of arguments and options."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("typer.Option", "typer.Argument"):
            for inner in ast.walk(node):
                if isinstance(inner, ast.Constant) and isinstance(inner.value, str):
                    yield inner.value


def test_the_pattern_finds_a_typed_default() -> None:
    assert TYPED.search("Number of them (default: 20).") and not TYPED.search("(default: all). FMI 2.0")


@pytest.mark.parametrize("path", COMMANDS, ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_helps_type_no_number_as_default(path: Path) -> None:
    assert not [text for text in texts(path) if TYPED.search(text) and not any(known in text for known in SLOW)]


@pytest.mark.parametrize("typed", SLOW)
def test_a_default_of_a_slow_module_is_as_typed(typed: str) -> None:
    module, written = SLOW[typed]
    assert written(importlib.import_module(module)) == typed


@pytest.mark.parametrize("name", ANALYSES.members())
def test_an_analysis_has_one_default_for_all_faces(name: str) -> None:
    analysis, kind = ANALYSES.load(name), KINDS.load(name)
    command = inspect.signature(command_of(name)).parameters
    function = inspect.signature(analysis.function).parameters
    for option, declared in analysis.options.items():
        assert command[option].default is None, "left out, the function's own default holds"
        assert declared.default == function[option].default
        (shown,) = [note for note in get_args(command[option].annotation)[1:] if hasattr(note, "show_default")]
        if isinstance(declared.default, int | float) and not isinstance(declared.default, bool):
            assert shown.show_default in (str(declared.default), declared.option.default)
        if option in kind.settings and declared.option.in_scene is None:
            assert kind.settings[option] == declared.default
        assert declared.option.in_scene is None or declared.option.in_scene != declared.default
