"""What a package offers under one short name each, imported when it is asked for (PEP 562).

The package's ``__init__`` says it once, in imports that only type checkers and editors run:

    if TYPE_CHECKING:
        from fmu_models.simulation.run import simulate as simulate
    else:
        __getattr__, __dir__ = exports(__name__)
"""

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from fmu_models.base.version import version


def exports(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package; with ``__all__`` and ``__version__``."""
    module = sys.modules[package]

    @cache
    def offered() -> dict[str, str]:
        return _imports(Path(str(module.__file__)))

    def get(name: str) -> object:
        if name == "__all__":
            return sorted(offered())
        if name == "__version__":
            return version()
        if name.startswith("__") or name not in offered():
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(import_module(offered()[name]), name)
        setattr(module, name, value)
        return value

    return get, lambda: sorted({*vars(module), *offered(), "__all__", "__version__"})


def _imports(path: Path) -> dict[str, str]:
    """Module of each name that ``from module import name as name`` imports in a file, those for types alone."""
    return {
        alias.name: node.module
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
        if alias.asname == alias.name
    }
