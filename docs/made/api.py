"""Reference of Python: every public name, by package and room, from its docstring."""

from __future__ import annotations

import importlib
import inspect
from collections import defaultdict
from collections.abc import Iterator

PACKAGES = ("fmu_models", "identification", "rig_io")
INDENT = " " * 3


def pages() -> Iterator[tuple[str, str]]:
    """A page per package, which lists its names, and one per room, which explains them."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        rooms: dict[str, list[str]] = defaultdict(list)
        for name in module.__all__:
            rooms[getattr(module, name).__module__.split(".")[1]].append(name)
        yield f"reference/python/{package}.md", _package(package, rooms)
        for room, names in rooms.items():
            yield f"reference/python/{package}.{room}.md", _room(package, room, names)


def _package(package: str, rooms: dict[str, list[str]]) -> str:
    head, _, example = inspect.cleandoc(importlib.import_module(package).__doc__ or "").partition("\n\n")
    text = [f"# {package}", head, f"```python\n{example}\n```"]
    for room, names in sorted(rooms.items()):
        text.append(f"## [{room}]({package}.{room}.md)")
        rows = [f"| {{py:obj}}`~{package}.{name}` | {_first(package, name)} |" for name in names]
        text.append("\n".join(["| name | what it is |", "|---|---|", *rows]))
    listed = "\n".join(f"{package}.{room}" for room in sorted(rooms))
    return "\n\n".join([*text, f"```{{toctree}}\n:hidden:\n\n{listed}\n```"]) + "\n"


def _first(package: str, name: str) -> str:
    said = inspect.getdoc(getattr(importlib.import_module(package), name)) or ""
    return " ".join(said.partition("\n\n")[0].split()).replace("|", "\\|")


def _room(package: str, room: str, names: list[str]) -> str:
    head = (importlib.import_module(f"{package}.{room}").__doc__ or "").strip().splitlines()
    text = [f"# {package}: {room}", *head[:1]]
    for name in names:
        found = getattr(importlib.import_module(package), name)
        if callable(found):
            options = f"\n{INDENT}:members:" if inspect.isclass(found) else ""
            said = f".. {'autoclass' if options else 'autofunction'}:: {package}.{name}{options}"
        else:  # a value, whose docstring is that of its class
            said = f".. py:data:: {package}.{name}\n\n{INDENT}{_first(package, name)}"
        text.append(f"## {name}\n\n```{{eval-rst}}\n{said}\n```")
    return "\n\n".join(text) + "\n"
