"""Reference of C: the headers whose functions a library of a model offers to programs, as they stand."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import fmu_models

ENGINE = Path(str(fmu_models.__file__)).parent / "engine"
EXPORTED = re.compile(r"^WHOLE_RUN_EXPORT .*?\b(stickslip_\w+)\(.*?\);", re.MULTILINE)
INTRODUCTION = """\
# Functions in C

The library that is built of a model, as an FMU or for the runs of this suite, has the functions of FMI 2.0 and 3.0;
their headers are those of the standard. Built for the suite, it has those below too: a whole run, a run with
derivatives, or many runs in one call. Values go by the value references of the FMU's `modelDescription.xml`. No
function keeps anything between instances: several may run at once, each in one thread. The module
`fmu_models.simulation.whole_run` calls them from Python.
"""


def pages() -> Iterator[tuple[str, str]]:
    """One page: each header with exported functions, and those of its room that it includes before it."""
    text = [INTRODUCTION]
    for header in _headers():
        source = header.read_text("utf-8")
        text.append(f"## {header.relative_to(ENGINE.parent).as_posix()}")
        if found := EXPORTED.findall(source):
            text.append("Functions: " + ", ".join(f"`{name}`" for name in found) + ".")
        text.append(f"```c\n{source.strip()}\n```")
    yield "reference/c.md", "\n\n".join(text) + "\n"


def _headers() -> list[Path]:
    offering = [path for path in sorted(ENGINE.rglob("*.h")) if EXPORTED.search(path.read_text("utf-8"))]
    found: dict[Path, None] = {}
    for path in sorted(offering, key=lambda one: (one.parent.name != "whole_run", one.name)):
        for name in re.findall(r'^#include "(\w+\.h)"', path.read_text("utf-8"), re.MULTILINE):
            found[path.parent / name] = None
        found[path] = None
    return list(found)
