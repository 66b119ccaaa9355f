"""Reference of the files that one writes: keys of a scene and of the sidecar of logs, as the checks know them."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from typing import Any

from fmu_models.scene.check import KEYS as SCENE
from fmu_models.scene.check_compute import AXES
from fmu_models.scene.check_compute import KEYS as COMPUTE
from fmu_models.scene.kinds import KINDS
from rig_io.logs.columns import COLUMNS
from rig_io.logs.log import (
    RIG_UNITS,
    Calibration,
    EncoderCalibration,
    Experiment,
    LaserCalibration,
    LoadCalibration,
    RigConstants,
)

KINDS_OF = {LaserCalibration: "laser", EncoderCalibration: "encoder, drive0, drive1", LoadCalibration: "load0, load1"}


def pages() -> Iterator[tuple[str, str]]:
    """A page for each of the two formats."""
    yield "reference/scene.md", "\n\n".join(_scene()) + "\n"
    yield "reference/sidecar.md", "\n\n".join(_sidecar()) + "\n"


def _scene() -> Iterator[str]:
    yield "# Keys of a scene"
    yield (
        'A value is a number in the unit of the model, or a text of number and unit: `0.83`, `"8 rpm"`, `"5 deg"`. '
        "`stickslip scene` lists the scenes that come along; copy one to begin with: `stickslip data copy "
        "scenes/disc_rig_class_a`. A key that nobody reads is refused, with its line."
    )
    yield _table(("key or table", "meaning"), SCENE.items())
    yield "## [compute]"
    yield _table(("key", "meaning"), COMPUTE.items())
    for name in KINDS.members():
        kind = KINDS.load(name)
        said = inspect.cleandoc(importlib.import_module(f"{KINDS.package}.{name}").__doc__ or "")
        yield f'## kind = "{name}"\n\n{said.replace("``", "`")}'
        if kind.axes:
            yield f"`[compute.axes]`: {kind.axes}, {AXES}."
        if kind.settings:
            own = ", ".join(f"`{key}` ({_default(value)})" for key, value in kind.settings.items())
            yield f"Keys of its own: {own}."
    yield "## [sensors]"
    yield _literal("rig_io.bench.scenes")


def _default(value: object) -> str:
    return "not set" if value is None else f"`{value}` if left out"


def _literal(module: str) -> str:
    """What a module says, its indented block as one of code."""
    said = inspect.cleandoc(importlib.import_module(module).__doc__ or "")
    return re.sub(r"\n\n((?: {4}.*\n)+)", lambda block: f"\n\n```text\n{inspect.cleandoc(block[1])}\n```\n", said)


def _sidecar() -> Iterator[str]:
    yield "# Keys of the sidecar of logs"
    yield (
        "Logs of a folder are described in its `datapackage.json` ([Frictionless Data Package]"
        "(https://specs.frictionlessdata.io/data-package/)), which `stickslip describe` writes. "
    )
    yield inspect.cleandoc(importlib.import_module("rig_io.packages.sidecar").__doc__ or "").replace("``", "`")
    yield "## Columns"
    yield inspect.cleandoc(importlib.import_module("rig_io.packages.described").__doc__ or "").replace("``", "`")
    rows = ((f"`{one.name}`", one.unit, one.description) for one in COLUMNS.values())
    yield _table(("role", "unit", "meaning"), rows)
    yield "## rig\n\n" + _said(RigConstants)
    yield _table(("constant", "unit"), RIG_UNITS.items())
    yield "## experiment\n\n" + _said(Experiment)
    yield _fields(Experiment)
    yield "## calibration\n\n" + _said(Calibration)
    for kind, instruments in KINDS_OF.items():
        yield f"### {instruments}\n\n" + _said(kind)
        yield _fields(kind)


def _said(kind: type) -> str:
    return (inspect.getdoc(kind) or "").replace("``", "`").replace("*", "\\*")


def _fields(kind: type[Any]) -> str:
    rows = []
    for one in fields(kind):
        needed = one.default is MISSING and one.default_factory is MISSING
        given = "" if one.default in (None, MISSING, ()) else str(one.default)
        rows.append((one.name, str(one.type).replace("|", "or"), "needed" if needed else given))
    return _table(("key", "type", "if left out"), rows)


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]] | Mapping[str, str]) -> str:
    lines = [head, ("---",) * len(head)]
    for first, *others in rows:
        lines.append((first if first.startswith("`") else f"`{first}`", *(text.replace("|", "\\|") for text in others)))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
