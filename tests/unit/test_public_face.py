"""What the packages offer by one short name: it is there, says what it is, and costs nothing until it is asked for."""

from __future__ import annotations

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import manual
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("fmu_models", "rig_io", "identification")
NAMES = [(package, name) for package in PACKAGES for name in importlib.import_module(package).__all__]


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_every_name_resolves_and_has_a_docstring(package, name):
    found = getattr(importlib.import_module(package), name)
    called = getattr(found, "__name__", name)  # a value, such as TIME, has none of its own
    assert called == name, f"{package}.{name} is '{called}': one name each"
    said = found.__doc__ or ""
    assert said.strip() and not said.startswith(f"{name}("), f"{package}.{name} has no docstring of its own"
    place = getattr(found, "__module__", package)
    assert place.split(".")[0] == package, f"{package}.{name} is of {place}: the manual lists it there"


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_is_that_of_a_room(package):
    rooms = {path.name for path in (ROOT / package).iterdir() if path.is_dir()}
    assert not rooms & set(importlib.import_module(package).__all__), "importing the room would hide the name"


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_knows_its_version_and_what_it_does_not_have(package):
    module = importlib.import_module(package)
    assert re.fullmatch(r"\d+\.\d+.*", module.__version__)
    assert {"__version__", *module.__all__} <= set(dir(module))
    assert (Path(module.__file__ or "").parent / "py.typed").is_file()
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = module.nonsense


def test_importing_the_packages_loads_nothing_heavy():
    code = (
        "import sys, fmu_models, rig_io, identification\n"
        "heavy = {'numpy', 'scipy', 'sympy', 'matplotlib', 'pandas', 'fmpy', 'pint'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "from fmu_models import Fmu\n"
        "assert 'sympy' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_star_imports_bring_all_of_it():
    names: dict[str, object] = {}
    exec("from rig_io import *", names)
    assert set(importlib.import_module("rig_io").__all__) <= set(names)


def test_the_manual_imports_from_package_roots_alone():
    blocks = [manual.python(page) + manual.cells(page) for page in manual.pages()]
    assert len([block for block in blocks if block]) > 3
    for line in "\n".join(blocks).splitlines():
        if found := re.match(r"\s*(?:from|import) ((?:fmu_models|rig_io|identification)[\w.]*)", line):
            assert found[1] in PACKAGES, line


def test_the_papers_name_the_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\n## {version}" in (ROOT / "CHANGELOG.md").read_text("utf-8")


ASKED = {"overwrite", "trust", "json", "resume"}


def _defaults(tree: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Names of parameters and fields with their defaults."""
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value is not None:
            yield node.target.id, node.value
        if isinstance(node, ast.arguments):
            places = [*node.posonlyargs, *node.args]
            ends = places[len(places) - len(node.defaults) :]
            yield from ((place.arg, value) for place, value in zip(ends, node.defaults, strict=True))
            keyed = zip(node.kwonlyargs, node.kw_defaults, strict=True)
            yield from ((place.arg, value) for place, value in keyed if value is not None)


def test_nothing_is_overwritten_trusted_or_resumed_unless_it_is_asked():
    """In no function, no command and no bundle of options."""
    seen = 0
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for name, value in _defaults(ast.parse(path.read_text("utf-8"))):
                if name in ASKED:
                    seen += 1
                    assert isinstance(value, ast.Constant), f"{path}: the default of '{name}'"
                    assert value.value is False, f"{path}: '{name}' is {value.value} unless something else is asked"
    assert seen > 80
